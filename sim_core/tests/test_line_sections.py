# SPDX-License-Identifier: Apache-2.0
"""Lines made of several uniform sections."""

import numpy as np
import pytest

import sim_core as sc

CABLE = {"diameter": 0.01, "mass_per_length": 0.3, "axial_stiffness": 1e4}


def state_of(add, speed=1.0):
    b = sc.ModelBuilder()
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=5.0)
    add(b)
    return sc.steady_tow(b.build(), position=(0, 0, -1), velocity=(speed, 0, 0))


def test_equal_sections_are_one_uniform_line():
    whole = sc.LineProperties(length=6.0, **CABLE)
    part = sc.LineProperties(length=2.0, **CABLE)
    one = state_of(lambda b: b.add_line("line", "top", "end", whole, segments=6))
    three = state_of(lambda b: b.add_line("line", "top", "end", sections=[(part, 2)] * 3))
    # the same equations from another sum of lengths: rounding only
    assert three.node_positions("line") == pytest.approx(one.node_positions("line"), abs=1e-9)


def test_sections_are_lines_joined_at_massless_points():
    heavy = sc.LineProperties(length=2.0, **CABLE | {"mass_per_length": 1.0, "diameter": 0.02})
    light = sc.LineProperties(length=3.0, **CABLE)

    def joined(b):
        b.add_free_point("joint")
        b.add_line("upper", "top", "joint", light, segments=3)
        b.add_line("lower", "joint", "end", heavy, segments=4)

    sections = state_of(
        lambda b: b.add_line("line", "top", "end", sections=[(light, 3), (heavy, 4)])
    )
    lines = state_of(joined)
    expected = np.vstack([lines.node_positions("upper"), lines.node_positions("lower")[1:]])
    assert sections.node_positions("line") == pytest.approx(expected, abs=1e-9)


def test_tension_of_a_hanging_chain_of_sections():
    """At rest each segment carries what hangs below its middle and stretches by its own T ℓ/EA."""
    upper = sc.LineProperties(length=2.0, **CABLE)
    lower = sc.LineProperties(
        length=1.0, diameter=0.02, mass_per_length=2.0, axial_stiffness=500.0, added_mass=0.5
    )
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=1.0)
    b.add_line("line", "top", "end", sections=[(upper, 4), (lower, 2)])
    model = b.build()
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0)))
    weights = 9.81 * np.array([0.15] * 4 + [1.0] * 2)
    below = np.cumsum(weights[::-1])[::-1] - weights / 2 + 9.81
    # relative to the weight of 36 N the Newton tolerance is 1e-8
    assert simulator.tensions("line") == pytest.approx(below, rel=1e-7)
    stretched = np.diff(-simulator.node_positions("line")[:, 2])
    lengths, EA = np.array([0.5] * 6), np.array([1e4] * 4 + [500.0] * 2)
    assert stretched == pytest.approx(lengths * (1 + below / EA), rel=1e-7)


def test_faults_name_the_section():
    b = sc.ModelBuilder()
    b.add_prescribed_point("top")
    b.add_free_point("end")
    good = sc.LineProperties(length=1.0, **CABLE)
    bad = sc.LineProperties(length=1.0, **CABLE | {"diameter": 0.0})
    with pytest.raises(sc.InvalidInput, match="line 'l' section 2: diameter must be above 0"):
        b.add_line("l", "top", "end", sections=[(good, 1), (bad, 1)])
    with pytest.raises(sc.InvalidInput, match="at least one section"):
        b.add_line("l", "top", "end", sections=[])
