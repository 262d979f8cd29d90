# SPDX-License-Identifier: Apache-2.0
"""Steps chosen by their error: on problems with known answers, in quiet and in violent runs."""

import math

import numpy as np
import pytest

import sim_core as sc

IMPLICIT = {
    "generalised-α": sc.GeneralizedAlpha(),
    "HHT": sc.HHT(),
    "Newmark": sc.Newmark(),
    "Houbolt": sc.SingleStepHoubolt(),
    "box": sc.Box(),
    "implicit Euler": sc.BackwardEuler(),
}
assert {type(one) for one in IMPLICIT.values()} == {*sc.INTEGRATORS.values()} - {sc.ForwardEuler}
SECOND_ORDER = [name for name in IMPLICIT if name != "implicit Euler"]


def falling_sphere(free_sphere):
    model = free_sphere(5.25, 0.697e-3, 0.0045, 0.35)
    state = sc.State(model)
    state.set_point("far", (0, 0, -500))
    state.set_point("sphere", (0, 0, -10))
    wet = (5.25 - 0.697) * 9.81
    terminal = math.sqrt(2 * wet / 4.5)
    rate = wet / (5.6 * terminal)

    def depth(t):
        return 10 + terminal / rate * math.log(math.cosh(rate * t))

    return model, state, sc.SteadyTow(position=(0, 0, -500)), depth


@pytest.mark.parametrize("name", IMPLICIT)
def test_error_falls_with_the_tolerance(free_sphere, name):
    """Second order: local error ∝ h³, so h ∝ tol^(1/3), and the error after a given time ∝ h² ∝
    tol^(2/3): 21 for a tolerance a hundred times smaller. Implicit Euler: h² and h: 10."""
    model, state, still, depth = falling_sphere(free_sphere)
    errors, steps = [], []
    for tolerance in (1e-5, 1e-7):
        simulator = sc.Simulator(
            model, state, integrator=IMPLICIT[name], max_step=0.5, error_tolerance=tolerance
        )
        simulator.step(1.5, still)
        errors.append(abs(-simulator.point_position("sphere")[2] - depth(1.5)))
        steps.append(simulator.steps)
    expected = 21 if name in SECOND_ORDER else 10
    # the controller keeps h somewhat below, and start and end count differently: a factor of 2
    assert expected / 2 < errors[0] / errors[1] < expected * 2
    assert errors[1] < steps[1] * 1e-7  # the errors of all steps together at most
    assert steps[1] > 2 * steps[0]


def test_fewer_steps_where_little_happens(free_sphere):
    """Within the first seconds the sphere comes to its terminal velocity, then nothing changes: at
    the error of the adaptive run, fixed steps are many times as many."""
    model, state, still, depth = falling_sphere(free_sphere)
    end = 60.0

    def run(**settings):
        simulator = sc.Simulator(model, state, **settings)
        simulator.step(end, still)
        return simulator.steps, abs(-simulator.point_position("sphere")[2] - depth(end))

    steps, error = run(max_step=10.0, error_tolerance=1e-6)
    fixed_steps, fixed_error = run(max_step=end / (4 * steps))
    assert fixed_error > error
    assert fixed_steps == 4 * steps


def test_pendulum_in_time():
    """T = 4 √(ℓ/g) K(sin²(θ₀/2)): after a quarter the bob is at the bottom, at its fastest."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("pivot")
    b.add_free_point("bob", mass=1.0)
    wire = sc.LineProperties(length=1.0, diameter=1e-3, mass_per_length=1e-9, axial_stiffness=1e8)
    b.add_line("wire", "pivot", "bob", wire, segments=1)
    model = b.build()
    state = sc.State(model)
    start = (1 + 9.81 * math.cos(1.0) / 1e8) * np.array([math.sin(1.0), 0, -math.cos(1.0)])
    state.set_point("bob", tuple(start))
    # the arithmetic-geometric mean: K(m) = π / (2 agm(1, √(1 − m)))
    a, g = 1.0, math.cos(0.5)
    for _ in range(6):
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    period = 2 * math.pi * math.sqrt(1 / 9.81) / a
    errors = []
    for tolerance in (1e-5, 1e-7):
        simulator = sc.Simulator(model, state, max_step=0.1, error_tolerance=tolerance)
        simulator.step(period / 4, sc.SteadyTow(position=(0, 0, 0)))
        errors.append(abs(simulator.point_position("bob")[0]))
    assert errors[1] < 1e-4
    assert 10 < errors[0] / errors[1] < 40  # 21, as above


def sudden_stop(nit_model):
    model = nit_model(segments=(6, 2, 4))
    motion = sc.EmergencyStop(
        position=(0, 0, 0.2), velocity=(1, 0, 0), stop_time=3, stopping_time=0.2
    )
    return model, sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0)), motion


def test_emergency_stop_takes_small_steps_only_while_it_lasts(nit_model):
    model, state, motion = sudden_stop(nit_model)

    def run(**settings):
        result = sc.run(model, motion, state=state, t_end=8.0, output_step=1.0, **settings)
        return result.steps, result.bodies["fish"].position

    _, exact = run(max_step=0.0001)
    steps, adaptive = run(max_step=0.1, error_tolerance=1e-5)
    _, fixed = run(max_step=8.0 / steps)
    assert np.abs(adaptive - exact).max() < 2e-3
    assert np.abs(adaptive - exact).max() < np.abs(fixed - exact).max()


def test_continues_bit_for_bit(nit_model):
    """The control's memory belongs to the state."""
    model, state, motion = sudden_stop(nit_model)
    settings = {"max_step": 0.1, "error_tolerance": 1e-6}
    simulator = sc.Simulator(model, state, **settings)
    simulator.step(3.1, motion)
    assert simulator.rejections > 0
    other = sc.Simulator(model, sc.State(model), **settings)
    other.restore(simulator.save())
    for s in (simulator, other):
        s.step(3.3, motion)
        s.step(4.0, motion)
    assert other.save() == simulator.save()


def test_says_where_no_step_is_small_enough(nit_model):
    model, state, motion = sudden_stop(nit_model)
    simulator = sc.Simulator(model, state, max_step=0.1, error_tolerance=1e-9, min_step=0.02)
    with pytest.raises(sc.ConvergenceError, match=r"worst at .* give a larger tolerance"):
        simulator.step(5.0, motion)
    assert 0 <= simulator.time < 5.0


def test_refuses_impossible_settings(nit_model):
    model, state, _ = sudden_stop(nit_model)
    for message, settings in (
        ("error_tolerance", {"error_tolerance": 0.0}),
        ("min_step", {"error_tolerance": 1e-6, "min_step": 1.0}),
        ("implicit", {"error_tolerance": 1e-6, "integrator": sc.ForwardEuler()}),
    ):
        with pytest.raises(sc.InvalidInput, match=message):
            sc.Simulator(model, state, **settings)
