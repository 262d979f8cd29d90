# SPDX-License-Identifier: Apache-2.0
"""What floats partly immersed: draught, heave period and upthrust of round hulls and spheres."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import sim_core as sc
from sim_core import _core

RHO, G = 1000.0, 9.81
RADIUS, LENGTH = 0.06, 1.2
FRACTIONS = [0.05, 0.25, 0.5, 0.75, 0.9]


def hull(fraction, strips=20):
    """A level cylinder of such a mass that this share of it floats under water."""
    volume = math.pi * RADIUS**2 * LENGTH
    mass = fraction * RHO * volume
    return sc.Body(
        mass=mass, inertia=(0.5 * mass * RADIUS**2, mass * LENGTH**2 / 12, mass * LENGTH**2 / 12),
        volume=volume, diameter=2 * RADIUS, length=LENGTH, axial_drag=0.0, cross_flow_drag=0.0,
        munk_moment=0.0, strips=strips,
    )  # fmt: skip


def segment_area(depth):
    """Of a circle of radius 1 whose centre lies `depth` below the surface (Bronshtein)."""
    depth = min(max(depth, -1.0), 1.0)
    return math.acos(-depth) + depth * math.sqrt(1.0 - depth**2)


def depth_of(fraction):
    return brentq(lambda d: segment_area(d) - fraction * math.pi, -1.0, 1.0, xtol=1e-14)


def residual(model, z, quaternion=(1, 0, 0, 0)):
    state = sc.State(model)
    state.set_body("fish", (0, 0, z), quaternion)
    return _core._residual(state)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_draught_of_a_round_hull(free_body, fraction):
    """Archimedes, with the area of the circular segment: at that depth nothing is left over."""
    body = hull(fraction)
    force = residual(free_body(body), -RADIUS * depth_of(fraction))
    assert force == pytest.approx(np.zeros(6), abs=1e-9 * body.mass * G)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_heave_stiffness_of_a_round_hull(free_body, fraction):
    """ρg times the waterplane, 2 L √(r² − h²)."""
    depth = RADIUS * depth_of(fraction)
    model = free_body(hull(fraction))
    h = 1e-6
    slope = (residual(model, -depth + h)[2] - residual(model, -depth - h)[2]) / (2 * h)
    waterplane = 2 * LENGTH * math.sqrt(RADIUS**2 - depth**2)
    assert slope == pytest.approx(-RHO * G * waterplane, rel=1e-6)


def test_heave_period_of_a_floating_hull(free_body):
    """T = 2π √(m / (ρg A_w)) without added mass: after 10 1/4 of them it passes the middle. The
    scheme's phase lags by (ωh)²/12 of 64 rad, 5e-3; nonlinearity, (a/r)² = 7e-5, adds as much."""
    body = hull(0.25)
    model = free_body(body)
    depth = RADIUS * depth_of(0.25)
    waterplane = 2 * LENGTH * math.sqrt(RADIUS**2 - depth**2)
    period = 2 * math.pi * math.sqrt(body.mass / (RHO * G * waterplane))
    state = sc.State(model)
    state.set_body("fish", (0, 0, -depth + 0.0005))
    simulator = sc.Simulator(
        model, state, integrator=sc.GeneralizedAlpha(rho_inf=1.0), max_step=period / 200
    )
    far = sc.SteadyTow(position=(0, 0, 0))
    simulator.step(10.25 * period, far)
    moved = simulator.body_position("fish")[2] + depth
    assert moved == pytest.approx(0.0, abs=0.0005 * 0.02)


@pytest.mark.parametrize("pitch", [0.1, 0.5, 1.2])
def test_upthrust_of_a_pitched_hull(free_body, pitch):
    """Each slice across the axis has the segment of its own depth over r cos(pitch); integrated by
    quadrature. 200 strips: the midpoint rule, and half heights that allow for the strips' length,
    (dx tan(pitch)/2r)²/2 of a slice's change, 2e-3 at a pitch of 1.2."""
    body = hull(0.5, strips=200)
    model = free_body(body)
    turn = (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0)
    for z in (-0.04, 0.0, 0.03):
        depth = lambda x, z=z: -(z - x * math.sin(pitch)) / (RADIUS * math.cos(pitch))  # noqa: E731
        area = (
            RADIUS**2
            * quad(
                lambda x, depth=depth: segment_area(depth(x)), -LENGTH / 2, LENGTH / 2, limit=200
            )[0]
        )
        force = residual(model, z, turn)[2] + body.mass * G
        assert force == pytest.approx(RHO * G * area, abs=1e-3 * body.mass * G)


def test_upright_hull_goes_under_evenly(free_body):
    """A vertical hull: the immersed length, without steps as strip follows strip, to 1 % of one."""
    body = hull(0.5, strips=10)
    model = free_body(body)
    turn = (math.sqrt(0.5), 0, math.sqrt(0.5), 0)
    strip = RHO * G * body.volume / 10
    for z in np.linspace(-0.3, 0.3, 41):
        force = residual(model, z, turn)[2] + body.mass * G
        wet = 10 * (0.5 - z / LENGTH)
        assert force / strip == pytest.approx(wet, abs=0.06)  # segment against rectangle: 0.058


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_draught_of_a_sphere(free_sphere, fraction):
    """The cap of height r + h has the volume π (r + h)² (2r − h)/3."""
    radius = 0.15
    volume = 4 / 3 * math.pi * radius**3
    depth = brentq(
        lambda h: math.pi * (radius + h) ** 2 * (2 * radius - h) / 3 - fraction * volume,
        -radius, radius, xtol=1e-15,
    )  # fmt: skip
    model = free_sphere(fraction * RHO * volume, volume, 0.0, 0.0)
    state = sc.State(model)
    state.set_point("sphere", (0, 0, -depth))
    assert _core._residual(state)[:3] == pytest.approx(np.zeros(3), abs=1e-6)
