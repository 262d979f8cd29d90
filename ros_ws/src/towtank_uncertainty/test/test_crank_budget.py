# SPDX-License-Identifier: Apache-2.0
"""Crank angle and heave of the tow point: known answers, and 95 % of random cranks inside."""

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_rig import load_rig
from towtank_rig.conversion import crank_encoder
from towtank_rig.loading import replaced, vary
from towtank_rig.motion import tow_point_motion
from towtank_uncertainty.crank_budget import CrankBudget
from towtank_uncertainty.error_terms import draw_tolerance

RIGS = Path(__file__).resolve().parents[4] / "hardware" / "rigs"
RIG = load_rig(RIGS / "nit_calicut_2012.yaml")
CALIBRATION = {
    "id": "disc",
    "date": "2026-01-01",
    "counts_per_revolution": 4096,
    "direction": -1,
    "zero_angle": "0.3 rad",
    "zero_angle_error": {"value": "0.012 rad", "distribution": "normal"},
}
CALIBRATED = replaced(RIG, {"calibrations.crank": CALIBRATION})
STEP = 2.0 * math.pi / 4096 / math.sqrt(12.0)


def test_by_hand_at_the_middle_and_the_end_of_the_stroke():
    """A sine of 60 ± 0.5 mm: mid-stroke moves by 60 mm/rad, the end by what the radius does."""
    budget = CrankBudget(CALIBRATED)
    by_radius = 0.5e-3 / math.sqrt(3.0)
    type_b = math.hypot(STEP, 0.012 / 1.959964)
    angle, middle = budget.at(0.0)
    assert angle.type_a == pytest.approx(STEP, rel=1e-6)
    assert angle.type_b == pytest.approx(type_b, rel=1e-6)
    assert angle.u95 == pytest.approx(1.96 * angle.combined, rel=0.01)  # one normal error leads
    assert middle.type_a == pytest.approx(0.06 * STEP, rel=1e-6)
    assert middle.type_b == pytest.approx(0.06 * type_b, rel=1e-6)
    _, end = budget.at(math.pi / 2.0)
    assert end.type_b == pytest.approx(by_radius, rel=1e-6)
    assert end.u95 == pytest.approx(0.95 * 0.5e-3, rel=0.01)  # a limit alone
    _, between = budget.at(math.pi / 4.0 + 20.0 * math.pi)
    half = math.sqrt(0.5)
    assert between.type_b == pytest.approx(half * math.hypot(0.06 * type_b, by_radius), rel=1e-6)


def test_zero_that_is_not_calibrated_has_the_rigs_limit():
    angle, _ = CrankBudget(RIG).at(0.0)
    assert angle.combined == pytest.approx(0.05 / math.sqrt(3.0), rel=1e-3)
    exact = replaced(RIG, {"sensors.crank_encoder.zero_angle_error": "0 rad"})
    known, _ = CrankBudget(exact).at(0.0)
    assert known.combined == pytest.approx(math.sqrt(2.0) * STEP, rel=1e-6)


def test_uncertainty_is_not_known_where_the_angle_is_not():
    for uncertainty in CrankBudget(RIG).at(math.nan):
        assert math.isnan(uncertainty.combined) and math.isnan(uncertainty.u95)


@pytest.mark.parametrize("rig", ["nit_calicut_2012", "wu_chwang_2001", "calibrated"])
def test_95_of_100_random_cranks_lie_inside(rig):
    """Of 1500, whose zero, radius and steps are off by what the rig allows: four standard
    deviations of the count are 2.3 %."""
    rig = CALIBRATED if rig == "calibrated" else load_rig(RIGS / f"{rig}.yaml")
    rng = np.random.default_rng(5)
    budget = CrankBudget(rig)
    encoder = crank_encoder(rig)
    nominal = tow_point_motion(rig.tow_point)
    error = (rig.calibrations.crank or rig.sensors.crank_encoder).zero_angle_error
    inside = np.zeros(2)
    for _ in range(1500):
        # Of the shaft: where it is zeroed within a step, and what it has turned since
        start, turned = rng.uniform(0.0, abs(encoder.per_count)), rng.uniform(0.0, 40.0)
        counts = encoder.counts(start + turned) - encoder.counts(start)
        measured = float(encoder.value(counts))
        angle = turned + draw_tolerance(error, rng, None)
        radius = rng.uniform(*rig.tow_point.motion.crank_radius.range)
        real = tow_point_motion(
            vary(rig, {"tow_point.motion.crank_radius": f"{radius!r} m"}).tow_point
        )
        stated = budget.at(measured)
        read, _ = nominal.heave_of(measured, 0.0)
        true, _ = real.heave_of(angle, 0.0)
        inside += [abs(measured - angle) <= stated[0].u95, abs(read - true) <= stated[1].u95]
    assert inside / 1500 == pytest.approx(0.95, abs=0.023)


def test_budgets_name_what_leads():
    angle, heave = CrankBudget(RIG).budgets()
    assert [line.name for line in angle.lines] == [
        "zero angle",
        "count of one sample",
        "count at the zero",
    ]
    assert all(line.source for line in (*angle.lines, *heave.lines))
    assert heave.lines[0].name == "zero angle" and heave.practice == "crank at 0°"
    assert heave.standard_uncertainty == pytest.approx(0.06 * angle.standard_uncertainty, rel=1e-6)
