# SPDX-License-Identifier: Apache-2.0
"""Tension by a table over strain, drag by Reynolds number, and the lift of fairings."""

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

import sim_core as sc
from sim_core import _core

LINE = {"length": 2.0, "diameter": 0.01, "mass_per_length": 0.2, "axial_stiffness": 1e4}
ROPE = [(0.0, 0.0), (0.01, 40.0), (0.03, 300.0), (0.05, 900.0)]
FLOW = 1.3  # m/s


def one_segment(end=(0, 0, -2), water=None, **changes):
    """The state of a single segment from 1 m of depth to an end given from there."""
    b = sc.ModelBuilder(water or sc.Water(density=0.0, gravity=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=1.0)
    b.add_line("line", "top", "end", sc.LineProperties(**LINE | changes), segments=1)
    state = sc.State(b.build())
    state.set_point("top", (0, 0, -1))
    state.set_point("end", np.array([0, 0, -1]) + end)
    return state


def tension_at(strain, **changes):
    state = one_segment((0, 0, -2.0 * (1 + strain)), **changes)
    return sc.Simulator(state.model, state).tensions("line")[0]


def test_two_points_of_a_table_are_a_constant_stiffness():
    for strain in (-0.1, 1e-6, 0.02, 0.4):
        table = {"axial_stiffness": [(0.0, 0.0), (0.1, 1e3)], "slack_tension": 0.1}
        constant = {"axial_stiffness": 1e4, "slack_tension": 0.1}
        assert tension_at(strain, **table) == pytest.approx(
            tension_at(strain, **constant), abs=1e-9
        )
        energies = [
            sc.energy(one_segment((0, 0, -2 - 2 * strain), **x)).elastic for x in (table, constant)
        ]
        assert energies[0] == pytest.approx(energies[1], abs=1e-12)


def test_tension_goes_through_the_table_and_rises_everywhere():
    for strain, tension in ROPE[1:]:
        assert tension_at(strain, axial_stiffness=ROPE) == pytest.approx(tension, rel=1e-12)
    strains = np.linspace(0.001, 0.07, 70)
    tensions = [tension_at(e, axial_stiffness=ROPE) for e in strains]
    assert np.diff(tensions).min() > 0.0
    # between two inner points the cubic that others give as well
    expected = PchipInterpolator(*zip(*ROPE, strict=True))(0.02)
    assert tension_at(0.02, axial_stiffness=ROPE) == pytest.approx(float(expected), rel=1e-12)
    # beyond the last point straight on
    slope = (900.0 - 300.0) / 0.02
    assert tension_at(0.06, axial_stiffness=ROPE) == pytest.approx(900.0 + 0.01 * slope, rel=1e-12)


@pytest.mark.parametrize("EI", [0.0, 20.0])
def test_elastic_energy_is_the_work_of_the_tension(EI):
    """Simpson's rule over the rounding at slack (and buckling), the table and beyond it."""
    properties = {"axial_stiffness": ROPE, "slack_tension": 5.0, "bending_stiffness": EI}

    def energy(strain):
        return sc.energy(one_segment((0, 0, -2 - 2 * strain), **properties)).elastic

    strains = np.linspace(-0.02, 0.07, 601)
    tensions = np.array([tension_at(e, **properties) for e in strains])
    h = strains[1] - strains[0]
    work = 2.0 * h / 3 * (tensions[:-2:2] + 4 * tensions[1:-1:2] + tensions[2::2]).sum()
    # slopes of the tension jump where it is rounded and goes on straight, by 4e4 N at most:
    # an error of 2 m h²/12 times that, 1.5e-4 J of 40 J
    assert energy(0.07) - energy(-0.02) == pytest.approx(work, abs=2e-4)
    assert energy(0.0) == pytest.approx(0.0, abs=2.0 * 5.0**2 / (6 * 4000) + 1e-9)


def drag_on_end(direction, **changes):
    """Force of the water on the free end of a segment along z, at rest in a current of FLOW."""
    water = sc.Water(
        gravity=0.0, current=tuple(FLOW * np.array(direction)), kinematic_viscosity=1e-6
    )
    # the rounded tension of an unstrained segment is a quarter of slack_tension
    state = one_segment((0, 0, -2.0), water, slack_tension=1e-13, **changes)
    return _core._residual(state)[:3]


def test_drag_follows_the_reynolds_number():
    """Re = 1.3e4: halfway between the tabulated ones on the logarithm the mean, by symmetry."""
    reynolds = FLOW * 0.01 / 1e-6
    table = [
        (reynolds / 100, 1.0),
        (reynolds / 10, 1.0),
        (reynolds * 10, 0.4),
        (reynolds * 100, 0.4),
    ]
    half = 0.5 * 1000 * 0.01 * 2.0 / 2 * FLOW**2
    across = drag_on_end((1, 0, 0), normal_drag=table)
    assert across == pytest.approx([0.7 * half, 0, 0], rel=1e-9, abs=1e-12)
    along = drag_on_end((0, 0, 1), tangential_drag=table)
    assert along[2] == pytest.approx(0.7 * math.pi * half, rel=1e-9)
    for factor, coefficient in ((1e4, 1.0), (1e-4, 0.4)):  # below and above the table
        moved = [(re * factor, c) for re, c in table]
        force = drag_on_end((1, 0, 0), normal_drag=moved)
        assert force[0] == pytest.approx(coefficient * half, rel=1e-9)


def test_fixed_coefficient_is_a_level_table():
    level = [(1.0, 1.2), (1e6, 1.2)]
    flow = (0.6, 0.5, -0.4)
    expected = drag_on_end(flow, normal_drag=1.2, tangential_drag=1.2)
    assert drag_on_end(flow, normal_drag=level, tangential_drag=level) == pytest.approx(
        expected, rel=1e-12
    )


def test_lift_acts_across_line_and_flow():
    """½ρ Cl d |u_n| t × u_n, t from start to end: here t = −z, and −z × x = −y."""
    half = 0.5 * 1000 * 0.01 * 2.0 / 2
    lift = drag_on_end((1, 0, 0), lift=0.3, normal_drag=0.0)
    assert lift == pytest.approx([0, -0.3 * half * FLOW**2, 0], rel=1e-9, abs=1e-12)
    assert lift[1] == pytest.approx(-drag_on_end((1, 0, 0), lift=-0.3, normal_drag=0.0)[1])
    # turned in the tank, it turns with line and flow
    turned = drag_on_end((0, 1, 0), lift=0.3, normal_drag=0.0)
    assert turned == pytest.approx([0.3 * half * FLOW**2, 0, 0], rel=1e-9, abs=1e-12)
    assert drag_on_end((0, 0, 1), lift=0.3, tangential_drag=0.0)[:2] == pytest.approx([0, 0])


def test_faired_cable_kites():
    """Without end load a cable tows straight: across it, weight, drag and lift balance.

    With u_n the flow across, the weight across is √(Rn² + Rl²)|u_n|², and lift over drag Cl/Cn.
    """
    Cn, Cl, d, m, speed = 0.25, 0.05, 0.02, 0.8, 2.0
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_free_point("end")
    cable = sc.LineProperties(
        length=20.0, diameter=d, mass_per_length=m, axial_stiffness=1e7,
        normal_drag=Cn, lift=Cl, tangential_drag=0.02,
    )  # fmt: skip
    b.add_line("cable", "top", "end", cable, segments=5)
    state = sc.steady_tow(b.build(), position=(0, 0, -1), velocity=(speed, 0, 0))
    spans = np.diff(state.node_positions("cable"), axis=0)
    tangents = spans / np.linalg.norm(spans, axis=1, keepdims=True)
    assert tangents == pytest.approx(np.tile(tangents[0], (5, 1)), abs=1e-6)
    t = tangents[0]
    flow = np.array([-speed, 0, 0])
    across = flow - flow @ t * t
    weight = np.array([0, 0, -(m - 1000 * math.pi / 4 * d * d) * 9.81])
    weight_across = weight - weight @ t * t
    R = 0.5 * 1000 * d * (across @ across)
    assert np.linalg.norm(weight_across) == pytest.approx(math.hypot(Cn, Cl) * R, rel=1e-6)
    unit = across / np.linalg.norm(across)
    assert -weight_across @ unit == pytest.approx(Cn * R, rel=1e-6)
    assert -weight_across @ np.cross(t, unit) == pytest.approx(Cl * R, rel=1e-6)
    assert abs(t[1]) > 0.05, "it tows to one side"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axial_stiffness": [(0.0, 0.0)]}, "axial_stiffness: a table needs at least two points"),
        ({"axial_stiffness": [(0.0, 1.0), (0.1, 2.0)]}, r"must begin with \(0, 0\)"),
        ({"axial_stiffness": [(0, 0), (0.1, 2.0), (0.2, 2.0)]}, "tensions .* must increase"),
        ({"axial_stiffness": [(0, 0), (0.2, 1.0), (0.1, 2.0)]}, "first numbers of a table must"),
        ({"normal_drag": [(0.0, 1.0), (1e4, 1.2)]}, "Reynolds numbers must be above 0"),
        ({"normal_drag": -0.1}, "normal_drag|coefficients must not be below 0"),
        ({"tangential_drag": [(1.0, 1.0), (1e4, -1.2)]}, "coefficients not below"),
        ({"lift": math.nan}, "lift must be finite"),
    ],
)
def test_refuses_impossible_characteristics(change, message):
    with pytest.raises(sc.InvalidInput, match=message):
        one_segment(**change)
