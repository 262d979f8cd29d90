# SPDX-License-Identifier: Apache-2.0
"""Every time integrator, through the simulator: accuracy, damping, stability, agreement.

The linear oscillator is a mass on a spring of no unstretched length (1e-14 m), whose force is
linear in all directions; it swings horizontally, far from the anchor, with ω = 1 rad/s. The
simulator steps it; the published schemes, written out in ``amplification``, say what must come out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import sim_core as sc

Array = NDArray[np.float64]
STILL = sc.SteadyTow(position=(0, 0, 0))


@dataclass(frozen=True)
class Case:
    """A scheme as published: q₁ and h v₁ by Newmark's formulas with their weights, and the balance
    (now · (h² a₁, ω²h² q₁) + before · (h² a₀, ω²h² q₀) = 0) that gives a₁."""

    integrator: sc.Integrator
    position: tuple[float, float]  # weights of h² a₀, h² a₁
    velocity: tuple[float, float]
    now: tuple[float, float]
    before: tuple[float, float]
    roots_at_infinity: tuple[float, float, float]  # 0 too for what the scheme does not remember
    order: int
    start: float = 1.0  # the scheme's own a₀ in terms of the physical one


def newmark(beta: float, gamma: float, order: int) -> Case:
    root = -(1.5 - gamma) / (0.5 + gamma)  # double for beta = (gamma + ½)²/4
    return Case(
        sc.Newmark(beta=beta, gamma=gamma),
        (0.5 - beta, beta),
        (1 - gamma, gamma),
        (1.0, 1.0),
        (0.0, 0.0),
        (root, root, 0.0),
        order,
    )


def hht(alpha: float) -> Case:
    """Hilber, Hughes & Taylor (1977)."""
    beta, gamma = (1 - alpha) ** 2 / 4, (1 - 2 * alpha) / 2
    root = -(1 + alpha) / (1 - alpha)
    return Case(
        sc.HHT(alpha=alpha),
        (0.5 - beta, beta),
        (1 - gamma, gamma),
        (1.0, 1 + alpha),
        (0.0, -alpha),
        (root, root, alpha / (1 + alpha)),
        2,
    )


def generalized_alpha(rho: float) -> Case:
    """Chung & Hulbert (1993)."""
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    beta, gamma = (1 + alpha_f - alpha_m) ** 2 / 4, 0.5 + alpha_f - alpha_m
    return Case(
        sc.GeneralizedAlpha(rho_inf=rho),
        (0.5 - beta, beta),
        (1 - gamma, gamma),
        (1 - alpha_m, 1 - alpha_f),
        (alpha_m, alpha_f),
        (-rho, -rho, -rho),
        2,
    )


def houbolt(gamma_1: float) -> Case:
    """Chung & Hulbert (1994)."""
    beta_1 = (0.5 + gamma_1) / 2
    return Case(
        sc.SingleStepHoubolt(gamma_1=gamma_1),
        (0.5 - beta_1, beta_1),
        ((0.5 - gamma_1) / 2, gamma_1),
        (1.0, 1 / (2 * beta_1)),
        (-0.5, 0.0),
        (0.0, 0.0, 0.0),
        2 if gamma_1 == 1.5 else 1,
        start=1 / beta_1,
    )


IMPLICIT = {
    "backward Euler": Case(
        sc.BackwardEuler(), (0.0, 1.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0), (0.0, 0.0, 0.0), 1
    ),
    "Newmark": newmark(0.25, 0.5, order=2),
    "Newmark, gamma 0.6": newmark(0.3025, 0.6, order=1),
    "HHT -0.1": hht(-0.1),
    "HHT -1/3": hht(-1 / 3),
    "generalised-alpha 0.8": generalized_alpha(0.8),
    "generalised-alpha 0.5": generalized_alpha(0.5),
    "Houbolt": houbolt(1.5),
    "Houbolt, gamma_1 1": houbolt(1.0),
    "Houbolt, gamma_1 0.5": houbolt(0.5),
    # On a linear system the midpoint rule is the trapezoidal one.
    "box": Case(sc.Box(), (0.25, 0.25), (0.5, 0.5), (1.0, 1.0), (0.0, 0.0), (-1.0, -1.0, 0.0), 2),
}
FORWARD_EULER = Case(
    sc.ForwardEuler(), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (0.0, 0.0, 0.0), 1
)
ALL = {"forward Euler": FORWARD_EULER, **IMPLICIT}


def test_every_integrator_is_tried():
    assert {type(case.integrator) for case in ALL.values()} == set(sc.INTEGRATORS.values())


@pytest.mark.parametrize("scheme", sc.INTEGRATORS.values(), ids=sc.INTEGRATORS)
def test_what_an_integrator_prints_makes_it(scheme):
    assert sc.parse_integrator(repr(scheme()))() == scheme()
    assert sc.parse_integrator(f" {scheme.__name__} ")() == scheme()


def test_an_integrator_as_text_has_its_parameters():
    assert sc.parse_integrator("HHT(alpha=-0.25)")() == sc.HHT(alpha=-0.25)
    assert sc.parse_integrator("Newmark(beta=0.35, gamma=6e-1)")() == sc.Newmark(
        beta=0.35, gamma=0.6
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("RK4", "'RK4' is no integrator: use one of BackwardEuler, Box, "),
        ("Integrator()", "'Integrator' is no integrator"),
        ("HHT(-0.1)", r"'HHT\(-0.1\)' is no integrator: write it like HHT\(alpha=-0.1\)"),
        ("HHT(alpha=a)", "is no integrator: write it like"),
        ("HHT(**{'alpha': 0})", "is no integrator: write it like"),
        ("HHT(alpha=-0.1", "is no integrator: write it like"),
        ("__import__('os').getcwd()", "is no integrator: write it like"),
        ("", "is no integrator: write it like"),
        ("HHT(alfa=-0.1)", "HHT has no 'alfa', it has alpha"),
        ("Box(h=1)", "Box has no 'h', it has no parameters"),
    ],
)
def test_what_is_no_integrator_is_refused_with_what_is(text, message):
    with pytest.raises(sc.InvalidInput, match=message):
        sc.parse_integrator(text)


def test_impossible_values_of_an_integrator_are_refused_when_it_is_made():
    make = sc.parse_integrator("HHT(alpha=0.1)")
    with pytest.raises(sc.InvalidInput, match="alpha"):
        make()


every = pytest.mark.parametrize("name", ALL)
every_implicit = pytest.mark.parametrize("name", IMPLICIT)


def amplification(case: Case, omega_h: float) -> Array:
    """One step of (q, h v, h² a) for q'' + ω² q = 0; at infinite ω h without the inertia."""
    if math.isinf(omega_h):
        now, before = (case.now[1], 0.0), (case.before[1], 0.0)
    else:
        now = (case.now[1] * omega_h**2, case.now[0])
        before = (case.before[1] * omega_h**2, case.before[0])
    left = [[1, 0, -case.position[1]], [0, 1, -case.velocity[1]], [now[0], 0, now[1]]]
    right = [[1, 1, case.position[0]], [0, 1, case.velocity[0]], [-before[0], 0, -before[1]]]
    return np.linalg.solve(np.array(left, dtype=float), np.array(right, dtype=float))


def principal_root(matrix: Array) -> complex:
    roots = np.linalg.eigvals(matrix)
    return complex(roots[np.argmax(roots.imag)])


@pytest.fixture(scope="module")
def oscillator() -> sc.Model:
    length = 1e-14
    b = sc.ModelBuilder(sc.Water(density=0.0, gravity=1.0))
    b.add_prescribed_point("anchor")
    b.add_free_point("mass", mass=1.0)
    spring = sc.LineProperties(
        length=length,
        diameter=0.001,
        mass_per_length=1e-9,
        axial_stiffness=1.0 * length,
        slack_tension=1e-13,
    )
    b.add_line("spring", "anchor", "mass", spring, segments=1)
    return b.build()


def oscillate(
    model: sc.Model, integrator: sc.Integrator, h: float, steps: int, q: float, v: float
) -> Array:
    """(steps, 2) m, m/s: horizontal position and velocity after each step."""
    state = sc.State(model)
    state.set_point("mass", (q, 0, -1), (v, 0, 0))  # in vertical equilibrium at z = −1
    simulator = sc.Simulator(
        model, state, integrator=integrator, max_step=2 * h, newton_tolerance=1e-15
    )
    rows = []
    for i in range(1, steps + 1):
        simulator.step(i * h, STILL)
        rows.append((simulator.point_position("mass")[0], simulator.point_velocity("mass")[0]))
    assert simulator.halvings == simulator.snaps == 0
    return np.array(rows)


@pytest.mark.parametrize("omega_h", [0.2 * math.pi, 2.0, 1e3])
@every
def test_follows_the_published_amplification_matrix(
    oscillator: sc.Model, name: str, omega_h: float
) -> None:
    case = ALL[name]
    steps = 30 if name != "forward Euler" else 3  # it grows by √(1 + (ω h)²) in each
    q, v = 1.0, 0.3
    x = np.array([q, v * omega_h, -(omega_h**2) * q * case.start])
    matrix = amplification(case, omega_h)
    expected = []
    for _ in range(steps):
        x = matrix @ x
        expected.append((x[0], x[1] / omega_h))
    # The spring's length changes the force by 1e-14 of it, 30 times, and errors add up. The first
    # guess reaches (ω h)² q: 2e-16 of that in each step. Velocities at ω h > 1 exceed positions by
    # up to ω h/2 in the schemes that overshoot.
    reach = max(1.0, omega_h**2, np.abs(expected).max())
    got = oscillate(oscillator, case.integrator, omega_h, steps, q, v)
    assert got[:, 0] == pytest.approx(np.array(expected)[:, 0], abs=1e-11 + 30 * 2e-16 * reach)
    speed = max(1.0, omega_h / 2) * (1e-11 + 30 * 2e-16 * reach)
    assert got[:, 1] == pytest.approx(np.array(expected)[:, 1], abs=speed)


def measured_root(positions: Array, memory: int) -> complex:
    """The oscillating root of the linear recurrence over ``memory`` steps that a sequence obeys."""
    columns = [positions[memory - 1 - j : len(positions) - 1 - j] for j in range(memory)]
    coefficients = np.linalg.lstsq(np.column_stack(columns), positions[memory:], rcond=None)[0]
    roots = np.roots([1.0, *(-coefficients)])
    return complex(roots[np.argmax(roots.imag)])


def period_error_and_damping(root: complex, omega_h: float) -> tuple[float, float]:
    """In percent: T/T₀ − 1, and −ln|λ|/arg λ (Hughes 2000, § 9.1)."""
    angle = float(np.angle(root))
    return 100 * (omega_h / angle - 1), -100 * math.log(abs(root)) / angle


@every
def test_period_error_and_damping_at_ten_steps_a_period(oscillator: sc.Model, name: str) -> None:
    case, omega_h = ALL[name], 0.2 * math.pi
    matrix = amplification(case, omega_h)
    memory = int(np.sum(np.abs(np.linalg.eigvals(matrix)) > 1e-9))
    steps = 40 if name != "forward Euler" else 10
    positions = oscillate(oscillator, case.integrator, omega_h, steps, 1.0, 0.3)[:, 0]
    root = measured_root(np.concatenate([[1.0], positions]), memory)
    got = period_error_and_damping(root, omega_h)
    # The root comes out to 1e-14 (the spring's length) times the condition of the fit, below 100.
    assert root == pytest.approx(principal_root(matrix), rel=1e-12)
    expected = period_error_and_damping(principal_root(matrix), omega_h)
    assert got == pytest.approx(expected, rel=1e-10, abs=1e-10)  # 1e-12 · 100 %


@pytest.mark.parametrize(
    ("name", "period_error", "damping", "digits"),
    [
        ("Newmark", 3.21, 0.0, (0.005, 0.0005)),
        ("HHT -0.1", 3.95, 0.21, (0.005, 0.005)),
        ("HHT -1/3", 4.67, 0.38, (0.005, 0.005)),
        ("generalised-alpha 0.8", 3.38, 0.016, (0.005, 0.0005)),
        ("Houbolt", 12.3, 5.5, (0.05, 0.05)),
        ("backward Euler", 12.0, 29.7, (0.05, 0.05)),
        ("box", 3.21, 0.0, (0.005, 0.0005)),
    ],
)
def test_known_figures_at_ten_steps_a_period(
    oscillator: sc.Model,
    name: str,
    period_error: float,
    damping: float,
    digits: tuple[float, float],
) -> None:
    """Percent, to half a unit of the last digit."""
    case, omega_h = IMPLICIT[name], 0.2 * math.pi
    memory = int(np.sum(np.abs(np.linalg.eigvals(amplification(case, omega_h))) > 1e-9))
    positions = oscillate(oscillator, case.integrator, omega_h, 40, 1.0, 0.3)[:, 0]
    root = measured_root(np.concatenate([[1.0], positions]), memory)
    got = period_error_and_damping(root, omega_h)
    assert got[0] == pytest.approx(period_error, abs=digits[0])
    assert got[1] == pytest.approx(damping, abs=digits[1])


@every_implicit
def test_roots_at_infinite_frequency(name: str) -> None:
    """The simulator follows the matrix at ω h = 1e3 (above); this is its limit. Compared as
    polynomial, since multiple roots cannot be computed to more than the cube root of rounding."""
    case = IMPLICIT[name]
    polynomial = np.poly(amplification(case, math.inf))
    assert polynomial == pytest.approx(np.poly(case.roots_at_infinity), abs=1e-10)


@pytest.mark.parametrize(
    ("name", "radius"),
    [
        ("Newmark", 1.0),
        ("HHT -0.1", 0.9 / 1.1),
        ("HHT -1/3", 0.5),
        ("generalised-alpha 0.8", 0.8),
        ("Houbolt", 0.0),
        ("backward Euler", 0.0),
        ("box", 1.0),
    ],
)
def test_motion_dies_out_as_the_spectral_radius_says(
    oscillator: sc.Model, name: str, radius: float
) -> None:
    """At ω h = 1e3 the response after n steps is radius^n times a polynomial in n."""
    steps = 60
    got = oscillate(oscillator, IMPLICIT[name].integrator, 1e3, steps, 1.0, 0.0)[:, 0]
    late = np.abs(got[-10:]).max()
    # roots are within (ω h)^(-2/3) = 0.01 of the limit; a triple root gives n²/2, the rounding of
    # the first guess 2e-10
    assert late <= steps**2 / 2 * (radius + 0.01) ** (steps - 10) + 1e-9
    if radius == 1.0:
        assert late > 0.9


@every_implicit
def test_overshoot_at_high_frequency(oscillator: sc.Model, name: str) -> None:
    """Let go at q₀ with ω h ≫ 1, so h² a₀ = −(ω h)² q₀ · start. The balance leaves q₁ of the order
    of q₀: positions do not overshoot, h² a₁ = −(p₀/p₁) h² a₀, and v₁ = −ω² h q₀ · start ·
    (w₀ − w₁ p₀/p₁), an overshoot that grows with ω h unless the bracket vanishes."""
    case, omega_h = IMPLICIT[name], 1e3
    got = oscillate(oscillator, case.integrator, omega_h, 20, 1.0, 0.0)
    (p0, p1), (w0, w1) = case.position, case.velocity
    bracket = case.start * (w0 - w1 * p0 / p1)
    # ω h q₀ aside, what is left out is of order q₀/(ω h)
    assert got[0, 1] == pytest.approx(-omega_h * bracket, abs=10 / omega_h)
    assert np.abs(got[:, 0]).max() <= 1 + 1e-5  # Newmark returns to 1, by rounding 1e-9
    if name in ("backward Euler", "Newmark", "box", "Houbolt, gamma_1 0.5"):
        assert bracket == pytest.approx(0.0, abs=1e-15)
    else:
        assert abs(bracket) > 1e-3


def measured_order(error: Callable[[float], float], h: float) -> float:
    return math.log2(error(h) / error(h / 2))


@every
def test_order_on_the_linear_oscillator(oscillator: sc.Model, name: str) -> None:
    """Error of position and velocity after 3 rad."""
    case, end = ALL[name], 3.0

    def error(h: float) -> float:
        q, v = oscillate(oscillator, case.integrator, h, round(end / h), 1.0, 0.3)[-1]
        exact = (
            math.cos(end) + 0.3 * math.sin(end),
            -math.sin(end) + 0.3 * math.cos(end),
        )
        return math.hypot(q - exact[0], v - exact[1])

    # The next term of the error is a factor of a few h smaller; Houbolt's of second order is large
    # (12 % of the period at h = 0.6), so its first-order variants need h = 0.002 to show theirs.
    h = end / (400 if case.order == 2 else 1600)
    assert measured_order(error, h) == pytest.approx(case.order, abs=0.1)


class Pendulum:
    """A mass on an elastic cable, let go at 1.4 rad with the tension of its place."""

    length, stiffness, gravity, angle = 2.0, 200.0, 9.81, 1.4  # N/m; mass 1 kg
    end = 2.0  # s, two thirds of a swing

    def __init__(self) -> None:
        b = sc.ModelBuilder(sc.Water(density=0.0, gravity=self.gravity))
        b.add_prescribed_point("pivot")
        b.add_free_point("bob", mass=1.0)
        cable = sc.LineProperties(
            length=self.length,
            diameter=0.001,
            mass_per_length=1e-12,
            axial_stiffness=self.stiffness * self.length,
            slack_tension=1e-6,
        )
        b.add_line("cable", "pivot", "bob", cable, segments=1)
        self.model = b.build()
        stretched = self.length + self.gravity * math.cos(self.angle) / self.stiffness
        self.start = (
            stretched * math.sin(self.angle),
            0.0,
            -stretched * math.cos(self.angle),
        )
        self.exact = self._exact()

    def _exact(self) -> Array:
        def rate(_: float, y: Array) -> list[float]:
            r = math.hypot(y[0], y[1])
            k = self.stiffness * (r - self.length) / r
            return [y[2], y[3], -k * y[0], -k * y[1] - self.gravity]

        y0 = [self.start[0], self.start[2], 0.0, 0.0]
        return solve_ivp(rate, (0, self.end), y0, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]

    def simulator(self, integrator: sc.Integrator, h: float) -> sc.Simulator:
        state = sc.State(self.model)
        state.set_point("bob", self.start)
        return sc.Simulator(
            self.model, state, integrator=integrator, max_step=h, newton_tolerance=1e-13
        )

    def error(self, integrator: sc.Integrator, h: float) -> float:
        simulator = self.simulator(integrator, h)
        simulator.step(self.end, STILL)
        p, v = simulator.point_position("bob"), simulator.point_velocity("bob")
        return float(np.linalg.norm(np.array([p[0], p[2], v[0], v[2]]) - self.exact))


@pytest.fixture(scope="module")
def pendulum() -> Pendulum:
    return Pendulum()


@every
def test_order_on_the_large_pendulum(pendulum: Pendulum, name: str) -> None:
    """Position and velocity of the bob against an explicit Runge–Kutta method of order 8."""
    case = ALL[name]
    # The cable's own oscillation has ω = 14 rad/s. Of second order: ω h = 0.014, next term about
    # that. Of first order, the error's exponent is ω² h t/2 = 200 h: h = 0.1 ms leaves 2 %.
    h = 1e-3 if case.order == 2 else 1e-4
    order = measured_order(lambda step: pendulum.error(case.integrator, step), h)
    assert order == pytest.approx(case.order, abs=0.1)


def energy_errors(pendulum: Pendulum, integrator: sc.Integrator) -> Array:
    """Energy gained after each of 250 steps of 40 ms, against m g ℓ; the cable's ω h = 0.57."""
    simulator = pendulum.simulator(integrator, 0.04)
    first = sc.energy(simulator.state).total
    gained = []
    for i in range(1, 251):
        simulator.step(0.04 * i, STILL)
        gained.append(sc.energy(simulator.state).total - first)
    return np.array(gained) / (pendulum.gravity * pendulum.length)


