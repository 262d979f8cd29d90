# SPDX-License-Identifier: Apache-2.0
"""Natural frequencies of lumped lines, from the analytic Jacobian of the equations of motion."""

import math

import numpy as np
import pytest
from numpy.polynomial.laguerre import lagroots
from scipy.linalg import eigh

import sim_core as sc
from sim_core import _core


def frequencies(state, direction):
    """ω of the modes along one of the tank axes (uncoupled here), rad/s, ascending."""
    stiffness = -_core._jacobian(state, (1, 0, 0))[direction::3, direction::3]
    mass = -_core._jacobian(state, (0, 0, 1))[direction::3, direction::3]
    return np.sqrt(eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True))


def test_hanging_chain():
    """N equal masses: ω² = (g/ℓ) λ with λ the roots of the Laguerre polynomial L_N."""
    N, spacing, mass = 8, 0.5, 0.3
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=mass / 2)  # the line puts half a segment's mass at its end
    chain = sc.LineProperties(
        length=N * spacing,
        diameter=0.01,
        mass_per_length=mass / spacing,
        axial_stiffness=1e9,  # strains of 2e-8
    )
    b.add_line("chain", "top", "end", chain, segments=N)
    state = sc.steady_tow(b.build(), position=(0, 0, 0))
    expected = np.sqrt(9.81 / spacing * np.sort(lagroots([0] * N + [1])))
    assert frequencies(state, 0) == pytest.approx(expected, rel=1e-6)
    assert frequencies(state, 1) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("density", "added"), [(0.0, 0.0), (1000.0, 0.0), (1000.0, 0.8)])
def test_axial_waves_in_a_hanging_line(density, added):
    """Fixed–free: ω = (2c/ℓ) sin((2k−1)π/4N), c = √(EA/M), M = m + Ca ρ π d²/4 along the line."""
    N, length, EA, m, d = 10, 20.0, 5e4, 0.4, 0.02
    b = sc.ModelBuilder(sc.Water(density=density))
    b.add_prescribed_point("top")
    b.add_free_point("end")
    line = sc.LineProperties(
        length=length, diameter=d, mass_per_length=m, axial_stiffness=EA, slack_tension=1e-3,
        added_mass=1.0, tangential_added_mass=added,
    )  # fmt: skip
    b.add_line("line", "top", "end", line, segments=N)
    state = sc.steady_tow(b.build(), position=(0, 0, -1))
    k = np.arange(1, N + 1)
    mass = m + added * density * math.pi / 4 * d**2
    expected = 2 * math.sqrt(EA / mass) / (length / N) * np.sin((2 * k - 1) * np.pi / (4 * N))
    assert frequencies(state, 2) == pytest.approx(expected, rel=1e-8)


def test_taut_string_in_water():
    """ω = 2 √(T/(ℓ M)) sin(kπ/2N); M: mass and added mass of a segment, ℓ: its stretched length."""
    N, length, stretched, EA, m, d = 8, 4.0, 4.02, 1e4, 0.2, 0.02
    b = sc.ModelBuilder(sc.Water(gravity=0.0))
    b.add_prescribed_point("left")
    b.add_prescribed_point("right")
    line = sc.LineProperties(length=length, diameter=d, mass_per_length=m, axial_stiffness=EA)
    b.add_line("line", "left", "right", line, segments=N)
    ends = {"left": (0, 0, -5), "right": (stretched, 0, -5)}
    state = sc.steady_tow(b.build(), position=ends)
    tension = EA * (stretched / length - 1)
    mass = (m + 1000 * math.pi / 4 * d * d) * length / N
    k = np.arange(1, N)
    expected = 2 * np.sqrt(tension / (stretched / N) / mass) * np.sin(k * np.pi / (2 * N))
    assert frequencies(state, 1) == pytest.approx(expected, rel=1e-8)
    assert frequencies(state, 2) == pytest.approx(expected, rel=1e-8)
