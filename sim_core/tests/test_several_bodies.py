# SPDX-License-Identifier: Apache-2.0
"""Several bodies on one system: in a row, side by side, and with a line between two of them."""

import math

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

SPEED = 1.5
WIRE = {"diameter": 0.004, "mass_per_length": 0.02, "axial_stiffness": 2e4}


def fish(mass=5.0, weight=0.0, axial_drag=0.5):
    """A body with a tail; `weight`: N in water."""
    tail = {"area": 0.01, "lift_slope": 3.0}
    return sc.Body(
        mass=mass + weight / 9.81, inertia=(0.02, 0.6, 0.6), volume=mass / 1000, diameter=0.1,
        length=1.0, centre_of_gravity=(0, 0, -0.01), added_mass=sc.hull_added_mass(1.0, 0.1),
        axial_drag=axial_drag, cross_flow_drag=1.1,
        fins=[sc.Fin(position=(-0.45, 0, 0), normal=n, **tail) for n in ((0, 0, 1), (0, 1, 0))],
    )  # fmt: skip


def train(segments=3):
    """Two fish in a row, the second on the tail of the first by a line with an end on each."""
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_body("first", fish(weight=10.0))
    b.add_body("second", fish(weight=4.0, axial_drag=0.8))
    line = sc.LineProperties(length=3.0, **WIRE)
    b.add_line("tow", "top", "first", line, segments=4, attachment=(0.5, 0, 0.02))
    b.add_line(
        "between", "first", "second", line, segments=segments,
        start_attachment=(-0.5, 0, 0), attachment=(0.5, 0, 0),
    )  # fmt: skip
    return b.build()


def test_forces_on_a_train_balance():
    """Steady tow: the line between carries weight and drag of all that is behind it."""
    model = train()
    state = sc.steady_tow(model, position=(0, 0, -1), velocity=(SPEED, 0, 0))
    simulator = sc.Simulator(model, state)
    first, second = simulator.body_position("first"), simulator.body_position("second")
    assert second[0] < first[0] - 3.0
    nodes = simulator.node_positions("between")
    q = simulator.body_quaternion("first")
    axis = np.array([1 - 2 * q[2] ** 2, 0, -2 * q[0] * q[2]])  # turned about y alone
    aft = first - 0.5 * axis
    assert nodes[0] == pytest.approx(aft, abs=1e-9)
    # vertical pull at the top: all weights less the lift of fins and hulls. So compare with the
    # residual of the second fish alone: what the line's last segment gives it is in equilibrium.
    pull = simulator.tensions("between")[-1] * (nodes[-2] - nodes[-1])
    pull /= np.linalg.norm(nodes[-2] - nodes[-1])
    alone = sc.ModelBuilder(sc.Water())
    alone.add_prescribed_point("far")
    alone.add_body("second", fish(weight=4.0, axial_drag=0.8))
    thread = sc.LineProperties(
        length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
    )
    alone.add_line("thread", "far", "second", thread, segments=1, attachment=(0, 0, 0))
    lone = sc.State(alone.build())
    lone.set_body("second", second, simulator.body_quaternion("second"), (SPEED, 0, 0))
    needed = -_core._residual(lone)[:3]
    # less the half segment of wire (weight, buoyancy, drag) that hangs on the fish: below 0.1 N
    assert pull == pytest.approx(needed, abs=0.1)
    assert np.linalg.norm(needed) > 4.0


@pytest.mark.parametrize("segments", [1, 3])
def test_jacobian_with_a_line_between_bodies(segments):
    """Both ends of a segment on bodies, or of a line."""
    model = train(segments)
    state = sc.steady_tow(model, position=(0, 0, -1), velocity=(SPEED, 0, 0))
    rng = np.random.default_rng(2)
    n = model.unknowns
    for kind, size in enumerate((0.002, 0.3, 1.0)):
        rates = tuple(float(kind == i) for i in range(3))
        state = _core._displaced(state, size * rng.normal(size=n), rates)
    h = 1e-6
    for rates in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        analytic = _core._jacobian(state, rates)
        for i in range(n):
            step = np.zeros(n)
            step[i] = h
            up = _core._residual(_core._displaced(state, step, rates))
            down = _core._residual(_core._displaced(state, -step, rates))
            # rounding: stiffness 3e4 N/m × coordinates of 10 m × 1e-16/h
            assert (up - down) / (2 * h) == pytest.approx(analytic[:, i], abs=2e-4)