SWING = 75  # steps of 40 ms in a swing to and fro


@pytest.fixture(scope="module")
def energies(pendulum: Pendulum) -> dict[str, Array]:
    return {name: energy_errors(pendulum, case.integrator) for name, case in ALL.items()}


@pytest.mark.parametrize("name", ["Newmark", "box"])
def test_energy_of_the_pendulum_stays_without_damping(
    energies: dict[str, Array], name: str
) -> None:
    """Only the cable, at ω h = 0.57, is poorly resolved: its energy is wrong by a part of order
    (ω h)²/4. At the bottom it is T²/2k with T = m g (3 − 2 cos θ₀), 0.087 m g ℓ."""
    error = np.abs(energies[name])
    assert error.max() < 0.087 * 0.57**2 / 4
    assert error[-SWING:].max() < 1.2 * error[:SWING].max()  # no trend


def test_energy_of_the_pendulum_falls_with_damping(energies: dict[str, Array]) -> None:
    lost = {n: e[:SWING].mean() - e[-SWING:].mean() for n, e in energies.items()}
    # by falling damping ratio at low frequency; HHT −1/3 is generalised-α 0.5 by another name
    first_order = ["backward Euler", "Newmark, gamma 0.6"]
    second_order = ["Houbolt", "HHT -1/3", "HHT -0.1", "generalised-alpha 0.8"]
    falling = [lost[name] for name in [*first_order, *second_order]]
    assert falling == sorted(falling, reverse=True)
    assert falling[-1] > 5e-5
    assert energies["generalised-alpha 0.5"] == pytest.approx(energies["HHT -1/3"], abs=1e-9)
    for name in [*first_order, *second_order]:
        assert energies[name].max() <= 1e-9, name  # never above the start


