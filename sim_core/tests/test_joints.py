# SPDX-License-Identifier: Apache-2.0
"""Ball joints: pendulums, welds, energy, and their place in the description."""

import math
import pickle

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

G = 9.81


def rod(mass=30.0, length=2.0, **changes):
    """A thin rod about its middle, along x, in vacuum."""
    across = mass * length**2 / 12.0
    values = {
        "mass": mass, "inertia": (0.01, across, across), "volume": 0.0, "diameter": 0.05,
        "length": length, "axial_drag": 0.0, "cross_flow_drag": 0.0, "munk_moment": 0.0,
    }  # fmt: skip
    return sc.Body(**values | changes)


def pendulum(stiffness=1e7, **changes):
    return sc.System(
        water=sc.Water(density=0.0),
        points={"pin": sc.PrescribedPoint()},
        bodies={"rod": rod(**changes)},
        lines={},
        joints={"hinge": sc.Joint("pin", "rod", attachment=(1.0, 0, 0), stiffness=stiffness)},
    )


def swinging(model, angle):
    """A rod that hangs on its nose, turned out of the vertical by an angle, at rest."""
    pitch = -math.pi / 2 + angle  # positive pitch is nose down
    state = sc.State(model)
    state.set_point("pin", (0, 0, 0))
    forward = np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    state.set_body("rod", tuple(-forward), (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0))
    return state


STILL = sc.SteadyTow(position=(0, 0, 0))


def test_period_of_a_pendulum_on_a_joint():
    """A rod of length L on its end: T₀ = 2π √(2L/3g), for small angles; at rest after a quarter.

    The step's error of the frequency is about (ωh)²/12 = 2e-5, of the amplitude φ²/16 = 6e-6; the
    joint, unstretched at first, rings by W/k = 3e-6 m. The phase at the end is off by π times that.
    """
    length, angle = 2.0, 0.01
    model = pendulum(stiffness=1e8).build()
    simulator = sc.Simulator(model, swinging(model, angle), max_step=0.005)
    period = 2 * math.pi * math.sqrt(2 * length / (3 * G))
    simulator.step(period / 2, STILL)
    middle = simulator.body_position("rod")
    assert middle[0] == pytest.approx(math.sin(angle), rel=1e-4)
    largest = angle * 2 * math.pi / period
    assert simulator.body_velocity("rod")[0] == pytest.approx(0.0, abs=2e-4 * largest)


def test_steady_pull_on_a_joint_is_the_weight():
    model = pendulum().build()
    state = sc.steady_tow(model, position=(1.0, 2.0, 3.0))
    simulator = sc.Simulator(model, state)
    assert simulator.hook_load("pin") == pytest.approx([0, 0, -30.0 * G], abs=1e-6)
    # It hangs below its nose, the nose lower than the pin by W/k.
    nose = (0.0, 0.0, 3.0 - 30.0 * G / 1e7 - 1.0)
    assert state.body_position("rod") - np.array([1, 2, 0]) == pytest.approx(nose, abs=1e-6)


def test_energy_of_a_swing_is_kept_and_its_dashpot_counted():
    """From 1 rad, in vacuum: the balance leaves 1e-4 of what is exchanged, and no `other`."""
    system = pendulum().replace({"joints.hinge.damping": 2000.0})
    model = system.build()
    simulator = sc.Simulator(model, swinging(model, 1.0), max_step=0.002)
    start = sc.energy(simulator.state).total
    simulator.start_balance()
    simulator.step(2.0, STILL)
    balance = simulator.energy_balance
    assert abs(balance.other) < 1e-9 * balance.exchanged
    assert abs(balance.numerical) < 1e-4 * balance.exchanged
    assert balance.damping < 0.0
    change = sc.energy(simulator.state).total - start
    assert change == pytest.approx(balance.damping + balance.numerical, abs=1e-6 * abs(start))


