# SPDX-License-Identifier: Apache-2.0
"""A falling sphere, a floating sphere and a large pendulum."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

import sim_core as sc

STILL = sc.SteadyTow(position=(0, 0, 0))


def test_falling_sphere(free_sphere):
    """v = v_t tanh(t/τ), v_t = √(2W/(ρ Cd A)), τ = (m + m_a) v_t / W."""
    mass, volume, drag_area, added = 6.2, 0.697e-3, 0.47 * math.pi / 4 * 0.11**2, 0.35
    weight = (mass - 1000 * volume) * 9.81
    v_t = math.sqrt(2 * weight / (1000 * drag_area))
    tau = (mass + added) * v_t / weight
    model = free_sphere(mass, volume, drag_area, added)
    state = sc.State(model)
    state.set_point("sphere", (0, 0, -10))
    # Second order: the error is about (h/τ)²/12 = 2e-8 of v_t.
    simulator = sc.Simulator(model, state, max_step=tau / 2000)
    for t in (0.3 * tau, tau, 3 * tau):
        simulator.step(t, STILL)
        velocity = simulator.point_velocity("sphere")[2]
        assert velocity == pytest.approx(-v_t * math.tanh(t / tau), rel=1e-6)


def test_sphere_of_half_the_density_floats_half_immersed(free_sphere):
    volume = 0.697e-3
    model = free_sphere(500 * volume, volume, 0.004, 0.3)
    state = sc.steady_tow(model, position=(0, 0, 0))
    assert state.point_position("sphere")[2] == pytest.approx(0.0, abs=1e-6)


def test_large_pendulum():
    """T = 4 √(ℓ/g) K(sin²(θ0/2)); no energy is lost or made."""
    length, theta0 = 2.0, 1.4
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("pivot")
    b.add_free_point("bob", mass=1.0)
    rod = sc.LineProperties(
        length=length, diameter=0.001, mass_per_length=1e-9, axial_stiffness=1e8
    )
    b.add_line("rod", "pivot", "bob", rod, segments=1)
    model = b.build()
    state = sc.State(model)
    state.set_point("bob", (length * math.sin(theta0), 0, -length * math.cos(theta0)))
    period = 4 * math.sqrt(length / 9.81) * ellipk(math.sin(theta0 / 2) ** 2)
    # h = T/4000: the period error is (2π/4000)²/12 = 2e-7
    result = sc.run(
        model,
        STILL,
        state=state,
        t_end=5.2 * period,
        output_step=period / 400,
        max_step=period / 4000,
    )
    x, t = result.points["bob"].position[:, 0], result.time
    down = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    # cubic through four samples around each crossing: interpolation error below 1e-9 of the period
    crossings = []
    for i in down:
        window = slice(i - 1, i + 3)
        roots = np.polynomial.Polynomial.fit(t[window], x[window], 3).roots()
        real = roots[np.abs(roots.imag) < 1e-9].real
        crossings.append(real[np.argmin(np.abs(real - t[i]))])
    assert np.diff(crossings) == pytest.approx(np.full(len(crossings) - 1, period), rel=1e-5)
    swing = 9.81 * length * (1 - math.cos(theta0))
    start = -9.81 * length * math.cos(theta0)
    assert sc.energy(result.final_state).total == pytest.approx(start, abs=1e-5 * swing)