def test_forward_euler_makes_energy(energies: dict[str, Array]) -> None:
    gained = energies["forward Euler"]
    assert np.all(np.diff(gained[:20]) > 0)
    assert gained[-1] > 1.0  # more than it takes to swing over the top


def test_stability_limit_of_forward_euler() -> None:
    """A damped mass on a spring is stable for h < 2ζ/ω: |λ|² = 1 − 2ζωh + ω²h²."""
    omega, zeta = 10.0, 0.1
    b = sc.ModelBuilder(sc.Water(density=0.0, gravity=9.81))
    b.add_prescribed_point("anchor")
    b.add_free_point("mass", mass=1.0)
    spring = sc.LineProperties(
        length=1.0,
        diameter=0.001,
        mass_per_length=1e-14,
        axial_stiffness=omega**2,
        axial_damping=2 * zeta * omega,
        slack_tension=1e-6,
    )
    b.add_line("spring", "anchor", "mass", spring, segments=1)
    model = b.build()
    rest = -1.0 - 9.81 / omega**2
    for factor in (0.9, 1.1):
        h = factor * 2 * zeta / omega
        state = sc.State(model)
        state.set_point("mass", (0, 0, rest - 1e-3))
        simulator = sc.Simulator(
            model, state, integrator=sc.ForwardEuler(), max_step=2 * h, newton_tolerance=1e-15
        )
        z = [-1e-3]
        for i in range(1, 101):
            simulator.step(i * h, STILL)
            z.append(simulator.point_position("mass")[2] - rest)
        growth = abs(measured_root(np.array(z), 2))
        # positions are rounded to 2e-16 of 1 m, 2e-13 of the amplitude
        assert growth == pytest.approx(
            math.sqrt(1 - 2 * zeta * omega * h + (omega * h) ** 2), rel=1e-9
        )
        assert (growth < 1) == (factor < 1)


