# SPDX-License-Identifier: Apache-2.0
"""Bending of lines by torsion springs: cantilevers, elastica, rings, and its energy."""

import math

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

VACUUM = sc.Water(density=0.0)
WATER = sc.Water(density=1000.0)
ROOT = (0.0, 0.0, -5.0)


def strip(length, EI, **changes):
    """A line as heavy as water, without drag: only what it carries bends it."""
    values = {
        "diameter": 1e-3,
        "mass_per_length": 0.05,
        "axial_stiffness": 1e5,
        "displaced_area": 0.05 / 1000.0,
        "normal_drag": 0.0,
        "tangential_drag": 0.0,
        "added_mass": 0.0,
        "bending_stiffness": EI,
        "slack_tension": 1e-4,
    }
    return sc.LineProperties(length=length, **values | changes)


def straight(model, length, segments):
    state = sc.State(model)
    for i in range(1, segments):
        state.set_line_node("beam", i, (length * i / segments, 0, 0))
    state.set_point("tip", (length, 0, 0))
    return state


@pytest.mark.parametrize("segments", [1, 2, 7, 40])
def test_cantilever(segments):
    """δ = (P L³/3EI) (1 + 1/(2N²)), in both planes, from the stiffness of the straight line."""
    length, EI = 2.0, 3.0
    b = sc.ModelBuilder(VACUUM)
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=1.0)
    b.add_line(
        "beam", "root", "tip", strip(length, EI), segments=segments, start_direction=(2, 0, 0)
    )
    model = b.build()
    stiffness = -_core._jacobian(straight(model, length, segments), (1, 0, 0))
    expected = length**3 / (3 * EI) * (1 + 1 / (2 * segments**2))
    for direction in (1, 2):
        load = np.zeros(model.unknowns)
        load[direction] = 1.0  # the tip is the first unknown
        # a segment without strain carries less than the slack tension: rounding of EA times 1e-16
        assert np.linalg.solve(stiffness, load)[direction] == pytest.approx(expected, rel=1e-8)


def test_clamped_at_the_far_end_alike():
    """The same beam drawn from its free end: the direction is still from start to end."""
    b = sc.ModelBuilder(VACUUM)
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=1.0)
    b.add_line("beam", "tip", "root", strip(2.0, 3.0), segments=5, end_direction=(-1, 0, 0))
    model = b.build()
    state = sc.State(model)
    for i in range(1, 5):
        state.set_line_node("beam", i, (2.0 - 0.4 * i, 0, 0))
    state.set_point("tip", (2.0, 0, 0))
    load = np.zeros(model.unknowns)
    load[2] = 1.0
    deflection = np.linalg.solve(-_core._jacobian(state, (1, 0, 0)), load)[2]
    assert deflection == pytest.approx(8.0 / 9.0 * (1 + 1 / 50), rel=1e-8)


def test_cantilever_of_two_sections():
    """Moment-area: δ = P/3 ((L³ − b³)/EI₁ + b³/EI₂) with EI₂ in the outer b, at order 2."""
    length, outer, root_EI, tip_EI = 2.0, 0.8, 3.0, 0.7
    expected = ((length**3 - outer**3) / root_EI + outer**3 / tip_EI) / 3
    errors = []
    for n in (5, 10):
        b = sc.ModelBuilder(VACUUM)
        b.add_prescribed_point("root")
        b.add_free_point("tip", mass=1.0)
        sections = [(strip(length - outer, root_EI), 3 * n), (strip(outer, tip_EI), 2 * n)]
        b.add_line("beam", "root", "tip", sections=sections, start_direction=(1, 0, 0))
        model = b.build()
        load = np.zeros(model.unknowns)
        load[2] = 1.0
        state = straight(model, length, 5 * n)
        solution = np.linalg.solve(-_core._jacobian(state, (1, 0, 0)), load)
        errors.append(abs(solution[2] - expected))
    assert errors[0] < 2e-3 * expected  # 1/(2N²) of the 15 to 25 segments
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(("load", "deflection"), [(1.0, 0.30172), (10.0, 0.81061)])
def test_elastica(load, deflection):
    """Bisshopp & Drucker (1945): a vertical end force P on a level cantilever, P L²/EI = load."""
    length, segments = 1.0, 40
    mass = 0.5
    EI = mass * 9.81 * length**2 / load
    b = sc.ModelBuilder(WATER)
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=mass)
    b.add_line(
        "beam", "root", "tip", strip(length, EI), segments=segments, start_direction=(1, 0, 0)
    )
    state = sc.steady_tow(b.build(), position=ROOT)
    assert ROOT[2] - state.point_position("tip")[2] == pytest.approx(deflection * length, rel=1e-3)


