# SPDX-License-Identifier: Apache-2.0
"""What a sensor at a place on a body would record."""

import math

import numpy as np
import pytest

import sim_core as sc

NOSE = (0.65, 0.02, -0.03)


@pytest.fixture(scope="module")
def spinning(free_body):
    """A neutral body that turns about z at a constant rate while it moves on."""
    body = sc.Body(
        mass=12.5, inertia=(0.02, 1.8, 1.8), volume=0.0125, diameter=0.11, length=1.3,
        axial_drag=0.0, cross_flow_drag=0.0, places={"nose": NOSE},
    )  # fmt: skip
    model = free_body(body)
    state = sc.State(model)
    state.set_body("fish", (0, 0, -900), velocity=(0.5, 0, 0), angular_velocity=(0, 0, 2.0))
    still = sc.SteadyTow(position=(0, 0, 0))
    # second order: phase (ωh)²/12 per rad
    return sc.run(model, still, t_end=1.0, state=state, output_step=0.1, max_step=1e-3)


def test_place_on_a_spinning_body_moves_on_a_circle(spinning):
    """Velocity ω × r, centripetal acceleration ω² r inwards, felt constant in body axes."""
    fish, t = spinning.bodies["fish"], spinning.time
    nose = fish.at("nose")
    r, start = math.hypot(NOSE[0], NOSE[1]), math.atan2(NOSE[1], NOSE[0])
    angle = start + 2.0 * t
    circle = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full_like(t, NOSE[2])])
    centre = np.column_stack([0.5 * t, 0 * t, np.full_like(t, -900.0)])
    assert nose.position == pytest.approx(centre + circle, abs=1e-5)
    moving = np.column_stack([-np.sin(angle), np.cos(angle), 0 * t])
    assert nose.velocity == pytest.approx(2.0 * r * moving + [0.5, 0, 0], abs=1e-5)
    inwards = -4.0 * circle * [1, 1, 0]
    assert nose.acceleration == pytest.approx(inwards, abs=1e-4)
    felt = [-4.0 * NOSE[0], -4.0 * NOSE[1], 9.81]
    assert nose.specific_force == pytest.approx(np.tile(felt, (len(t), 1)), abs=1e-4)
    assert fish.position_of("nose") == pytest.approx(fish.at(NOSE).position, abs=1e-12)


def test_place_agrees_with_the_end_of_the_line_there(nit_model):
    """In a tow with heave the secondary's end is a place on the fish and moves alike."""
    model = nit_model(segments=(4, 1, 3))
    motion = sc.Sinusoid(mean=(0, 0, 0.2), velocity=(1, 0, 0), amplitude=0.06, period=2)
    result = sc.run(model, motion, t_end=1.0, output_step=0.1)
    place = result.bodies["fish"].at((0.65, 0.0, 0.0))
    end = result.lines["secondary"].node_positions[:, -1]
    assert place.position == pytest.approx(end, abs=1e-12)
    final = result.final_state
    assert place.velocity[-1] == pytest.approx(final.node_velocities("secondary")[-1], abs=1e-12)
    assert place.acceleration[-1] == pytest.approx(
        final.node_accelerations("secondary")[-1], abs=1e-10
    )


def test_yaw_pitch_roll(free_body):
    """Turns about z, y, x one after the other."""
    body = sc.Body(
        mass=1.0, inertia=(0.1, 0.1, 0.1), volume=1e-3, diameter=0.1, length=0.1,
        axial_drag=0.0, cross_flow_drag=0.0,
    )  # fmt: skip
    model = free_body(body)
    yaw, pitch, roll = 0.4, -0.7, 2.0

    def about(axis, angle):
        return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * np.eye(3)[axis])])

    def product(a, b):
        w = a[0] * b[0] - a[1:] @ b[1:]
        return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])

    state = sc.State(model)
    q = product(product(about(2, yaw), about(1, pitch)), about(0, roll))
    state.set_body("fish", (0, 0, -900), q)
    result = sc.run(model, sc.SteadyTow(position=(0, 0, 0)), t_end=0.01, state=state)
    assert result.bodies["fish"].yaw_pitch_roll[0] == pytest.approx([yaw, pitch, roll], abs=1e-12)


def test_unknown_place_is_named(spinning):
    with pytest.raises(sc.InvalidInput, match="no place 'tail' on the body; there are: 'nose'"):
        spinning.bodies["fish"].at("tail")
