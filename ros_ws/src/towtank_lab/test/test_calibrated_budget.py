# SPDX-License-Identifier: Apache-2.0
"""Depths read with a calibrated sensor lie in the intervals that the rig's budget then states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from towtank_lab.pressure_calibration import Immersion, calibrate_pressure, section
from towtank_rig import load_rig
from towtank_rig.conversion import depth_from_pressure, pressure_conversion, pressure_from_depth
from towtank_rig.loading import replaced, vary
from towtank_rig.quantity import NORMAL_95
from towtank_uncertainty import sensor_errors
from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget

RIG = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
BARE = replaced(RIG, {"calibrations": {}})
STAIRS = (0.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5, 0.0)
# The calibration's day: another temperature than the trial's is an error of the trial.
SINCE = ("span over temperature", "hysteresis")
TRIALS = 300


def _read(sensor, depth, drift=0.0):
    return float(sensor.volts(pressure_from_depth(depth, RIG.water), drift=drift))


def _calibrated(sensor, rng):
    """The rig with the sensor calibrated in the tank, at marks read to 1 mm."""
    immersions = [
        Immersion(depth, _read(sensor, max(depth + rng.normal(0.0, 1e-3), 0.0))) for depth in STAIRS
    ]
    result = calibrate_pressure(BARE, "fish_pressure", immersions, tape_limit=5e-4, zero_limit=2e-3)
    found = section(result, len(immersions))
    return vary(RIG, {f"calibrations.fish_pressure.{key}": value for key, value in found.items()})


def _depth(rig, volts):
    pressure = pressure_conversion(rig, "fish_pressure").pressure(volts)
    return float(depth_from_pressure(pressure, rig.water))


@pytest.fixture(scope="module")
def normalised():
    """Error over stated standard uncertainty, of zeroed depths at random places, one a sensor.

    Each sensor has errors drawn from the data sheet's budget, and is used in the tank where it was
    calibrated: with the same density and gravity.
    """
    found = []
    for seed in range(TRIALS):
        rng = np.random.default_rng(seed)
        terms = sensor_errors.draw(BARE, seed).terms
        on_the_day = {key: x for key, x in terms.items() if key.partition("/")[2] not in SINCE}
        before, later = (
            sensor_errors.realise(BARE, t, BARE.board.excitation.value, 0.0).fish_pressure
            for t in (on_the_day, terms)
        )
        rig = _calibrated(before, rng)
        depth = rng.uniform(0.3, 2.0)
        error = _depth(rig, _read(later, depth, 1.0)) - _depth(rig, _read(later, 0.0)) - depth
        budget = depth_budget(rig, "fish_pressure", OperatingPoint(depth, 0.05, 0.0))
        found.append(error / budget.depth)
    return np.array(found)


def test_stated_intervals_cover_the_depths(normalised):
    """A binomial count's four standard deviations are 5 %. Coverage may lie above 95 %: density and
    gravity, which the budget holds, cancel; linearity is given at its limit."""
    inside = np.mean(np.abs(normalised) <= NORMAL_95)
    assert inside >= 0.95 - 0.05


def test_stated_intervals_are_not_idle(normalised):
    """An interval three times too wide would be no statement."""
    assert np.sqrt(np.mean(normalised**2)) > 1.0 / 3.0
