# SPDX-License-Identifier: Apache-2.0
"""Calibrations from synthetic readings: known coefficients are found within their intervals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_lab.accelerometer_calibration import (
    SIX_POSITIONS,
    Position,
    calibrate_accelerometer,
    specific_force,
)
from towtank_lab.crank_calibration import Mark, calibrate_crank
from towtank_lab.errors import ProcedureError
from towtank_lab.least_squares import fit
from towtank_lab.pressure_calibration import Immersion, calibrate_pressure
from towtank_rig import load_rig
from towtank_rig.conversion import rotation
from towtank_rig.loading import replaced
from towtank_rig.motion import tow_point_motion

RIGS = Path(__file__).parents[4] / "hardware" / "rigs"
RIG = load_rig(RIGS / "nit_calicut_2012.yaml")
WEIGHT = RIG.water.density.value * RIG.water.gravity.value  # Pa/m
FULL_SCALE = RIG.sensors.fish_pressure.full_scale.value
STAIRS = (0.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5, 0.0)
G = RIG.water.gravity.value


def immersions(span, offset, depth_errors=None, up=0.0, bend=0.0):
    """Readings of a sensor; `up`: volts more on the way up; `bend`: V of a parabola at 2 m."""
    errors = np.zeros(len(STAIRS)) if depth_errors is None else depth_errors
    found = []
    for number, (depth, error) in enumerate(zip(STAIRS, errors, strict=True)):
        part = WEIGHT * (depth + error) / FULL_SCALE
        volts = offset + span * part + bend * (depth / 2.0) ** 2
        found.append(Immersion(depth, volts + (up if number > 4 and depth > 0 else 0.0)))
    return found


def pressure(readings, **limits):
    given = {"tape_limit": 0.0, "zero_limit": 0.0} | limits
    return calibrate_pressure(RIG, "fish_pressure", readings, **given)


@given(span=st.floats(0.03, 0.05), offset=st.floats(-2e-3, 2e-3))
def test_exact_immersions_give_the_line_back(span, offset):
    found = pressure(immersions(span, offset))
    assert found.span.value == pytest.approx(span, rel=1e-12)
    assert found.offset.value == pytest.approx(offset, abs=1e-14)
    assert found.hysteresis == pytest.approx(0.0, abs=1e-12)


def test_other_excitation_is_brought_to_the_reference():
    """At 5 V the bridge gives half; the span is stated at 10 V."""
    rig = replaced(RIG, {"board.excitation": 5.0})
    halved = [Immersion(i.depth, i.volts / 2.0) for i in immersions(0.0396, 1e-4)]
    found = calibrate_pressure(rig, "fish_pressure", halved, tape_limit=0.0, zero_limit=0.0)
    assert found.span.value == pytest.approx(0.0396, rel=1e-12)
    assert found.offset.value == pytest.approx(1e-4, rel=1e-9)


def test_pressure_intervals_cover_the_truth():
    """1000 calibrations with depths read to 1 mm (standard deviation), each with an own tape, water
    and gravity within their limits: 95 % of the spans lie in their intervals. A binomial count's
    four standard deviations are 2.8 %; even distributions have shorter tails than the normal, so
    coverage may lie above."""
    rng = np.random.default_rng(3)
    span, inside = 0.0396, 0
    low, high = RIG.water.density.range
    for _ in range(1000):
        scale = (1.0 + rng.uniform(-1e-3, 1e-3)) * rng.uniform(low, high)
        scale *= rng.uniform(*RIG.water.gravity.range) / WEIGHT
        readings = immersions(span * scale, 1e-4, rng.normal(0.0, 1e-3, len(STAIRS)))
        found = pressure(readings, tape_limit=1e-3)
        inside += abs(found.span.value - span) <= found.span.u95
    assert 0.95 - 0.028 <= inside / 1000 <= 0.99


def test_hysteresis_and_bend_are_told_apart_from_the_line():
    """40 µV more on the way up is 1e-3 of the span of 40 mV; a parabola c x² leaves its chord by
    c x²/4, a quarter of what it makes at the end. Both tilt the line, whose slope they are parts
    of: by 40 µV, and by 80 µV over the 15.6 mV at 2 m."""
    loop = pressure(immersions(0.04, 0.0, up=40e-6))
    assert loop.hysteresis == pytest.approx(1e-3, rel=1e-3)
    bent = pressure(immersions(0.04, 0.0, bend=80e-6))
    assert bent.bend == pytest.approx(20e-6 / 0.04, rel=5.2e-3)
    assert bent.bend_is_real
    scattered = pressure(immersions(0.04, 0.0, np.random.default_rng(1).normal(0, 1e-3, 9)))
    assert not scattered.bend_is_real


@pytest.mark.parametrize(
    ("readings", "words"),
    [
        (immersions(0.04, 0.0)[:4], "4 immersions at 4 depths"),
        ([Immersion(1.0, 0.01 + 1e-6 * i) for i in range(9)], "9 immersions at 1 depths"),
        ([Immersion(i.depth, -i.volts) for i in immersions(0.04, 0.0)], "volts fall with depth"),
        ([Immersion(-i.depth, i.volts) for i in immersions(0.04, 0.0)], "above the water"),
    ],
)
def test_immersions_that_carry_no_line_are_refused(readings, words):
    with pytest.raises(ProcedureError, match=words):
        pressure(readings)


def positions(zero, sensitivity, misalignment, attitudes, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    found = []
    for roll, pitch in attitudes:
        force = (np.eye(3) + misalignment) @ specific_force(roll, pitch, G)
        volts = np.asarray(zero) + np.asarray(sensitivity) * force
        found.append(Position(roll, pitch, tuple(volts + rng.normal(0.0, noise, 3))))
    return found


SIX = [(math.radians(r), math.radians(p)) for r, p in SIX_POSITIONS.values()]
ZERO, SENSITIVITY = (1.66, 1.64, 1.655), (0.0668, 0.0679, 0.0671)


def test_six_positions_point_where_their_names_say():
    for name, (roll, pitch) in SIX_POSITIONS.items():
        force = specific_force(math.radians(roll), math.radians(pitch), 1.0)
        expected = np.zeros(3)
        expected["xyz".index(name[0])] = 1.0 if " up " in f"{name[1:]} " else -1.0
        assert force == pytest.approx(expected, abs=1e-12), name


@given(
    turned=st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    coupling=st.floats(-0.02, 0.02),
    seed=st.integers(0, 2**31),
)
def test_exact_positions_give_the_sensor_back(turned, coupling, seed):
    """Six positions and any others: zeros, sensitivities and directions of the axes."""
    x, y, z = turned
    misalignment = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]]) + coupling * (1 - np.eye(3))
    tilts = np.random.default_rng(seed).uniform(-1.5, 1.5, (4, 2))
    found = calibrate_accelerometer(
        RIG, positions(ZERO, SENSITIVITY, misalignment, [*SIX, *tilts]), level_limit=0.0
    )
    assert [e.value for e in found.zero_g] == pytest.approx(ZERO, rel=1e-10)
    assert [e.value for e in found.sensitivity] == pytest.approx(SENSITIVITY, rel=1e-10)
    assert found.misalignment == pytest.approx(misalignment, abs=1e-10)
    assert found.rotation == pytest.approx(turned, abs=1e-10)


def test_accelerometer_intervals_cover_the_truth():
    """200 calibrations with 1 mV of scatter a reading, three straight axes each: 95 % of zeros and
    sensitivities inside, four standard deviations of 600 counts are 3.6 %."""
    rig = replaced(RIG, {"sensors.accelerometer.errors.nonlinearity": 0.0})
    inside = np.zeros(2)
    for seed in range(200):
        found = calibrate_accelerometer(
            rig,
            positions(ZERO, SENSITIVITY, np.zeros((3, 3)), SIX, noise=1e-3, seed=seed),
            level_limit=0.0,
        )
        for index, (estimates, truth) in enumerate(
            ((found.zero_g, ZERO), (found.sensitivity, SENSITIVITY))
        ):
            inside[index] += sum(
                abs(e.value - t) <= e.u95 for e, t in zip(estimates, truth, strict=True)
            )
    assert inside / 600 == pytest.approx(0.95, abs=0.036)


def on_a_table(lean, level_limit):
    """Calibration on a table that leans by angles along x and y, rad, with ideal axes."""
    up = np.array([*lean, 1.0]) * G
    volts = [np.array(ZERO) + SENSITIVITY * (up @ rotation(*a, 0.0)) for a in SIX]
    taken = [Position(*attitude, tuple(v)) for attitude, v in zip(SIX, volts, strict=True)]
    return calibrate_accelerometer(RIG, taken, level_limit=level_limit)


def test_table_out_of_level_is_within_the_limit():
    """By 0.2° both ways, stated as at most 0.3°."""
    found = on_a_table(np.radians([0.2, -0.2]), level_limit=math.radians(0.3))
    for estimate, truth in zip(found.zero_g, ZERO, strict=True):
        assert abs(estimate.value - truth) <= estimate.u95
    assert np.abs(found.rotation).max() <= found.rotation_error


@pytest.mark.parametrize(
    ("along", "zeros", "level"),
    [(0, (4 / 6, 0.0, 0.0), (2 / 3, 0.0, 0.0)), (1, (0.0, 2 / 6, 0.0), (0.0, 4 / 3, 0.0))],
)
def test_shares_of_a_lean_are_those_derived(along, zeros, level):
    """On the zeros, and on what a level fish then reads: as found, and as stated."""
    lean = math.radians(0.1)
    found = on_a_table(lean * np.eye(2)[along], level_limit=0.0)
    moved = (np.array([e.value for e in found.zero_g]) - ZERO) / SENSITIVITY / G / lean
    assert moved == pytest.approx(zeros, abs=1e-3)
    felt = moved + found.misalignment[:, 2] / lean
    assert felt[:2] == pytest.approx(level[:2], abs=1e-3)
    # Both leans at once, and no bend: each axis has the share of its own
    straight = replaced(RIG, {"sensors.accelerometer.errors.nonlinearity": 0.0})
    taken = positions(ZERO, SENSITIVITY, np.zeros((3, 3)), SIX)
    stated = calibrate_accelerometer(straight, taken, level_limit=lean)
    per_limit = 1.959964 / math.sqrt(3.0) * SENSITIVITY[along] * G * lean
    assert stated.zero_g[along].u95 / per_limit == pytest.approx(zeros[along], rel=1e-6)
    assert stated.level_error[along] / per_limit == pytest.approx(level[along], rel=1e-6)
    assert stated.alignment_error < 1e-9


def test_bend_and_lean_are_no_scatter():
    """Axes that bend by up to 0.05 m/s² at 1 g (3.4 mV) and a table that leans by 0.2° (2 mV): a
    scatter of 0.1 mV is found again."""
    rng = np.random.default_rng(4)
    up = np.array([0.003, -0.002, 1.0]) * G
    taken = []
    for attitude in [*SIX, *SIX[:2]]:
        force = up @ rotation(*attitude, 0.0)
        felt = force + np.array([0.05, -0.03, 0.0]) * np.square(force / 9.80665)
        volts = np.array(ZERO) + SENSITIVITY * felt + rng.normal(0.0, 1e-4, 3)
        taken.append(Position(*attitude, tuple(volts)))
    found = calibrate_accelerometer(RIG, taken, level_limit=math.radians(0.3))
    assert all(fit.scatter < 2e-4 and fit.freedom == 8 for fit in found.fits)
    for estimate, truth in zip(found.zero_g, ZERO, strict=True):
        assert abs(estimate.value - truth) <= estimate.u95


def test_exchanged_channels_are_noticed():
    taken = positions(ZERO, SENSITIVITY, np.zeros((3, 3)), SIX)
    exchanged = [Position(p.roll, p.pitch, (p.volts[1], p.volts[0], p.volts[2])) for p in taken]
    with pytest.raises(ProcedureError, match="axis x does not point"):
        calibrate_accelerometer(RIG, exchanged, level_limit=0.0)


ANGLES = np.radians(np.arange(0.0, 721.0, 90.0))


def marks(counts_per_turn, start=0.0, heights=None, errors=None):
    errors = np.zeros(len(ANGLES)) if errors is None else errors
    return [
        Mark(
            float(angle),
            math.floor(start + counts_per_turn * (angle + error) / (2.0 * math.pi)),
            None if heights is None else float(heights[i]),
        )
        for i, (angle, error) in enumerate(zip(ANGLES, errors, strict=True))
    ]


@given(counts=st.integers(100, 10_000), direction=st.sampled_from([1, -1]), start=st.floats(0, 1e6))
def test_marks_give_counts_and_direction(counts, direction, start):
    found = calibrate_crank(RIG, marks(direction * counts, start), mark_limit=0.0)
    assert found.direction == direction
    # Each count is cut off by less than one: over two turns half a count a turn
    assert abs(found.counts_per_turn.value) == pytest.approx(counts, abs=0.5)


def test_stated_counts_stay_where_the_marks_allow_them():
    """Marks to 0.1° leave ±2 counts a turn open; the maker's 4096 lies within."""
    rng = np.random.default_rng(2)
    for counts, taken in ((4096, 4096), (4000, None)):
        found = calibrate_crank(
            RIG, marks(counts, errors=rng.normal(0.0, 0.0017, len(ANGLES))), mark_limit=0.0
        )
        assert found.counts_per_revolution == (taken or round(found.counts_per_turn.value))
        assert abs(found.counts_per_turn.value - counts) < found.counts_per_turn.u95


