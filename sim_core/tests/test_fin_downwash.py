# SPDX-License-Identifier: Apache-2.0
"""A tail in the downwash of front fins, and estimates of lift slope and downwash."""

import math

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

FAR = (0.0, 0.0, -900.0)
RHO, SLOPE, STALL = 1000.0, 0.4, 0.25


def body(downwash, front=(0.3, 0.05, 0.02), rear=(-0.5, 0.0, 0.1), normals=((0, 0, 1), (0, 0, 1))):
    settings = {
        "area": 0.01, "drag": 0.0, "cross_flow_drag": 0.0, "stall_angle": STALL,
        "aspect_ratio": math.inf,
    }  # fmt: skip
    fins = [
        sc.Fin(position=front, normal=normals[0], lift_slope=2.5, **settings),
        sc.Fin(position=rear, normal=normals[1], lift_slope=3.0, **settings),
    ]
    return sc.Body(
        mass=12.5, inertia=(0.02, 1.8, 1.8), volume=0.0125, diameter=0.11, length=1.3,
        axial_drag=0.0, cross_flow_drag=0.0, fins=fins, downwash=downwash,
    )  # fmt: skip


BEHIND = [sc.Downwash(front=0, rear=1, slope=SLOPE)]


def force_at(model, alpha, speed=1.5, spin=(0, 0, 0)):
    """Force on the fins at a nose-up incidence: the body is level, its velocity slopes down."""
    state = sc.State(model)
    velocity = (speed * math.cos(alpha), 0, -speed * math.sin(alpha))
    state.set_body("fish", FAR, velocity=velocity, angular_velocity=spin)
    return _core._residual(state)


def test_tail_loses_the_share_of_the_downwash(free_body):
    """Small incidence: the tail lifts as at (1 − dε/dα) α, with dε/dα = 1 not at all."""
    alpha, speed = 1e-4, 1.5
    q = 0.5 * RHO * 0.01 * speed**2

    def lift(model):
        return force_at(model, alpha)[2] / (q * alpha)

    # thread's weight and sin α cos α: relative 1e-8 of either
    assert lift(free_body(body([]))) == pytest.approx(2.5 + 3.0, rel=1e-6)
    assert lift(free_body(body(BEHIND))) == pytest.approx(2.5 + 3.0 * (1 - SLOPE), rel=1e-6)
    full = [sc.Downwash(front=0, rear=1, slope=1.0)]
    assert lift(free_body(body(full))) == pytest.approx(2.5, rel=1e-6)


def test_downwash_levels_off_with_the_lift_of_the_front_fin(free_body):
    """Far beyond stall of both: the rear fin meets the flow turned by slope × sin(stall), which
    leaves its incidence beyond stall too."""
    alpha = 1.0
    ahead, none = (force_at(free_body(body(d)), alpha) for d in (BEHIND, []))
    c, w = 1.5 * math.cos(alpha), 1.5 * math.sin(alpha)
    turned = w - SLOPE * math.sin(STALL) * c

    def rear(w):
        """½ρS a S (c² n + c w x) with S level; thread and front fin are alike in both."""
        return 0.5 * RHO * 0.01 * 3.0 * math.sin(STALL) * np.array([c * w, 0, c * c])

    # S is level to (1/8)(sin stall / sin α)⁸ = 1e-5 at the incidences here
    assert ahead[:3] - none[:3] == pytest.approx(rear(turned) - rear(w), abs=2e-4)


def test_downwash_ends_in_flow_from_behind(free_body):
    for alpha in (2.0, math.pi - 0.1):
        with_, without = (force_at(free_body(body(d)), alpha) for d in (BEHIND, []))
        assert with_ == pytest.approx(without, abs=1e-12)


