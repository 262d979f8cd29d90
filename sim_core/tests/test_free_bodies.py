# SPDX-License-Identifier: Apache-2.0
"""Motions of a rigid body with a closed form: fall, torque-free rotation, swings on two lines."""

import math

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import sim_core as sc
from sim_core import _core

FAR = (0.0, 0.0, -900.0)
STILL = sc.SteadyTow(position=(0, 0, 0))


def body(**changes):
    settings = {
        "mass": 12.5, "inertia": (0.05, 1.8, 1.8), "volume": 0.0125, "diameter": 0.11,
        "length": 1.3, "axial_drag": 0.0, "cross_flow_drag": 0.0,
    }  # fmt: skip
    return sc.Body(**(settings | changes))


@pytest.mark.parametrize("pitch", [0.0, math.pi / 2])
def test_falling_cylinder(free_body, pitch):
    """v = v_t tanh(t/τ), v_t = √(2W/(ρ Cd A)), τ = (m + m_a) v_t/W: broadside and nose first."""
    axial, lateral = 1.0, 11.0
    model = free_body(
        body(
            mass=14.0,
            inertia=(0.05, 2.0, 2.0),
            added_mass=(axial, lateral, lateral, 0, 1.2, 1.2),
            axial_drag=0.8,
            cross_flow_drag=1.1,
        )
    )
    weight = (14.0 - 12.5) * 9.81
    area, added = (1.1 * 0.11 * 1.3, lateral) if pitch == 0.0 else (0.8 * 0.055**2 * math.pi, axial)
    v_t = math.sqrt(2 * weight / (1000 * area))
    tau = (14.0 + added) * v_t / weight
    state = sc.State(model)
    state.set_body("fish", FAR, (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0))
    # Second order: the error is about (h/τ)²/12 = 2e-8 of v_t.
    simulator = sc.Simulator(model, state, max_step=tau / 2000)
    for t in (0.3 * tau, tau):
        simulator.step(t, STILL)
        velocity = simulator.body_velocity("fish")
        assert velocity == pytest.approx([0, 0, -v_t * math.tanh(t / tau)], abs=1e-6 * v_t)


def test_torque_free_rotation(free_body):
    """Euler's equations for three moments of inertia (Landau & Lifshitz, Mechanics, § 37):
    ω = (A cn, B sn, C dn) over one period of the polhode."""
    moments = np.array([0.6, 1.0, 1.5])
    model = free_body(body(inertia=moments))
    w1, w3 = 0.8, 1.5  # at the start; ω2 = 0
    energy2 = moments[0] * w1**2 + moments[2] * w3**2  # 2E
    square = (moments[0] * w1) ** 2 + (moments[2] * w3) ** 2  # of the angular momentum
    i1, i2, i3 = moments
    low, high = square - energy2 * i1, energy2 * i3 - square
    assert square > energy2 * i2, "the case of the closed form"
    amplitude = np.sqrt([high / (i1 * (i3 - i1)), high / (i2 * (i3 - i2)), low / (i3 * (i3 - i1))])
    assert amplitude[[0, 2]] == pytest.approx([w1, w3], rel=1e-12)
    rate = math.sqrt((i3 - i2) * low / (i1 * i2 * i3))
    m = (i2 - i1) * high / ((i3 - i2) * low)
    period = 4 * ellipk(m) / rate
    state = sc.State(model)
    state.set_body("fish", FAR, angular_velocity=(w1, 0, w3))
    # (2π/6000)²/12 = 9e-8 of phase per radian, times 2π
    simulator = sc.Simulator(
        model,
        state,
        integrator=sc.GeneralizedAlpha(rho_inf=1.0),
        max_step=period / 6000,
        newton_tolerance=1e-13,
    )
    for share in (0.13, 0.5, 0.87, 1.0):
        simulator.step(share * period, STILL)
        sn, cn, dn, _ = ellipj(share * period * rate, m)
        expected = amplitude * [cn, sn, dn]
        assert simulator.body_angular_velocity("fish") == pytest.approx(expected, abs=2e-6)


