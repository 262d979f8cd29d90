# SPDX-License-Identifier: Apache-2.0
"""The integrator on a linear oscillator, against the method as Chung & Hulbert (1993) wrote it."""

import math

import numpy as np
import pytest

import sim_core as sc


def coefficients(rho):
    alpha_m = (2 * rho - 1) / (rho + 1)
    alpha_f = rho / (rho + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (1 + alpha_f - alpha_m) ** 2
    return alpha_m, alpha_f, beta, gamma


def amplification(rho, omega_h):
    """One step of (q, h v, h² a) for q'' + ω² q = 0."""
    alpha_m, alpha_f, beta, gamma = coefficients(rho)
    w2 = omega_h**2
    left = np.array(
        [
            [1, 0, -beta],
            [0, 1, -gamma],
            [(1 - alpha_f) * w2, 0, 1 - alpha_m],
        ]
    )
    right = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-alpha_f * w2, 0, -alpha_m]])
    return np.linalg.solve(left, right)


def spring(rho, steps_a_period, steps):
    """Displacement of a mass on a vertical spring, let go at rest 0.1 m below its equilibrium."""
    k, m, length = 100.0, 2.0, 1.0
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("mass", mass=m)
    line = sc.LineProperties(
        length=length,
        diameter=0.001,
        mass_per_length=1e-14,
        axial_stiffness=k * length,
        slack_tension=1e-6,
    )
    b.add_line("spring", "top", "mass", line, segments=1)
    model = b.build()
    equilibrium = -length - m * 9.81 / k
    state = sc.State(model)
    state.set_point("mass", (0, 0, equilibrium - 0.1))
    h = 2 * math.pi / math.sqrt(k / m) / steps_a_period
    simulator = sc.Simulator(
        model,
        state,
        integrator=sc.GeneralizedAlpha(rho_inf=rho),
        max_step=2 * h,
        newton_tolerance=1e-15,
    )
    z = []
    for i in range(1, steps + 1):
        simulator.step(i * h, sc.SteadyTow(position=(0, 0, 0)))
        z.append(simulator.point_position("mass")[2] - equilibrium)
    return np.array(z)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 1.0])
def test_follows_the_published_scheme(rho):
    w = 2 * math.pi / 10
    x = np.array([-0.1, 0.0, 0.1 * w**2])  # q, h v, h² a with a consistent
    expected = []
    for _ in range(60):
        x = amplification(rho, w) @ x
        expected.append(x[0])
    # 60 steps, each with a rounding of 1e-14 of the force
    assert spring(rho, 10, 60) == pytest.approx(np.array(expected), abs=1e-11)


@pytest.mark.parametrize(
    ("rho", "period_error", "damping"),
    [(1.0, 3.21, 0.0), (0.8, 3.38, 0.016), (0.0, 12.3, 5.5)],
)
def test_period_error_and_damping_at_ten_steps_a_period(rho, period_error, damping):
    """In percent, from the recurrence of the simulated sequence (Prony's method)."""
    z = spring(rho, 10, 80)[
        20:
    ]  # the spurious root has died out except at rho = 1, where it is absent
    a, b = np.linalg.lstsq(np.column_stack([z[1:-1], z[:-2]]), z[2:], rcond=None)[0]
    root = np.roots([1, -a, -b])[0]
    angle, decay = abs(np.angle(root)), -math.log(abs(root))
    assert 100 * (2 * math.pi / 10 / angle - 1) == pytest.approx(period_error, abs=0.051)
    assert 100 * decay / math.hypot(angle, decay) == pytest.approx(damping, abs=0.051)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 1.0])
def test_spectral_radius_at_infinite_frequency(rho):
    radius = np.abs(np.linalg.eigvals(amplification(rho, 1e6))).max()
    # at rho = 0 a triple root: rounding of 1e-16 moves it by its cube root, 5e-6 times entries
    # up to 10
    assert radius == pytest.approx(rho, abs=1e-3)


def test_second_order_on_a_towed_system(nit_model):
    """Fish and depressor of the tank rig in steady motion: halving the step quarters the error."""
    model = nit_model(segments=(4, 1, 3))
    start = sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))
    motion = sc.Sinusoid(
        mean=(0, 0, 0.2), velocity=(1, 0, 0), amplitude=0.06, period=2, ramp_time=2
    )

    def end(step):
        simulator = sc.Simulator(model, start, max_step=step, newton_tolerance=1e-11)
        simulator.step(4.0, motion)
        return np.concatenate(
            [simulator.body_position("fish"), simulator.point_position("depressor")]
        )

    h = 0.02
    reference = end(h / 16)
    coarse, fine = (np.abs(end(s) - reference).max() for s in (h, h / 2))
    assert 3.5 < coarse / fine < 5.0
    # the last factor of 16 leaves 1/64 of the error of h/2 in the reference


def test_refuses_a_spectral_radius_outside_0_to_1():
    with pytest.raises(ValueError, match="rho_inf"):
        sc.GeneralizedAlpha(rho_inf=1.2)