def test_three_joints_weld_two_bodies():
    """Two equal rods in a line, joined at three places, swing as one rod of twice the length."""
    half = rod(mass=15.0, length=1.0)
    places = ((-0.5, 0, 0), (-0.5, 0.2, 0.1), (-0.5, -0.2, 0.1))
    others = ((0.5, y, z) for _, y, z in places)
    weld = {
        f"weld{i}": sc.Joint("a", "b", start_attachment=here, attachment=there, stiffness=1e7)
        for i, (here, there) in enumerate(zip(places, others, strict=True))
    }
    system = sc.System(
        water=sc.Water(density=0.0),
        points={"pin": sc.PrescribedPoint()},
        bodies={"a": half, "b": half},
        lines={},
        joints={
            "hinge": sc.Joint("pin", "a", attachment=(0.5, 0, 0), stiffness=1e7),
            **weld,
        },
    )
    model = system.build()
    angle = 0.01
    pitch = -math.pi / 2 + angle
    forward = np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    state = sc.State(model)
    quaternion = (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0)
    state.set_point("pin", (0, 0, 0))
    state.set_body("a", tuple(-0.5 * forward), quaternion)
    state.set_body("b", tuple(-1.5 * forward), quaternion)
    simulator = sc.Simulator(model, state, max_step=0.005)
    simulator.step(math.pi * math.sqrt(4.0 / (3 * G)), STILL)
    assert simulator.body_position("b")[0] == pytest.approx(1.5 * math.sin(angle), rel=5e-3)


def test_jacobian_of_joints_is_the_derivative():
    """Central differences of the residual, at a state in motion; errors 1e-6 of the stiffness."""
    system = sc.System(
        points={"pin": sc.PrescribedPoint(), "free": sc.FreePoint(mass=2.0)},
        bodies={"a": rod(volume=0.01), "b": rod(volume=0.02)},
        lines={},
        joints={
            "top": sc.Joint("pin", "a", attachment=(1, 0.1, 0), stiffness=1e4, damping=50.0),
            "pair": sc.Joint(
                "a", "b", start_attachment=(-1, 0, 0.2), attachment=(1, 0, 0), stiffness=2e4
            ),
            "end": sc.Joint("b", "free", start_attachment=(0, 0.3, 0), stiffness=5e3, damping=9.0),
        },
    )
    model = system.build()
    random = np.random.default_rng(3)
    state = sc.State(model)
    state.set_point("pin", (0, 0, -2))
    state.set_point("free", tuple(random.normal(size=3)), tuple(random.normal(size=3)))
    for name in "ab":
        turn = random.normal(size=4)
        state.set_body(
            name,
            tuple(random.normal(size=3) - [0, 0, 5]),
            tuple(turn / np.linalg.norm(turn)),
            tuple(random.normal(size=3)),
            tuple(random.normal(size=3)),
        )
    rates = (1.0, 3.0, 7.0)
    exact = _core._jacobian(state, rates)
    step = 1e-6
    for column in range(model.unknowns):
        push = np.zeros(model.unknowns)
        push[column] = step
        ahead, behind = (
            _core._residual(_core._displaced(state, sign * push, rates)) for sign in (1, -1)
        )
        numeric = (ahead - behind) / (2 * step)
        assert exact[:, column] == pytest.approx(numeric, abs=1e-6 * 3e4)


def test_joints_are_part_of_the_description():
    system = pendulum()
    model = system.build()
    assert model.joints == ["hinge"]
    assert sc.System.of(model) == system
    assert sc.System.of(pickle.loads(pickle.dumps(model))) == system


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints.hinge.stiffness": 0.0}, "joint 'hinge': stiffness must be above 0"),
        ({"joints.hinge.stiffness": math.inf}, "Joint: stiffness must be finite, not inf"),
        ({"joints.hinge.damping": -1.0}, "joint 'hinge': damping must not be below 0"),
        ({"joints.hinge.attachment": None}, "joint 'hinge': attachment is needed at a body"),
        ({"joints.hinge.end": "fish"}, "joint 'hinge': its end 'fish' is neither"),
        ({"joints": {}}, "body 'rod': no line or joint holds it"),
    ],
)
def test_impossible_joints_are_refused(change, message):
    with pytest.raises(sc.InvalidInput, match=message):
        pendulum().replace(change).build()