def ring(N, length):
    """Nodes of the closed polygon that a straight beam of N segments takes under the end moment
    2πEI/L: half the angle at the root, so that the first segment points π/N above its direction."""
    angles = (2 * np.arange(N) + 1) * np.pi / N
    steps = length / N * np.column_stack([np.cos(angles), np.zeros(N), np.sin(angles)])
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def test_end_moment_closes_a_circle():
    """A body at the end of a beam, as heavy as water and heavy aft, so that level it pitches up
    with the moment 2πEI/L. Let go from 0.97 of a turn it comes to rest in a full one (φ = 2π cos φ
    holds at 1.9π too, unstably; from below, the beam unwinds)."""
    N, length, EI = 40, 2.0, 0.5
    moment = 2 * np.pi * EI / length
    mass = 1.0
    body = sc.Body(
        mass=mass, inertia=(0.05, 0.05, 0.05), volume=mass / 1000, diameter=0.05, length=0.3,
        centre_of_gravity=(-moment / (mass * 9.81), 0, 0), axial_drag=0.0, cross_flow_drag=0.0,
    )  # fmt: skip
    b = sc.ModelBuilder(WATER)
    b.add_prescribed_point("root")
    b.add_body("weight", body)
    b.add_line(
        "beam", "root", "weight", strip(length, EI), segments=N, attachment=(0, 0, 0),
        start_direction=(1, 0, 0), end_direction=(1, 0, 0),
    )  # fmt: skip
    model = b.build()
    state = sc.State(model)
    root = np.array(ROOT)
    state.set_point("root", root)
    turn = 0.97
    angles = turn * (2 * np.arange(N) + 1) * np.pi / N
    steps = length / N * np.column_stack([np.cos(angles), np.zeros(N), np.sin(angles)])
    nodes = root + np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    for i in range(1, N):
        state.set_line_node("beam", i, nodes[i])
    pitch = -turn * 2 * np.pi  # about y: nose up is negative
    state.set_body("weight", nodes[N], (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0))
    simulator = sc.Simulator(model, state, integrator=sc.BackwardEuler(), max_step=0.5)
    simulator.step(150.0, sc.SteadyTow(position=root))
    assert simulator.node_positions("beam") == pytest.approx(root + ring(N, length), abs=1e-3)
    energy = sc.energy(simulator.state).bending
    assert energy == pytest.approx(0.5 * moment * 2 * np.pi, rel=1e-3)


def test_ring_of_two_lines_is_a_closed_loop():
    """Two arcs from a held point, which they leave to both sides, to a weight: bending opens the
    loop, compresses its top, and couples next-but-one neighbours all around it."""
    b = sc.ModelBuilder(VACUUM)
    b.add_prescribed_point("top")
    b.add_free_point("bottom", mass=0.2)
    hoop = strip(1.0, 0.2)
    b.add_line("left", "top", "bottom", hoop, segments=10, start_direction=(-1, 0, 0))
    b.add_line("right", "top", "bottom", hoop, segments=10, start_direction=(1, 0, 0))
    state = sc.steady_tow(b.build(), position=(0, 0, 0))
    left, right = state.node_positions("left"), state.node_positions("right")
    assert left * [-1, 1, 1] == pytest.approx(right, abs=1e-7)
    assert np.ptp(right[:, 0]) > 0.1
    assert state.point_position("bottom")[2] > -0.99


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.0199, 0.0201, 1.0, 3.0, 3.141])
def test_moment_at_any_angle(angle):
    """The couple of an inner spring is EI/ℓ θ, from the straight line to a line folded back."""
    EI, spacing = 0.8, 0.5
    b = sc.ModelBuilder(sc.Water(density=0.0, gravity=0.0))
    b.add_prescribed_point("root")
    b.add_free_point("tip")
    b.add_line("beam", "root", "tip", strip(2 * spacing, EI), segments=2)
    state = sc.State(b.build())
    state.set_line_node("beam", 1, (spacing, 0, 0))
    end = (spacing * (1 + math.cos(angle)), 0, spacing * math.sin(angle))
    state.set_point("tip", end)
    force = _core._residual(state)[:3]
    expected = EI / spacing * angle / spacing
    # the rounding of EA, 1e5 N times strains of 1e-16
    assert force == pytest.approx(
        expected * np.array([math.sin(angle), 0, -math.cos(angle)]), abs=1e-9
    )
    assert sc.energy(state).bending == pytest.approx(0.5 * EI / spacing * angle**2, rel=1e-7)


