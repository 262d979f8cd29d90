# SPDX-License-Identifier: Apache-2.0
"""Weight, buoyancy and flooded water of a body made of parts."""

import math

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

FAR = (0.0, 0.0, -900.0)


def test_even_cylinder_in_two_halves_is_the_whole():
    """Two half cylinders end to end have the inertia of the whole: m(L²/12 + r²/4) across."""
    mass, length, diameter = 12.0, 1.4, 0.12
    gyration = sc.cylinder_gyration(length / 2, diameter)
    halves = [
        sc.Part(mass / 2, 0.005, (x, 0, 0), mass / 2 * gyration) for x in (-length / 4, length / 4)
    ]
    whole = sc.mass_properties(halves)
    across = mass * (length**2 / 12 + diameter**2 / 16)
    assert whole.mass == mass
    assert whole.inertia == pytest.approx(
        np.diag([mass * diameter**2 / 8, across, across]), abs=1e-14
    )
    assert whole.centre_of_gravity == pytest.approx([0, 0, 0], abs=1e-15)


def test_parallel_axes_give_products_of_inertia():
    part = sc.mass_properties([sc.Part(2.0, 1e-3, (0.3, 0.2, -0.1))])
    expected = 2.0 * np.array([[0.05, -0.06, 0.03], [-0.06, 0.10, 0.02], [0.03, 0.02, 0.13]])
    assert part.inertia == pytest.approx(expected, abs=1e-15)


def test_no_parts_no_body():
    with pytest.raises(ValueError, match="no mass"):
        sc.mass_properties([])


@pytest.fixture(scope="module")
def flooded():
    """A shell of 2 mm plastic, lead below, foam above, the rest full of water."""
    length, diameter, density = 1.3, 0.11, 1000.0
    envelope = math.pi / 4 * diameter**2 * length
    solid = {"shell": 1.1e-3, "lead": 1e-4, "foam": 2.0e-3}
    gyration = sc.cylinder_gyration(length, diameter)
    dry = [
        sc.Part(1.4, solid["shell"], (0, 0, 0), 1.4 * gyration),
        sc.Part(1.13, solid["lead"], (0.1, 0, -0.04)),
        sc.Part(0.2, solid["foam"], (-0.1, 0, 0.03)),
    ]
    water = sc.enclosed_water(envelope - sum(solid.values()), (0.01, 0, 0), gyration)
    return dry, water, density


def test_enclosed_water_weighs_nothing_but_has_inertia(flooded):
    dry, water, density = flooded
    full, empty = sc.mass_properties([*dry, water]), sc.mass_properties(dry)
    assert full.weight_in_water(density) == pytest.approx(empty.weight_in_water(density), abs=1e-9)
    assert full.mass == pytest.approx(empty.mass + water.mass)
    assert np.linalg.eigvalsh(full.inertia - empty.inertia)[1:].min() > 0.5


def as_body(p, **changes):
    return sc.Body(
        mass=p.mass,
        inertia=p.inertia,
        centre_of_gravity=p.centre_of_gravity,
        volume=p.volume,
        centre_of_buoyancy=p.centre_of_buoyancy,
        diameter=0.11,
        length=1.3,
        axial_drag=0.0,
        cross_flow_drag=0.0,
        **changes,
    )


def test_at_rest_the_body_feels_weight_and_buoyancy_of_its_dry_parts(free_body, flooded):
    """Whatever the attitude: Σ (ρ V − m) g at each part's centre, without the enclosed
    water."""
    dry, water, density = flooded
    model = free_body(as_body(sc.mass_properties([*dry, water])))
    q = np.array([0.8, 0.3, -0.4, 0.33])
    q /= np.linalg.norm(q)
    w, x, y, z = q
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    state = sc.State(model)
    state.set_body("fish", FAR, q)
    residual = _core._residual(state)
    lifts = [(density * p.volume - p.mass) * 9.81 for p in dry]
    moments = [np.cross(p.centre, lift * up) for p, lift in zip(dry, lifts, strict=True)]
    assert residual[:3] == pytest.approx([0, 0, sum(lifts)], abs=1e-9)
    assert residual[3:] == pytest.approx(sum(moments), abs=1e-9)


def test_enclosed_water_slows_the_pitch_swing(free_body):
    """Small pitch swing of a neutral body with 1 kg of lead at a depth a below its axis:
    ω² = 1 kg g a/I, I of everything about the centre of gravity, the water included."""
    gyration, a = sc.cylinder_gyration(1.3, 0.11), 0.05
    parts = [
        sc.Part(2.0, 2e-3, (0, 0, 0), 2.0 * gyration),
        sc.Part(1.0, 0.0, (0, 0, -a)),
        sc.Part(0.0, 1e-3, (0, 0, 0)),  # foam
        sc.enclosed_water(9e-3, (0, 0, 0), gyration),
    ]
    inertia = 11.0 * gyration[1] + 1.0 * a**2 - 12.0 * (a / 12.0) ** 2
    omega = math.sqrt(9.81 * a / inertia)
    model = free_body(as_body(sc.mass_properties(parts)))
    state = sc.State(model)
    amplitude = 1e-3
    state.set_body("fish", FAR, (math.cos(amplitude / 2), 0, math.sin(amplitude / 2), 0))
    quarter = 0.5 * math.pi / omega
    simulator = sc.Simulator(
        model,
        state,
        integrator=sc.GeneralizedAlpha(rho_inf=1.0),
        max_step=quarter / 1000,  # phase off by (π/2)³/(12 × 10⁶) = 3e-7
        newton_tolerance=1e-13,
    )
    simulator.step(quarter, sc.SteadyTow(position=(0, 0, 0)))
    assert 2 * simulator.body_quaternion("fish")[2] == pytest.approx(0.0, abs=1e-6 * amplitude)
    rate = simulator.body_angular_velocity("fish")[1]
    assert rate == pytest.approx(-amplitude * omega, rel=1e-6)


def test_floating_body_keeps_its_water(free_body):
    """Half out of the water it still carries the water that it encloses: equilibrium is where
    the immersed half displaces the mass of all its parts."""
    shell = sc.Part(1.0, 1.0e-3, (0, 0, -0.01), 1.0 * sc.cylinder_gyration(1.3, 0.11))
    water = sc.enclosed_water(3e-3, (0, 0, -0.01), sc.cylinder_gyration(1.3, 0.11))
    foam = sc.Part(0.0, 4.0e-3, (0, 0, 0))
    p = sc.mass_properties([shell, water, foam])
    assert p.mass == pytest.approx(1000.0 * p.volume / 2)
    body = as_body(p)
    state = sc.State(free_body(body))
    state.set_body("fish", (0, 0, 0))
    assert _core._residual(state)[:3] == pytest.approx([0, 0, 0], abs=1e-9)
