# SPDX-License-Identifier: Apache-2.0
"""Steady tow against closed forms and an ordinary differential equation solved to 1e-10."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import sim_core as sc

SPEED = 1.75
INEXTENSIBLE = 1e8  # N: strains of 1e-6


def towed_line(properties, segments, end_mass=0.0, end_drag_area=0.0):
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=end_mass, drag_area=end_drag_area)
    b.add_line("line", "top", "end", properties, segments=segments)
    state = sc.steady_tow(b.build(), position=(0, 0, -1), velocity=(SPEED, 0, 0))
    return state.node_positions("line") - np.array([0, 0, -1])


@pytest.mark.parametrize(
    ("air", "water", "degrees"), [(0.181, 0.104, 13.504), (0.124, 0.065, 11.426)]
)
def test_critical_angle(air, water, degrees):
    """Pode: w cos φ = R sin²φ for a straight cable without end load."""
    d = math.sqrt(4 * (air - water) / 1000 / math.pi)
    cable = sc.LineProperties(
        length=3.0, diameter=d, mass_per_length=air, axial_stiffness=628e3, normal_drag=1.2
    )
    nodes = towed_line(cable, 10)
    spans = np.diff(nodes, axis=0)
    angle = np.arctan2(-spans[:, 2], -spans[:, 0])
    R = 0.5 * 1000 * 1.2 * d * SPEED**2
    w = water * 9.81
    expected = math.acos((-w + math.sqrt(w * w + 4 * R * R)) / (2 * R))
    assert angle == pytest.approx(np.full(10, expected), abs=1e-6)
    assert math.degrees(expected) == pytest.approx(degrees, abs=5e-4)


def order_of(errors):
    """Observed orders between successive doublings."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def test_neutrally_buoyant_cable():
    """c = cot φ0 + R s/T0, z = (T0/R)(asinh c − asinh c0), x = (T0/R)(√(1+c²) − √(1+c0²))."""
    d, length, mass, drag_area = 0.01, 20.0, 5.0, 0.01
    weight = mass * 9.81
    drag = 0.5 * 1000 * drag_area * SPEED**2
    T0, c0 = math.hypot(weight, drag), drag / weight
    R = 0.5 * 1000 * 1.2 * d * SPEED**2
    c = c0 + R * length / T0
    depth = T0 / R * (math.asinh(c) - math.asinh(c0))
    layback = T0 / R * (math.sqrt(1 + c * c) - math.sqrt(1 + c0 * c0))
    errors = []
    for segments in (10, 20, 40, 80):
        cable = sc.LineProperties(
            length=length,
            diameter=d,
            mass_per_length=1000 * math.pi / 4 * d * d,
            axial_stiffness=INEXTENSIBLE,
            tangential_drag=0.0,
        )
        end = towed_line(cable, segments, mass, drag_area)[-1]
        errors.append(math.hypot(end[0] + layback, end[2] + depth))
    assert errors[-1] < 1e-3 * depth
    assert order_of(errors[:3]).min() > 1.9  # before the strain of 1e-6 shows


def test_heavy_cable():
    """dT/ds = w sin φ + F cos²φ, T dφ/ds = w cos φ − R sin²φ, from the end upwards."""
    d, length, mass, air = 0.01, 30.0, 5.0, 0.3
    w = (air - 1000 * math.pi / 4 * d * d) * 9.81
    R = 0.5 * 1000 * 1.2 * d * SPEED**2
    F = 0.5 * 1000 * 0.01 * math.pi * d * SPEED**2

    def slope(_s, y):
        T, phi, _x, _z = y
        return [
            w * math.sin(phi) + F * math.cos(phi) ** 2,
            (w * math.cos(phi) - R * math.sin(phi) ** 2) / T,
            math.cos(phi),
            math.sin(phi),
        ]

    y = solve_ivp(slope, (0, length), [mass * 9.81, math.pi / 2, 0, 0], rtol=1e-11, atol=1e-12)
    layback, depth = y.y[2, -1], y.y[3, -1]
    errors = []
    for segments in (20, 40, 80):
        cable = sc.LineProperties(
            length=length, diameter=d, mass_per_length=air, axial_stiffness=INEXTENSIBLE
        )
        end = towed_line(cable, segments, mass)[-1]
        errors.append(math.hypot(end[0] + layback, end[2] + depth))
    assert errors[0] < 0.005 * depth
    assert order_of(errors) == pytest.approx([2, 2], abs=0.15)


