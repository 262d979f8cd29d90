# SPDX-License-Identifier: Apache-2.0
"""What assumed limits do to the stated intervals."""

from pathlib import Path

import pytest
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_uncertainty.assumption_effects import assumption_effects
from towtank_uncertainty.statement import BoardNoise, default_conditions, trial_budgets

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
AT = default_conditions(RIG)
NOISE = BoardNoise(5e-7, 5e-7, 2e-5)
EFFECTS = {effect.path: effect for effect in assumption_effects(RIG, AT, NOISE)}


@pytest.mark.parametrize(
    "path",
    [
        "sensors.fish_pressure.errors.surge_speed",
        "sensors.depressor_pressure.flow_coefficient",
        "calibrations.accelerometer.alignment_error",
    ],
)
def test_intervals_at_the_ends_are_those_of_a_rig_with_that_figure(path):
    effect = EFFECTS[path]
    for number, end in enumerate(effect.range):
        budgets = trial_budgets(replaced(RIG, {path: end}), AT, NOISE)
        for budget in budgets:
            assert effect.u95[budget.unit][number] == pytest.approx(budget.u95, rel=1e-12)


def test_each_feels_what_concerns_it():
    stated = {budget.unit: budget.u95 for budget in trial_budgets(RIG, AT, NOISE)}
    alignment = EFFECTS["calibrations.accelerometer.alignment_error"].u95
    assert alignment["rad"][0] < stated["rad"] < alignment["rad"][1]
    assert alignment["m"] == pytest.approx((stated["m"],) * 2, rel=1e-12)
    span = EFFECTS["calibrations.fish_pressure.span_error"].u95
    assert span["m"][0] < stated["m"] < span["m"][1]
    assert span["1"][0] < stated["1"] < span["1"][1]
    # The fish's depth knows nothing of the depressor's sensor
    depressor = EFFECTS["calibrations.depressor_pressure.span_error"].u95
    assert depressor["m"] == pytest.approx((stated["m"],) * 2, rel=1e-12)


def test_what_is_no_limit_of_an_error_is_left_out():
    assert "sensors.fish_pressure.position.x" not in EFFECTS
    assert "fish.axial_drag" not in EFFECTS
