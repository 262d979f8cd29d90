# SPDX-License-Identifier: Apache-2.0
"""Contact with the floor and walls of a tank."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import sim_core as sc

RADIUS = 0.05
VOLUME = 4.0 / 3.0 * math.pi * RADIUS**3


def sphere_in(tank, water, mass, drag_area=0.0):
    """A sphere on a slack thread of no account."""
    b = sc.ModelBuilder(water)
    b.set_tank(tank)
    b.add_prescribed_point("far")
    b.add_free_point("sphere", mass=mass, volume=VOLUME, drag_area=drag_area)
    thread = sc.LineProperties(
        length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
    )
    b.add_line("thread", "far", "sphere", thread, segments=1)
    return b.build()


def thrown(model, position, velocity=(0.0, 0.0, 0.0), max_step=1e-3):
    state = sc.State(model)
    state.set_point("far", (0.0, 0.0, 500.0))
    state.set_point("sphere", position, velocity)
    return sc.Simulator(model, state, max_step=max_step)


STAY = sc.SteadyTow(position=(0.0, 0.0, 500.0))
EMPTY = sc.Water(density=0.0, gravity=0.0)


def test_sphere_rests_on_the_floor():
    mass, k = 1.0, 2000.0
    tank = sc.Tank(floor=-2.0, stiffness=k, damping=1.0)
    model = sphere_in(tank, sc.Water(), mass, drag_area=0.02)
    simulator = thrown(model, (0, 0, -1.9), max_step=5e-3)
    simulator.step(8.0, STAY)
    weight = (mass - 1000.0 * VOLUME) * 9.81
    depth = RADIUS - (simulator.point_position("sphere")[2] + 2.0)
    # Settled: the spring's damping, damping · weight = 4.7 N s/m, makes it decay as
    # e^(−2.3 t), to 1e-8 of the bounce
    assert depth == pytest.approx(weight / k, rel=1e-6)
    assert simulator.contacts[0].place == "point 'sphere'"
    assert simulator.contacts[0].side == "floor"
    assert simulator.contacts[-1].released == math.inf


def test_sphere_rests_on_a_bed_by_its_section():
    """N = κ A d with the modulus of subgrade reaction κ and A = π r²."""
    mass, bed = 1.0, 3e5
    tank = sc.Tank(floor=-2.0, bed_stiffness=bed)
    state = sc.steady_tow(sphere_in(tank, sc.Water(), mass), position=(0, 0, 998.0))
    weight = (mass - 1000.0 * VOLUME) * 9.81
    depth = RADIUS - (state.point_position("sphere")[2] + 2.0)
    assert depth == pytest.approx(weight / (bed * math.pi * RADIUS**2), rel=1e-5)


def test_line_lies_on_a_bed_by_its_diameter():
    """A level limp line: its weight w is carried at the depth w/(κ d), however it is cut."""
    line = sc.LineProperties(
        length=10.0, diameter=0.04, mass_per_length=8.0, axial_stiffness=1e6, added_mass=0.0
    )
    weight = 9.81 * (8.0 - 1000.0 * math.pi / 4 * 0.04**2)
    depth = weight / (1e5 * 0.04)
    ends = {"a": (0.0, 0.0, -5.0 + 0.02 - depth), "b": (10.0, 0.0, -5.0 + 0.02 - depth)}
    for segments in (7, 20):
        system = sc.System(
            points={"a": sc.PrescribedPoint(), "b": sc.PrescribedPoint()},
            lines={"line": sc.Line("a", "b", line, segments=segments)},
            tank=sc.Tank(floor=-5.0, bed_stiffness=1e5),
        )
        state = sc.steady_tow(system.build(), position=ends)
        assert state.node_positions("line")[:, 2] == pytest.approx(ends["a"][2], abs=1e-9)


@pytest.mark.parametrize(
    "tank",
    [
        {"floor": -2.0},
        {"width": 3.0, "bed_stiffness": 1e5},
        {"floor": -2.0, "bed_stiffness": -1.0},
        {"floor": -2.0, "bed_stiffness": math.nan},
    ],
)
def test_a_side_without_stiffness_is_refused(tank):
    with pytest.raises(sc.InvalidInput, match=r"(?i)tank: (bed_)?stiffness must"):
        sc.Tank(**tank)


@pytest.mark.parametrize(
    ("side", "normal"),
    [
        ("floor", (0, 0, 1)),
        ("port wall", (0, -1, 0)),
        ("starboard wall", (0, 1, 0)),
        ("aft end", (1, 0, 0)),
        ("forward end", (-1, 0, 0)),
    ],
)
def test_rebound_from_every_side(side, normal):
    """Hunt & Crossley: F = k d (1 + a v), so v/a − ln(1 + a v)/a² is the same coming and going."""
    a, speed = 0.4, 1.5
    tank = sc.Tank(floor=-1.0, width=2.0, ends=(-1.0, 1.0), stiffness=1e4, damping=a, onset=1e-4)
    n = np.array(normal, dtype=float)
    # The contact takes π √(m/k) = 31 ms, the onset 0.1 ms
    simulator = thrown(sphere_in(tank, EMPTY, 1.0), tuple(-0.9 * n), tuple(-speed * n), 2e-4)
    simulator.step(0.3, STAY)

    def measure(v):
        return v / a - math.log1p(a * v) / a**2

    back = brentq(lambda v: measure(-v) - measure(speed), 0.0, speed)
    assert back < 0.8 * speed
    velocity = simulator.point_velocity("sphere")
    # The onset takes a share of about onset / greatest depth = 1e-4/0.015 of the loss
    assert velocity @ n == pytest.approx(back, rel=2e-3)
    assert velocity - (velocity @ n) * n == pytest.approx(np.zeros(3), abs=1e-12)
    (event,) = simulator.contacts
    assert event.side == side
    assert event.time == pytest.approx((0.1 - RADIUS) / speed, abs=2.1e-4)
    assert 0.02 < event.released - event.time < 0.06
    assert event.position @ n == pytest.approx(RADIUS - 1.0, abs=2.1e-4 * speed)


def test_sliding_to_rest():
    """Coulomb: μ g of deceleration, v²/(2 μ g) of way."""
    friction, speed, creep = 0.3, 1.0, 1e-3
    tank = sc.Tank(floor=0.0, stiffness=1e4, damping=2.0, friction=friction, sliding_speed=creep)
    resting = RADIUS - 9.81 / 1e4 - 2e-5  # near enough
    model = sphere_in(tank, sc.Water(density=0.0), 1.0)
    simulator = thrown(model, (0, 0, resting), (speed, 0, 0), max_step=2e-3)
    simulator.step(1.0, STAY)
    way = speed**2 / (2.0 * friction * 9.81)
    # Below the creep it slows down exponentially: that adds creep · speed / (μ g) at most; the
    # sphere's settling by 2e-5 m changes the load for a short time by no more than 2 %
    tolerance = 1.1 * creep * speed / (friction * 9.81) + 1e-3 * way
    assert simulator.point_position("sphere")[0] == pytest.approx(way, abs=tolerance)
    assert abs(simulator.point_velocity("sphere")[0]) < 1e-9


def test_chain_lowered_onto_the_floor():
    """Its top carries the nodes that still hang, and no more."""
    n, length = 20, 4.0
    chain = sc.LineProperties(
        length=length, diameter=0.01, mass_per_length=0.5, axial_stiffness=1e5
    )
    b = sc.ModelBuilder(sc.Water())
    b.set_tank(sc.Tank(floor=-5.0, stiffness=500.0, damping=5.0, friction=0.3))
    b.add_prescribed_point("top")
    b.add_free_point("end")
    b.add_line("chain", "top", "end", chain, segments=n)
    model = b.build()
    state = sc.steady_tow(model, position=(0, 0, -0.9))
    low = -5.0 + 8.5 * length / n  # node 8 hangs, node 9 lies
    down = sc.Simulator(model, state, max_step=0.01)
    down.step_to(6.0, position=(0, 0, low), velocity=(0, 0, 0))
    down.step(9.0, sc.SteadyTow(position=(0, 0, low)))
    segment_weight = (0.5 - 1000.0 * math.pi / 4.0 * 0.01**2) * 9.81 * length / n
    assert down.tensions("chain")[0] == pytest.approx(8 * segment_weight, rel=1e-3)
    assert down.tensions("chain")[10:].max() < 0.05 * segment_weight
    touched = {contact.place for contact in down.contacts}
    assert touched == {"point 'end'"} | {f"line 'chain' node {i}" for i in range(9, n)}


def test_fish_lies_on_nose_middle_and_tail():
    b = sc.ModelBuilder(sc.Water())
    b.set_tank(sc.Tank(floor=-1.0, stiffness=500.0, damping=20.0, friction=0.2))
    b.add_prescribed_point("tow_point")
    fish = sc.Body(
        mass=5.5, inertia=(0.01, 0.5, 0.5), volume=5e-3, diameter=0.1, length=1.0,
        added_mass=(0.2, 5.0, 5.0, 0.0, 0.4, 0.4), axial_drag=0.3, cross_flow_drag=1.1,
    )  # fmt: skip
    b.add_body("fish", fish)
    thread = sc.LineProperties(length=2.0, diameter=1e-6, mass_per_length=1e-6, axial_stiffness=1e2)
    b.add_line("thread", "tow_point", "fish", thread, segments=1, attachment=(0.5, 0, 0))
    model = b.build()
    state = sc.State(model)
    state.set_point("tow_point", (0.5, 0.0, 0.0))
    state.set_body("fish", (0.0, 0.0, -0.93), quaternion=(1.0, 0.0, 0.02, 0.0))
    result = sc.run(
        model, sc.SteadyTow(position=(0.5, 0.0, 0.0)), t_end=12.0, state=state, output_step=1.0
    )
    # Three springs carry the weight, beyond their onset
    z = result.bodies["fish"].position[-1, 2]
    assert z == pytest.approx(-1.0 + 0.05 - 0.5 * 9.81 / 1500.0, abs=1e-6)
    lying = {event.place for event in result.events if event.released == math.inf}
    assert lying == {"body 'fish' nose", "body 'fish' middle", "body 'fish' tail"}


def test_contacts_are_copied_and_start_anew_after_restore():
    tank = sc.Tank(floor=-1.0, stiffness=1e4)
    simulator = thrown(sphere_in(tank, EMPTY, 1.0), (0, 0, -0.9), (0, 0, -1.0))
    start = simulator.save()
    simulator.step(0.06, STAY)
    assert len(simulator.copy().contacts) == len(simulator.contacts) == 1
    simulator.restore(start)
    assert not simulator.contacts
    simulator.step(0.06, STAY)
    assert len(simulator.contacts) == 1
    assert simulator.contacts_lost == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stiffness": 0.0}, "stiffness"),
        ({"width": -1.0}, "width"),
        ({"ends": (1.0, 0.0)}, "ends"),
        ({"friction": math.nan}, "friction"),
    ],
)
def test_impossible_tanks_are_refused(changes, message):
    with pytest.raises(sc.InvalidInput, match=f"(?i)tank: {message}"):
        sc.Tank(**({"stiffness": 1e4, "floor": -3.0} | changes))