PERIOD = 1.6  # s, of the crank
LEAD_IN = 100 * PERIOD  # the fish's slow heave mode (15 to 20 s) has died out


@dataclass(frozen=True)
class Tow:
    heave_ratio: float  # fish nose to depressor, first harmonic
    tension_range: float  # N, half of peak to peak at the top


@pytest.fixture(scope="module")
def tow(wu_chwang_model: Callable[..., sc.Model]) -> Callable[[sc.Integrator, float], Tow]:
    """The tow of Wu & Chwang (20 segments) from one common lead-in: four periods to settle, four
    measured."""
    model = wu_chwang_model()
    crank = sc.SliderCrank(
        mean=(0.0, 0.0, -2.0),
        velocity=(1.75, 0.0, 0.0),
        crank_radius=0.1,
        rod_length=0.35,
        period=PERIOD,
        ramp_time=8.0,
    )
    start = sc.run(model, crank, t_end=LEAD_IN, output_step=PERIOD).final_state

    def measure(integrator: sc.Integrator, step: float) -> Tow:
        result = sc.run(
            model,
            crank,
            state=start,
            t_end=LEAD_IN + 8 * PERIOD,
            output_step=0.02,
            integrator=integrator,
            max_step=step,
        )
        assert result.snaps == result.halvings == 0
        steady = result.time >= LEAD_IN + 4 * PERIOD
        t = result.time[steady] - LEAD_IN
        drift = [np.ones_like(t), t, t**2]  # what is left of the slow mode
        waves = [f(2 * math.pi * k * t / PERIOD) for k in range(1, 5) for f in (np.cos, np.sin)]
        basis = np.column_stack([*drift, *waves])

        def amplitude(z: Array) -> float:
            fit = np.linalg.lstsq(basis, z[steady], rcond=None)[0]
            return math.hypot(fit[3], fit[4])

        nose = amplitude(result.bodies["fish"].position_of((0.65, 0.0, 0.0))[:, 2])
        depressor = amplitude(result.points["depressor"].position[:, 2])
        tension = result.lines["primary"].start_tension[steady]
        return Tow(nose / depressor, 0.5 * float(np.ptp(tension)))

    return measure