def test_tail_feels_the_rotation_at_the_front_fin(free_body):
    """A pitch rate q (nose down) moves the front fin down by q x: its incidence q x/U washes the
    tail down by slope times that, besides the tail's own −q x/U."""
    q, speed = 1e-4, 1.5
    residual = force_at(free_body(body(BEHIND)), 0.0, speed, (0, q, 0))
    pressure = 0.5 * RHO * 0.01 * speed**2
    front, rear = q * 0.3 / speed, -q * 0.5 / speed
    expected = pressure * (2.5 * front + 3.0 * (rear - SLOPE * front))
    assert residual[2] == pytest.approx(expected, rel=1e-3)  # heights of the fins: c ± q z, 1e-5


def test_jacobian_with_downwash(free_body):
    """Two front fins on a tail that is askew, at random flows from ahead (without kinks)."""
    fins = body([], normals=((0, 0.1, 1), (0.2, 0.3, 1))).fins
    other = sc.Fin(position=(0.2, -0.1, 0), normal=(0, -0.3, 1), area=0.02, lift_slope=2.0)
    tail = sc.Body(
        mass=12.5, inertia=(0.02, 1.8, 1.8), volume=0.0125, diameter=0.11, length=1.3,
        axial_drag=0.0, cross_flow_drag=0.0, fins=[*fins, other],
        downwash=[*BEHIND, sc.Downwash(front=2, rear=1, slope=0.3)],
    )  # fmt: skip
    model = free_body(tail)
    rng = np.random.default_rng(7)
    h = 1e-6
    for _ in range(20):
        state = sc.State(model)
        velocity = np.array([1.5, 0, 0]) + 0.3 * rng.normal(size=3)
        state.set_body("fish", FAR, (1, 0.1, -0.1, 0.05), velocity, 0.5 * rng.normal(size=3))
        for rates in ((1, 0, 0), (0, 1, 0)):
            analytic = _core._jacobian(state, rates)
            for i in range(6):
                step = np.zeros(6)
                step[i] = h
                up = _core._residual(_core._displaced(state, step, rates))
                down = _core._residual(_core._displaced(state, -step, rates))
                assert (up - down) / (2 * h) == pytest.approx(analytic[:, i], abs=1e-5)


def test_refuses_downwash_between_fins_that_are_not_there(free_body):
    with pytest.raises(sc.InvalidInput, match="indices of two of its fins"):
        free_body(body([sc.Downwash(front=0, rear=2, slope=0.4)]))


def test_lift_slope_between_its_limits():
    """Helmbold: Jones's πA/2 for low aspect ratios, 2π cos Λ for high ones; a rectangular wing of
    aspect ratio 6 has 4.3 per rad by lifting-surface theory (Helmbold: 4.53 × … within 6 %)."""
    assert sc.lift_slope(1e-4) == pytest.approx(math.pi * 1e-4 / 2, rel=1e-6)
    assert sc.lift_slope(1e6) == pytest.approx(2 * math.pi, rel=1e-5)
    assert sc.lift_slope(1e6, sweep=0.5) == pytest.approx(2 * math.pi * math.cos(0.5), rel=1e-5)
    assert sc.lift_slope(6.0) == pytest.approx(4.53, rel=2e-3)
    with pytest.raises(ValueError, match="aspect_ratio"):
        sc.lift_slope(0.0)


def test_downwash_of_a_slender_front_fin_takes_all():
    """Low aspect ratio: a = πA/2 gives dε/dα = 2a/(πA) = 1; high: 4/A."""
    assert sc.downwash_slope(sc.lift_slope(1e-4), 1e-4) == pytest.approx(1.0, rel=1e-4)
    assert sc.downwash_slope(sc.lift_slope(1e4), 1e4) == pytest.approx(4e-4, rel=1e-3)


def test_body_lift_factor():
    assert sc.body_lift_factor(0.0, 0.1) == 1.0
    assert sc.body_lift_factor(0.05, 0.1) == pytest.approx(2.25)
    with pytest.raises(ValueError, match="tip_radius"):
        sc.body_lift_factor(0.1, 0.1)