def test_elastic_catenary():
    """Irvine (1981): both ends held, horizontal tension H and vertical tension V at the top."""
    length, w, EA = 10.0, 5.0, 2000.0
    span, drop = 6.0, 4.0

    def ends(unknown):
        H, V = unknown
        s = length
        x = H * s / EA + H / w * (math.asinh(V / H) - math.asinh((V - w * s) / H))
        z = s * (V - w * s / 2) / EA + (math.hypot(H, V) - math.hypot(H, V - w * s)) / w
        return [x - span, z - drop]

    H, V = fsolve(ends, [10.0, 40.0], xtol=1e-13)
    middle_s = length / 2
    middle = np.array(
        [
            H * middle_s / EA + H / w * (math.asinh(V / H) - math.asinh((V - w * middle_s) / H)),
            middle_s * (V - w * middle_s / 2) / EA
            + (math.hypot(H, V) - math.hypot(H, V - w * middle_s)) / w,
        ]
    )
    errors = []
    for segments in (10, 20, 40):
        b = sc.ModelBuilder(sc.Water(density=0.0))
        b.add_prescribed_point("top")
        b.add_prescribed_point("bottom")
        cable = sc.LineProperties(
            length=length, diameter=0.01, mass_per_length=w / 9.81, axial_stiffness=EA
        )
        b.add_line("line", "top", "bottom", cable, segments=segments)
        state = sc.steady_tow(b.build(), position={"top": (0, 0, 0), "bottom": (span, 0, -drop)})
        x, _, z = state.node_positions("line")[segments // 2]
        errors.append(math.hypot(x - middle[0], z + middle[1]))
    assert errors[1] < 1e-3 * length
    assert order_of(errors) == pytest.approx([2, 2], abs=0.15)


def test_steady_tow_is_steady(wu_chwang_model):
    """Stepping from the statics changes nothing: accelerations stay at the Newton tolerance."""
    model = wu_chwang_model()
    state = sc.steady_tow(model, position=(0, 0, -2), velocity=(SPEED, 0, 0))
    shape = state.node_positions("primary")
    simulator = sc.Simulator(model, state)
    simulator.step(2.0, sc.SteadyTow(position=(0, 0, -2), velocity=(SPEED, 0, 0)))
    moved = simulator.node_positions("primary") - shape - np.array([2.0 * SPEED, 0, 0])
    assert np.abs(moved).max() < 1e-6
    assert np.abs(simulator.body_acceleration("fish")).max() < 1e-5


def test_current_against_tow_is_the_same_as_a_faster_tow(wu_chwang_model):
    def shape(current, speed):
        b = sc.ModelBuilder(sc.Water(current=(current, 0, 0)))
        b.add_prescribed_point("top")
        b.add_free_point("end", mass=2.0, volume=0.5e-3, drag_area=0.01)
        cable = sc.LineProperties(
            length=5.0, diameter=0.01, mass_per_length=0.2, axial_stiffness=1e5
        )
        b.add_line("line", "top", "end", cable, segments=8)
        state = sc.steady_tow(b.build(), position=(0, 0, -1), velocity=(speed, 0, 0))
        return state.node_positions("line")

    assert shape(-0.7, 0.8) == pytest.approx(shape(0.0, 1.5), abs=1e-9)


def test_bridle_is_a_closed_loop():
    """Two equal legs to a body in still air form a closed loop and share its weight evenly."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("ring", mass=0.1)
    body = sc.Body(
        mass=10.0, inertia=(0.1, 1, 1), volume=0.01, diameter=0.1, length=1.0,
        axial_drag=0.0, cross_flow_drag=0.0,
    )  # fmt: skip
    b.add_body("beam", body)
    wire = sc.LineProperties(length=1.0, diameter=0.002, mass_per_length=0.02, axial_stiffness=1e5)
    b.add_line("upper", "top", "ring", wire, segments=4)
    b.add_line("fore", "ring", "beam", wire, segments=4, attachment=(0.5, 0, 0))
    b.add_line("aft", "ring", "beam", wire, segments=4, attachment=(-0.5, 0, 0))
    model = b.build()
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 5)))
    fore, aft = simulator.tensions("fore"), simulator.tensions("aft")
    assert fore == pytest.approx(aft, rel=1e-6)
    # equilateral: each leg is 30° off the vertical (stretched by 6e-4, hence the tolerance)
    assert fore[-1] == pytest.approx(10 * 9.81 / 2 / math.cos(math.pi / 6), rel=2e-3)


@pytest.mark.parametrize("stiffness", [600.0, 6e5])
def test_a_cable_folds_below_a_float_that_holds_a_part_of_it(stiffness):
    """A float at the lower end, as buoyant as 16 of 40 segments are heavy in water.

    At rest nothing pulls sideways, so the cable hangs down and goes up again on one vertical. The
    float carries its own half segment and 15 nodes in full, and half of the node at the fold, which
    lies 16 segments below the float and 24 below the top: the float is 8 segments below the top.
    """
    segments, weight = 40, 0.1  # weight of a segment in water, N
    length = 2.0 / segments
    diameter = 0.01
    displaced = 1000 * math.pi / 4 * diameter**2
    cable = sc.LineProperties(
        length=2.0, diameter=diameter, mass_per_length=displaced + weight / length / 9.81,
        axial_stiffness=stiffness, slack_tension=1e-4,
    )  # fmt: skip
    b = sc.ModelBuilder()
    b.add_prescribed_point("top")
    b.add_free_point("float", mass=0.1, volume=(0.1 + 16 * weight / 9.81) / 1000)
    b.add_line("line", "top", "float", cable, segments=segments)
    model = b.build()
    state = sc.steady_tow(model, position=(0, 0, -1))
    # What the line carries at its ends, from the balance of the nodes; it stretches by as much.
    tensions = weight * np.concatenate([np.arange(23.5, 0, -1), np.arange(0.5, 16)])
    lengths = length * (1 + tensions / stiffness)
    lengths[24:] *= -1
    expected = -1 - np.concatenate([[0], np.cumsum(lengths)])
    nodes = state.node_positions("line")
    # the tension's rounding at slack shifts the fold by 1e-4 N / (EA/l), 1e-8 m at the most
    assert nodes[:, 2] == pytest.approx(expected, abs=1e-7)
    assert np.abs(nodes[:, :2]).max() < 1e-6
    assert sc.Simulator(model, state).tensions("line") == pytest.approx(tensions, abs=1e-3 * weight)
