# SPDX-License-Identifier: Apache-2.0
"""Trim from weighings: a fish made up of known parts must be found again, and float as wanted."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from towtank_lab.errors import ProcedureError
from towtank_lab.trim import Weighings, evaluate
from towtank_rig.conversion import rotation
from towtank_rig.loading import load_section

EXAMPLE = Path(__file__).parents[4] / "docs" / "laboratory" / "fish_trim.yaml"
DENSITY = 998.0
TOW_POINT = (0.55, 0.01)
# Parts of a fish: mass in kg, displaced mass in kg, x and z in m.
PARTS = ((3.0, 2.2, -0.05, 0.0), (1.2, 2.1, 0.10, 0.03), (0.8, 0.5, -0.20, -0.04))


def pitching_moment(parts, pitch):
    """Moment about the tow point's y axis over gravity, kg m, all forces turned into fish axes."""
    up = rotation(0.0, pitch, 0.0).T @ [0.0, 0.0, 1.0]
    total = 0.0
    for mass, displaced, x, z in parts:
        force = (displaced - mass) * up
        total += (z - TOW_POINT[1]) * force[0] - (x - TOW_POINT[0]) * force[2]
    return total


def resting_pitch(parts):
    """Where the moment passes zero and falls, by bisection over the stable half turn."""
    low, high = -math.pi / 2.0, math.pi / 2.0
    assert pitching_moment(parts, low) * pitching_moment(parts, high) < 0.0
    for _ in range(80):
        middle = (low + high) / 2.0
        if pitching_moment(parts, low) * pitching_moment(parts, middle) <= 0.0:
            high = middle
        else:
            low = middle
    return (low + high) / 2.0


def weigh(parts, tests=((0.8, 0.30, -0.06),), wanted=None):
    """The file that exact weighings of the parts would give."""
    mass = sum(m for m, *_ in parts)
    x_g = sum(m * x for m, _, x, _ in parts) / mass
    apparent = sum(m - b for m, b, *_ in parts)
    moment = sum((m - b) * x for m, b, x, _ in parts)

    def two_scales(total, first_moment):
        fore = (first_moment / 0.4 + total) / 2.0
        return [
            {"x": "0.4 m", "reading": f"{fore!r} kg"},
            {"x": "-0.4 m", "reading": f"{total - fore!r} kg"},
        ]

    inclinations = [
        {
            "apparent_mass": f"{p!r} kg",
            "x": f"{x!r} m",
            "z": f"{z!r} m",
            "pitch": f"{resting_pitch((*parts, (p, 0.0, x, z)))!r} rad",
        }
        for p, x, z in tests
    ]
    data = {
        "name": "parts",
        "water_density": f"{DENSITY} kg/m^3",
        "envelope_volume": "0.012 m^3",
        "tow_point": {"x": f"{TOW_POINT[0]} m", "z": f"{TOW_POINT[1]} m"},
        "in_air": two_scales(mass, mass * x_g),
        "in_water": two_scales(apparent, moment),
        "inclinations": inclinations,
    }
    return Weighings.model_validate(data | ({"wanted": wanted} if wanted else {}))


def test_fish_of_known_parts_is_found_again():
    found = {name: result.value for name, (result, _) in evaluate(weigh(PARTS)).results.items()}
    mass = sum(m for m, *_ in PARTS)
    displaced = sum(b for _, b, *_ in PARTS)
    assert found["mass"] == pytest.approx(mass, rel=1e-12)
    assert found["displaced_volume"] == pytest.approx(displaced / DENSITY, rel=1e-12)
    x_b = sum(b * x for _, b, x, _ in PARTS) / displaced
    assert found["centre_of_buoyancy_x"] == pytest.approx(x_b, rel=1e-9)
    z_moment = sum((m - b) * z for m, b, _, z in PARTS)
    assert found["moment_upwards"] == pytest.approx(z_moment, rel=1e-9)
    filled = mass - displaced + DENSITY * 0.012
    assert found["filled_centre_of_gravity_z"] == pytest.approx(z_moment / filled, rel=1e-9)
    assert found["resting_pitch"] == pytest.approx(resting_pitch(PARTS), abs=1e-9)


