# SPDX-License-Identifier: Apache-2.0
"""Each integrator keeps its order from every kind of start.

A step that begins with accelerations that are not those of its instant makes an error of h δa in
the velocity: first order, whatever comes after. What starts is a weight on a line that damps,
in waves, released 0.1 m to the side: ω = 4.5 rad/s and rates of damping of 0.5 and 2.5 1/s.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import sim_core as sc

END = 1.0  # s
WAVES = sc.regular_waves(height=0.4, period=2.0)
STILL = sc.SteadyTow(position=(0, 0, 0))
INTEGRATORS = {
    "generalised-α": (sc.GeneralizedAlpha(), 2),
    "HHT": (sc.HHT(alpha=-0.2), 2),
    "Newmark": (sc.Newmark(), 2),
    "Newmark, γ 0.6": (sc.Newmark(beta=0.3025, gamma=0.6), 1),
    "Houbolt": (sc.SingleStepHoubolt(), 2),
    "box": (sc.Box(), 2),
    "implicit Euler": (sc.BackwardEuler(), 1),
    "explicit Euler": (sc.ForwardEuler(), 1),
}
assert {type(one) for one, _ in INTEGRATORS.values()} == set(sc.INTEGRATORS.values())


def weight(waves: sc.Sea | None = None, paid_out: float | None = None) -> sc.Model:
    line = sc.LineProperties(
        length=2.0, diameter=0.01, mass_per_length=1e-9, axial_stiffness=400.0, axial_damping=100.0
    )
    ball = sc.FreePoint(mass=10.0, volume=5e-3, drag_area=0.01, added_mass=2.5)
    return sc.System(
        water=sc.Water() if waves is None else sc.Water(waves=waves),
        points={"top": sc.PrescribedPoint(), "weight": ball},
        lines={
            "line": sc.Line("top", "weight", line, segments=2 if paid_out else 1, paid_out=paid_out)
        },
    ).build()


def aside(model: sc.Model) -> sc.State:
    state = sc.State(model)
    state.set_point("weight", (0.1, 0, -2.2))
    return state


# Each kind of start: what makes a simulator of an integrator and a largest step, and its motion.
Start = Callable[[sc.Integrator, float], tuple[sc.Simulator, sc.Motion]]


def constructed(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    model = weight(WAVES)
    return sc.Simulator(model, aside(model), integrator=integrator, max_step=step), STILL


def restored_as_set(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    model = weight(WAVES)
    rest = sc.steady_tow(model, position=(0, 0, 0))
    simulator = sc.Simulator(model, rest, integrator=integrator, max_step=step)
    simulator.restore(aside(model).save())
    return simulator, STILL


def restored_as_run(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    """A state that another integrator with steps of its own has left."""
    model = weight(WAVES)
    before = sc.Simulator(model, aside(model), integrator=sc.HHT(), max_step=0.001)
    before.step(0.3, STILL)
    simulator = sc.Simulator(model, sc.State(model), integrator=integrator, max_step=step)
    simulator.restore(before.save())
    return simulator, STILL


def in_a_sea_at_once(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    """Its steady tow is solved for without the waves, which are there from the first instant."""
    model = weight(WAVES)
    state = sc.steady_tow(model, position=(0, 0, 0))
    return sc.Simulator(model, state, integrator=integrator, max_step=step), STILL


def at_another_time(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    model = weight(WAVES)
    state = sc.steady_tow(model, position=(0, 0, 0))
    state.set_time(0.4)
    return sc.Simulator(model, state, integrator=integrator, max_step=step), STILL


def with_a_jerk(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    """The tow point has a speed at once, and the line damps: its force jumps."""
    model = weight()
    state = sc.steady_tow(model, position=(0, 0, 0))
    motion = sc.Sinusoid(mean=(0, 0, 0), amplitude=0.1, period=3.0)
    return sc.Simulator(model, state, integrator=integrator, max_step=step), motion


def with_the_winch(integrator: sc.Integrator, step: float) -> tuple[sc.Simulator, sc.Motion]:
    """The drum turns at once, and stays within one segment."""
    model = weight(paid_out=1.0)
    state = sc.steady_tow(model, position=(0, 0, 0))
    simulator = sc.Simulator(model, state, integrator=integrator, max_step=step)
    simulator.set_payout("line", sc.SteadyPayout(start_length=1.0, end_length=1.3, rate=0.2))
    return simulator, STILL


STARTS = (
    constructed,
    restored_as_set,
    restored_as_run,
    in_a_sea_at_once,
    at_another_time,
    with_a_jerk,
    with_the_winch,
)


def end(start: Start, integrator: sc.Integrator, step: float) -> np.ndarray:
    simulator, motion = start(integrator, step)
    simulator.step(simulator.time + END, motion)
    return np.concatenate([simulator.point_position("weight"), simulator.point_velocity("weight")])


@pytest.fixture(scope="module")
def exact() -> dict[str, np.ndarray]:
    """Richardson's extrapolation of two runs of fine steps."""
    found = {}
    for start in STARTS:
        coarse, fine = (end(start, sc.Newmark(), END / n) for n in (4000, 8000))
        found[start.__name__] = fine + (fine - coarse) / 3
    return found


@pytest.mark.parametrize("start", STARTS, ids=lambda start: start.__name__)
@pytest.mark.parametrize("name", INTEGRATORS)
def test_order(exact: dict[str, np.ndarray], name: str, start: Start) -> None:
    integrator, order = INTEGRATORS[name]
    errors = [
        float(np.linalg.norm(end(start, integrator, END / n) - exact[start.__name__]))
        for n in (200, 400)
    ]
    # next term of the error: some h of the fastest rate, 5 ms · 4.5 rad/s · a few
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


def test_free_fall_of_a_restored_state() -> None:
    """g t²/2: exact with each scheme that knows that g acts from the start."""
    wire = sc.LineProperties(length=50.0, diameter=2e-3, mass_per_length=1e-6, axial_stiffness=6e5)
    model = sc.System(
        water=sc.Water(density=0.0),
        points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=2.0)},
        lines={"line": sc.Line("top", "weight", wire, segments=1)},
    ).build()
    state = sc.State(model)
    state.set_point("weight", (0, 0, -1))
    rest = sc.steady_tow(model, position=(0, 0, 0))
    simulator = sc.Simulator(model, rest, max_step=0.05)
    simulator.restore(state.save())
    assert simulator.point_acceleration("weight") == pytest.approx([0, 0, -9.81], abs=1e-9)
    simulator.step(1.0, STILL)
    assert simulator.point_position("weight")[2] == pytest.approx(-1 - 9.81 / 2, abs=1e-6)
