# SPDX-License-Identifier: Apache-2.0
"""What `towtank uncertainty` states: known answers, and first order against Monte Carlo."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_uncertainty.statement import (
    BoardNoise,
    as_json,
    default_conditions,
    statements,
    trial_budgets,
)

RIGS = Path(__file__).resolve().parents[4] / "hardware" / "rigs"
RIG = load_rig(RIGS / "nit_calicut_2012.yaml")
AT = default_conditions(RIG)
NOISE = BoardNoise(5e-7, 5e-7, 2e-5)
DRAWS = 40_000


@pytest.fixture(scope="module", params=["nit_calicut_2012", "wu_chwang_2001"])
def found(request):
    rig = load_rig(RIGS / f"{request.param}.yaml")
    return statements(rig, default_conditions(rig), NOISE, draws=DRAWS)


def effects(budget):
    return {line.name: line.effect for line in budget.lines}


def by_practice(quantity, at=AT):
    return {
        statement.budget.practice: statement.budget
        for statement in statements(RIG, at, NOISE, draws=1000)
        if statement.budget.quantity.startswith(quantity)
    }


def test_depth_out_of_the_box_zeroed_and_calibrated():
    """By hand, k = 1, at 2.2 m: the span's 3.75 % / √3 are 47.6 mm, the offset's 1 mV / √3 are
    74.1 mm, its stability and hysteresis 14.8 mm each, and all vanish by zeroing; a calibration to
    0.5 % (95 %) leaves 5.6 mm. Lesser parts add a little."""
    depth = by_practice("depth")
    box, zeroed, calibrated, towed = depth.values()
    assert list(depth)[:3] == ["data sheet", "data sheet, zeroed", "as calibrated, zeroed"]
    assert math.hypot(47.6, 74.1, 14.8, 14.8) < 1e3 * box.standard_uncertainty < 92
    assert 47.6 < 1e3 * zeroed.standard_uncertainty < 49
    assert 5.6 < 1e3 * calibrated.standard_uncertainty < 6
    assert towed.standard_uncertainty > calibrated.standard_uncertainty
    # One flat error dominates: its 95 % are 1.65 of its standard uncertainties, not 2
    assert zeroed.u95 == pytest.approx(1.7 * zeroed.standard_uncertainty, rel=0.02)
    assert zeroed.lines[0].name == "span"


def test_ratio_by_data_sheet_and_calibrated():
    """Spans of 3.75 % / √3 each make 3.06 % of the ratio; calibrated to 0.5 % (95 %), 0.36 %."""
    ratio = by_practice("heave ratio")
    sheet, calibrated = ratio["data sheet, towed"], ratio["as calibrated, towed"]
    assert 0.0306 < sheet.standard_uncertainty < 0.034
    for sensor in ("fish_pressure", "depressor_pressure"):
        effect = effects(sheet)[f"span, {sensor}"]
        assert effect == pytest.approx(0.0375 / math.sqrt(3), rel=1e-9)
        effect = effects(calibrated)[f"calibrated span, {sensor}"]
        assert effect == pytest.approx(0.005 / 1.96, rel=1e-4)
    assert not any(name.startswith("water density") for name in effects(sheet))  # shared: cancels


def test_pitch_by_data_sheet_and_calibrated():
    """Zero g to 0.1 V / √3 is 0.088 rad, its 95 % with little else 0.95 · √3 of that."""
    pitch = by_practice("pitch")
    sheet, calibrated = pitch["data sheet, at rest"], pitch["as calibrated, at rest"]
    assert math.degrees(sheet.u95) == pytest.approx(8.6, abs=0.3)
    assert math.degrees(calibrated.u95) < 0.7
    assert pitch["as calibrated, crank turning"].u95 > calibrated.u95


def test_monte_carlo_confirms_first_order(found):
    """Standard deviations of 40 000 draws scatter by 0.5 %, ends of an interval by up to 1 % of it;
    what is not linear makes up to 3 % (a pitch that is known to 9 degrees)."""
    for statement in found:
        budget, drawn = statement.budget, statement.monte_carlo
        u = budget.standard_uncertainty
        assert drawn.standard_uncertainty == pytest.approx(u, rel=0.03), budget.practice
        width = (drawn.high - drawn.low) / 2
        assert width == pytest.approx(budget.u95, rel=0.04), budget.practice
        assert abs(drawn.mean) < 0.03 * u, budget.practice


def test_lines_are_ordered_and_sourced(found):
    for statement in found:
        sizes = list(effects(statement.budget).values())
        assert sizes == sorted(sizes, reverse=True) and sizes[-1] > 0.0
        assert all(line.value > 0.0 and line.source for line in statement.budget.lines)
        as_data = as_json(statement)
        assert as_data["standard_uncertainty"] == pytest.approx(math.hypot(*sizes), rel=1e-12)
        assert as_data["expanded_k2"] == 2 * as_data["standard_uncertainty"]


def test_pitch_of_a_pitched_fish_feels_the_sensitivities():
    level, pitched = (
        next(
            s
            for s in statements(RIG, replace(AT, pitch=angle), BoardNoise(), draws=DRAWS)
            if s.budget.practice == "data sheet, at rest" and s.budget.unit == "rad"
        )
        for angle in (0.0, 0.5)
    )
    assert effects(pitched.budget)["sensitivity x"] > 0.02
    assert effects(level.budget).get("sensitivity x", 0.0) < 1e-9
    drawn = pitched.monte_carlo.standard_uncertainty
    assert drawn == pytest.approx(pitched.budget.standard_uncertainty, rel=0.03)


def test_budgets_of_a_trial_are_the_last_of_each_statement():
    """Calibrated, zeroed and under way."""
    last = {s.budget.unit: s.budget for s in statements(RIG, AT, NOISE, draws=1000)}
    assert trial_budgets(RIG, AT, NOISE) == list(last.values())


def test_rig_without_calibrations_is_stated_by_its_data_sheets_alone():
    bare = replaced(RIG, {"calibrations": {}})
    found = [s.budget.practice for s in statements(bare, AT, NOISE, draws=1000)]
    assert len(found) == 6 and all(practice.startswith("data sheet") for practice in found)