def on_two_lines(half_distance, length):
    """A bar level on two equal vertical lines in vacuum."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_body("bar", body(mass=4.0, inertia=(0.002, 0.33, 0.33), volume=0.0))
    wire = sc.LineProperties(
        length=length, diameter=0.001, mass_per_length=1e-9, axial_stiffness=1e8
    )
    for name, x in (("fore", half_distance), ("aft", -half_distance)):
        b.add_prescribed_point(name)
        b.add_line(f"{name} line", name, "bar", wire, segments=1, attachment=(x, 0, 0))
    model = b.build()
    state = sc.State(model)
    laws = {}
    for name, x in (("fore", half_distance), ("aft", -half_distance)):
        state.set_point(name, (x, 0, 0))
        laws[name] = sc.SteadyTow(position=(x, 0, 0))
    return model, state, laws


def second_crossing(time, values):
    """The second fall of a smooth signal through zero: cubic through four samples."""
    i = np.flatnonzero((values[:-1] > 0) & (values[1:] <= 0))[1]
    window = slice(i - 1, i + 3)
    roots = np.polynomial.Polynomial.fit(time[window], values[window], 3).roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    return real[np.argmin(np.abs(real - time[i]))]


def test_trapeze_swings_as_a_pendulum():
    """On two parallel lines a bar stays level: T = 4 √(ℓ/g) K(sin²(θ0/2)), whatever its inertia."""
    length, theta0 = 1.5, 1.2
    model, state, laws = on_two_lines(0.4, length)
    state.set_body("bar", (length * math.sin(theta0), 0, -length * math.cos(theta0)))
    period = 4 * math.sqrt(length / 9.81) * ellipk(math.sin(theta0 / 2) ** 2)
    # it first falls through zero after T/4, again after 5T/4; phase off by (2π/4000)²/12 = 2e-7
    result = sc.run(
        model, laws, state=state, t_end=1.3 * period, output_step=period / 400,
        max_step=period / 4000,
    )  # fmt: skip
    bar = result.bodies["bar"]
    crossing = second_crossing(result.time, bar.position[:, 0])
    assert crossing == pytest.approx(1.25 * period, rel=1e-5)
    assert np.abs(bar.yaw_pitch_roll).max() < 1e-6


def test_bifilar_suspension():
    """Small turns about the vertical: the radius of gyration is k = (d T/4π) √(g/L), d between the
    lines and L their length, as one measures a fish's yaw inertia. Off by θ²/16 and
    (2π/2000)²/12."""
    distance, length = 0.8, 1.5
    model, state, laws = on_two_lines(distance / 2, length)
    turn = 2e-3
    state.set_body("bar", (0, 0, -length), (math.cos(turn / 2), 0, 0, math.sin(turn / 2)))
    gyration = math.sqrt(0.33 / 4.0)
    period = 4 * math.pi * gyration / distance * math.sqrt(length / 9.81)
    result = sc.run(
        model, laws, state=state, t_end=1.3 * period, output_step=period / 200,
        max_step=period / 2000, newton_tolerance=1e-12,
    )  # fmt: skip
    yaw = result.bodies["bar"].yaw_pitch_roll[:, 0]
    measured = second_crossing(result.time, yaw) / 1.25
    assert distance * measured / (4 * math.pi) * math.sqrt(9.81 / length) == pytest.approx(
        gyration, rel=1e-5
    )


def test_drag_of_a_body_follows_the_square_of_speed_and_rate():
    """½ρ |u| A u and ½ρ |ω| B ω in body axes, exact at any angle; and their derivatives."""
    A = np.diag([0.2, 0.5, 0.9])
    B = np.diag([0.1, 0.3, 0.7])
    body = sc.Body(
        mass=10.0, inertia=(1, 2, 3), volume=0.01, diameter=0.2, length=0.4, axial_drag=0.0,
        cross_flow_drag=0.0, munk_moment=0.0, drag_area=(0.2, 0.5, 0.9),
        turning_drag=(0.1, 0.3, 0.7),
    )  # fmt: skip
    assert body.replace(mass=11.0).drag_area.tolist() == A.tolist()
    b = sc.ModelBuilder(sc.Water(density=1000.0, gravity=0.0))
    b.add_prescribed_point("far")
    b.add_body("body", body)
    thread = sc.LineProperties(
        length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
    )
    b.add_line("thread", "far", "body", thread, segments=1, attachment=(0, 0, 0))
    model = b.build()
    state = sc.State(model)
    v, w = np.array([0.4, -0.3, 0.8]), np.array([0.2, 0.5, -0.4])
    state.set_body("body", (0, 0, -50), (1, 0, 0, 0), tuple(v), tuple(w))
    residual = _core._residual(state)
    inertia = np.array([1.0, 2.0, 3.0])
    force, moment = residual[:3], residual[3:] + np.cross(w, inertia * w)
    assert force == pytest.approx(-500.0 * np.linalg.norm(v) * A @ v, rel=1e-12)
    assert moment == pytest.approx(-500.0 * np.linalg.norm(w) * B @ w, rel=1e-12)
    rates = (0.0, 1.0, 0.0)
    exact = _core._jacobian(state, rates)
    for i in range(6):
        push = np.zeros(6)
        push[i] = 1e-6
        ahead, behind = (
            _core._residual(_core._displaced(state, sign * push, rates)) for sign in (1, -1)
        )
        assert exact[:, i] == pytest.approx((ahead - behind) / 2e-6, abs=1e-4)