@given(
    apparent=st.floats(0.3, 1.0),
    pitch=st.floats(-0.3, 0.3),
    height=st.floats(-0.06, 0.0),
    density=st.sampled_from([7900.0, 2700.0, 11340.0]),
)
def test_ballasted_fish_hangs_as_wanted(apparent, pitch, height, density):
    """The ballast as a further part, and its two halves at the ends of the room, must bring the
    fish to the wanted net mass and pitch: checked by forces, not by the formulas."""
    wanted = {
        "apparent_mass": f"{apparent!r} kg",
        "pitch": f"{pitch!r} rad",
        "density": f"{density} kg/m^3",
        "z": f"{height!r} m",
        "forward": "0.5 m",
        "aft": "-0.5 m",
    }
    ballast = evaluate(weigh(PARTS, wanted=wanted)).ballast
    one = [(ballast.mass.value, ballast.x.value)]
    two = [(ballast.forward_mass.value, 0.5), (ballast.aft_mass.value, -0.5)]
    for pieces in (one, two):
        parts = [*PARTS, *((m, m * DENSITY / density, x, height) for m, x in pieces)]
        assert sum(m - b for m, b, *_ in parts) == pytest.approx(apparent, abs=1e-9)
        limit = math.pi / 2.0
        assume(pitching_moment(parts, -limit) * pitching_moment(parts, limit) < 0.0)
        assert resting_pitch(parts) == pytest.approx(pitch, abs=1e-8)


def test_worked_example():
    """The readings are made up of m = 4.95 kg, w = −0.248 kg, X = −0.0288 kg m, Z = −0.2412 kg m,
    pitch rounded to 1 mrad: Z within its stated interval, steel of
    0.248/(1 − 996.5/7900) = 0.2838 kg at x = 0.0288/0.248."""
    trim = evaluate(load_section(EXAMPLE, Weighings))
    found = {name: result for name, (result, _) in trim.results.items()}
    assert found["mass"].value == pytest.approx(4.95)
    assert abs(found["moment_upwards"].value + 0.2412) < found["moment_upwards"].u95
    assert trim.ballast.mass.value == pytest.approx(0.2838, abs=5e-5)
    assert trim.ballast.x.value == pytest.approx(0.0288 / 0.248, rel=1e-9)
    both = trim.ballast.forward_mass.value + trim.ballast.aft_mass.value
    assert both == pytest.approx(trim.ballast.mass.value, rel=1e-12)
    assert trim.notes == ()


def test_uncertainty_of_the_ballast_is_that_of_the_scales():
    """Two scales of ±2 mg range each: u(w) = 2 g · √2 / √3; the ballast is that over 0.874."""
    trim = evaluate(load_section(EXAMPLE, Weighings))
    scales = 0.002 * math.sqrt(2.0 / 3.0) / (1.0 - 996.5 / 7900.0)
    assert trim.ballast.mass.uncertainty == pytest.approx(scales, rel=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"density": "500 kg/m^3"}, "take one denser than water"),
        ({"apparent_mass": "-1 kg"}, "take one less dense than water"),
    ],
)
def test_ballast_of_the_wrong_kind_is_refused(change, words):
    wanted = {
        "apparent_mass": "0.5 kg", "pitch": "0 rad", "density": "7900 kg/m^3", "z": "0 m",
        "forward": "0.5 m", "aft": "-0.5 m",
    } | change  # fmt: skip
    with pytest.raises(ProcedureError, match=words):
        evaluate(weigh(PARTS, wanted=wanted))


def test_pitch_needs_inclinations():
    wanted = {
        "apparent_mass": "0.5 kg", "pitch": "0.1 rad", "density": "7900 kg/m^3", "z": "0 m",
        "forward": "0.5 m", "aft": "-0.5 m",
    }  # fmt: skip
    with pytest.raises(ProcedureError, match="add inclinations"):
        evaluate(weigh(PARTS, tests=(), wanted=wanted))