@pytest.mark.parametrize("rig", ["nit_calicut_2012", "wu_chwang_2001"])
@settings(max_examples=10)
@given(zero=st.floats(-3.0, 3.0), scale=st.floats(0.8, 1.2))
def test_heights_give_the_angle_at_mark_0(rig, zero, scale):
    """Sine and slider crank."""
    chosen = load_rig(RIGS / f"{rig}.yaml")
    heights = 0.8 + scale * tow_point_motion(chosen.tow_point).heave(ANGLES + zero)
    # 90° marks of a sine are three equations for three unknowns, twice over
    found = calibrate_crank(chosen, marks(4096, heights=heights), mark_limit=0.0)
    assert math.remainder(found.zero_angle.value - zero, 2 * math.pi) == pytest.approx(0, abs=1e-5)
    nominal = chosen.tow_point.motion.crank_radius.value
    assert found.radius.value == pytest.approx(scale * nominal, rel=1e-5)


def test_marks_that_carry_nothing_are_refused():
    with pytest.raises(ProcedureError, match=r"4 marks over 0\.75 turns"):
        calibrate_crank(RIG, marks(4096)[:4], mark_limit=0.0)
    with pytest.raises(ProcedureError, match="do not move"):
        calibrate_crank(RIG, marks(0), mark_limit=0.0)


def test_covariance_is_that_of_the_textbook():
    """A line through x = 0, 1, 2, 3: var(slope) = s²/Σ(x − x̄)² = s²/5, var(offset) = 0.7 s²,
    cov = −0.3 s²."""
    x = np.arange(4.0)
    found = fit(np.column_stack((np.ones(4), x)), [0.0, 1.0, 2.0, 3.4])
    s2 = found.scatter**2
    assert found.covariance == pytest.approx(s2 * np.array([[0.7, -0.3], [-0.3, 0.2]]), rel=1e-9)
    with pytest.raises(ProcedureError, match="too close together"):
        fit(np.column_stack((np.ones(4), 1.0 + 1e-9 * x)), x)
    with pytest.raises(ProcedureError, match="2 readings for 2 coefficients"):
        fit(np.column_stack((np.ones(2), x[:2])), x[:2])