@pytest.fixture(scope="module")
def converged(tow: Callable[[sc.Integrator, float], Tow]) -> Tow:
    return tow(sc.GeneralizedAlpha(rho_inf=0.8), 0.5e-3)


@every_implicit
def test_implicit_schemes_agree_on_the_tow(
    tow: Callable[[sc.Integrator, float], Tow], converged: Tow, name: str
) -> None:
    """All give one heave ratio as the step goes to 0."""
    case = IMPLICIT[name]
    coarse, fine = (
        abs(tow(case.integrator, h).heave_ratio / converged.heave_ratio - 1) for h in (5e-3, 1e-3)
    )
    # ω h = 0.02 at 5 ms. First order: ω h/2 = 1 %, a fifth of it at 1 ms. Second order: (ω h)² =
    # 0.04 % with Houbolt's constant 11/12 (against 1/12), and as much again since the nose's motion
    # is a difference; a twenty-fifth of it at 1 ms.
    if case.order == 1:
        assert coarse < 0.01
        assert fine < 0.002
    else:
        assert coarse < 1e-3
        assert fine < 4e-5


def test_backward_euler_converges_linearly_on_the_tow(
    tow: Callable[[sc.Integrator, float], Tow], converged: Tow
) -> None:
    coarse, fine = (
        tow(sc.BackwardEuler(), h).heave_ratio - converged.heave_ratio for h in (5e-3, 2.5e-3)
    )
    assert coarse / fine == pytest.approx(2.0, abs=0.1)