def test_energy_is_conserved_while_a_stiff_line_swings():
    """Bending takes part in the balance: a beam let go from the horizontal in vacuum."""
    segments, length = 6, 1.0
    b = sc.ModelBuilder(VACUUM)
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=0.2)
    beam = sc.LineProperties(
        length=length, diameter=0.01, mass_per_length=0.3, axial_stiffness=2000.0,
        bending_stiffness=0.5,
    )  # fmt: skip
    b.add_line("beam", "root", "tip", beam, segments=segments, start_direction=(1, 0, 0))
    model = b.build()
    simulator = sc.Simulator(
        model,
        straight(model, length, segments),
        integrator=sc.GeneralizedAlpha(rho_inf=1.0),
        max_step=0.0005,
        newton_tolerance=1e-12,
    )
    start = sc.energy(simulator.state)
    bent, drift = [], []
    for i in range(1, 51):
        simulator.step(0.01 * i, sc.SteadyTow(position=(0, 0, 0)))
        now = sc.energy(simulator.state)
        bent.append(now.bending)
        drift.append(now.total - start.total)
    assert max(bent) > 0.5
    # trapezoidal rule: (ω h)²/12 of the axial part, ω = 2 √(EA/m)/ℓ of the stiffest mode: 0.06 %
    assert np.abs(drift).max() < 1e-3 * max(bent)


def test_buckles_between_its_nodes():
    """A compressed segment carries its Euler load π²EI/ℓ² and no more, a limp one nothing."""
    for EI in (0.0, 0.02):
        b = sc.ModelBuilder(WATER)
        b.add_prescribed_point("root")
        b.add_free_point("tip", mass=1.0)
        b.add_line("beam", "root", "tip", strip(0.5, EI), segments=1)
        model = b.build()
        state = sc.State(model)
        state.set_point("tip", (0.4, 0, 0))  # strain −0.2
        assert sc.Simulator(model, state).tensions("beam") == pytest.approx(
            -(np.pi**2) * EI / 0.25, abs=1e-12
        )


def test_limp_lines_cost_and_couple_nothing():
    """Without EI the Jacobian has no coupling of next-but-one neighbours."""

    def couplings(EI):
        b = sc.ModelBuilder(VACUUM)
        b.add_prescribed_point("root")
        b.add_free_point("tip", mass=1.0)
        b.add_line("beam", "root", "tip", strip(1.0, EI), segments=6)
        state = sc.steady_tow(b.build(), position=ROOT)
        J = _core._jacobian(state, (1, 1, 1))
        return J[3:6, 9:12]  # nodes 1 and 3

    assert np.abs(couplings(0.0)).max() == 0.0
    assert np.abs(couplings(0.1)).max() > 0.0


def test_refuses_clamps_that_hold_nothing():
    b = sc.ModelBuilder()
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=1.0)
    with pytest.raises(sc.InvalidInput, match="start_direction clamps the end, which takes a bend"):
        b.add_line("l", "root", "tip", strip(1.0, 0.0), segments=2, start_direction=(1, 0, 0))
    with pytest.raises(sc.InvalidInput, match="end_direction is only for an end at a prescribed"):
        b.add_line("l", "root", "tip", strip(1.0, 1.0), segments=2, end_direction=(1, 0, 0))
    with pytest.raises(sc.InvalidInput, match="start_direction must be finite and not zero"):
        b.add_line("l", "root", "tip", strip(1.0, 1.0), segments=2, start_direction=(0, 0, 0))
    with pytest.raises(sc.InvalidInput, match="bending_stiffness"):
        b.add_line("l", "root", "tip", strip(1.0, -1.0), segments=2)