def test_two_fish_side_by_side_mirror_each_other():
    """On a junction with equal lines and side forces of opposite sign the tow stays symmetric."""
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_free_point("junction", mass=0.1)
    line = sc.LineProperties(length=2.0, **WIRE)
    b.add_line("tow", "top", "junction", line, segments=4)
    for name, side in (("port", 1), ("starboard", -1)):
        body = fish(weight=8.0)
        board = sc.Fin(position=(0, 0, 0), normal=(-0.1 * side, 1, 0), area=0.02, lift_slope=2.5)
        body = sc.Body(
            mass=body.mass, inertia=body.inertia, volume=body.volume, diameter=0.1, length=1.0,
            centre_of_gravity=body.centre_of_gravity, added_mass=body.added_mass, axial_drag=0.5,
            cross_flow_drag=1.1, fins=[*body.fins, board],
        )  # fmt: skip
        b.add_body(name, body)
        b.add_line(f"{name} line", "junction", name, line, segments=3, attachment=(0.5, 0, 0))
    model = b.build()
    state = sc.steady_tow(model, position=(0, 0, -1), velocity=(SPEED, 0, 0))
    motion = sc.Sinusoid(mean=(0, 0, -1), velocity=(SPEED, 0, 0), amplitude=0.1, period=2)
    simulator = sc.Simulator(model, state)
    simulator.step(3.0, motion)
    port, starboard = (simulator.body_position(name) for name in ("port", "starboard"))
    # Newton's tolerance, let grow for 600 steps
    assert port * [1, -1, 1] == pytest.approx(starboard, abs=1e-6)
    assert abs(port[1]) > 0.05


def test_two_pendulums_on_one_another_keep_their_energy():
    """Compound double pendulum in vacuum: no energy is made or lost (second order)."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("pivot")
    rod = sc.LineProperties(length=0.5, diameter=0.001, mass_per_length=1e-6, axial_stiffness=1e4)
    for name in ("upper", "lower"):
        body = sc.Body(
            mass=2.0, inertia=(0.01, 0.2, 0.2), volume=0.0, diameter=0.1, length=0.8,
            axial_drag=0.0, cross_flow_drag=0.0,
        )  # fmt: skip
        b.add_body(name, body)
    b.add_line("hanger", "pivot", "upper", rod, segments=1, attachment=(0.4, 0, 0))
    b.add_line(
        "link", "upper", "lower", rod, segments=1,
        start_attachment=(-0.4, 0, 0), attachment=(0.4, 0, 0),
    )  # fmt: skip
    model = b.build()

    def drift(step):
        state = sc.State(model)
        a = 0.6  # hanging along −z, leaning by a: x axis up and aside
        half = (a - math.pi / 2) / 2
        q = (math.cos(half), 0, math.sin(half), 0)
        x = np.array([math.sin(a), 0, math.cos(a)])  # the bodies' x axis in tank axes
        state.set_point("pivot", (0, 0, 0))
        state.set_body("upper", -0.9 * x, q)
        state.set_body("lower", -(0.9 + 1.3) * x, q)
        simulator = sc.Simulator(
            model,
            state,
            integrator=sc.GeneralizedAlpha(rho_inf=1.0),
            max_step=step,
            newton_tolerance=1e-13,
        )
        start = sc.energy(simulator.state).total
        worst = 0.0
        for i in range(1, 21):
            simulator.step(0.05 * i, sc.SteadyTow(position=(0, 0, 0)))
            worst = max(worst, abs(sc.energy(simulator.state).total - start))
        return worst

    scale = 2 * 9.81 * (0.9 + 2.2) * (1 - math.cos(0.6))
    coarse, fine = drift(0.001), drift(0.0005)
    assert fine < 1e-3 * scale
    assert coarse / fine > 3.0