def test_the_box_scheme_alone_leaves_noise_in_the_tension(
    tow: Callable[[sc.Integrator, float], Tow], converged: Tow
) -> None:
    """Crank–Nicolson noise: the box scheme, centred in time, leaves the cable's axial waves
    alternating from step to step, though the heave is right. (Newmark's, which fulfils the
    equations at the end of each step, stay at the level at which they were started.)"""
    for name in ("HHT -0.1", "HHT -1/3", "generalised-alpha 0.8", "Houbolt", "Newmark"):
        range_ = tow(IMPLICIT[name].integrator, 5e-3).tension_range
        assert range_ == pytest.approx(converged.tension_range, rel=2e-3), name
    assert tow(sc.Box(), 5e-3).tension_range > 1.5 * converged.tension_range


def test_forward_euler_fails_on_the_tow(wu_chwang_model: Callable[..., sc.Model]) -> None:
    """An undamped cable has no stable step; what cannot be solved is said."""
    model = wu_chwang_model()
    law = sc.SteadyTow(position=(0, 0, -2), velocity=(1.75, 0, 0))
    start = sc.steady_tow(model, position=(0, 0, -2), velocity=(1.75, 0, 0))
    simulator = sc.Simulator(model, start, integrator=sc.ForwardEuler(), max_step=1e-3)
    with pytest.raises(sc.ConvergenceError, match="t = "):
        simulator.step(60.0, law)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sc.Newmark(beta=0.2, gamma=0.5), "gamma"),
        (lambda: sc.Newmark(beta=0.25, gamma=0.4), "gamma"),
        (lambda: sc.Newmark(beta=math.inf), "finite"),
        (lambda: sc.HHT(alpha=0.1), "alpha"),
        (lambda: sc.HHT(alpha=-0.4), "alpha"),
        (lambda: sc.HHT(alpha=math.nan), "alpha"),
        (lambda: sc.GeneralizedAlpha(rho_inf=-0.1), "rho_inf"),
        (lambda: sc.SingleStepHoubolt(gamma_1=0.4), "gamma_1"),
        (lambda: sc.SingleStepHoubolt(gamma_1=1.6), "gamma_1"),
    ],
)
def test_refuses_unstable_parameters(make: Callable[[], sc.Integrator], message: str) -> None:
    with pytest.raises(sc.InvalidInput, match=message):
        make()
