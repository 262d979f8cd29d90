# SPDX-License-Identifier: Apache-2.0
"""Pitch and roll read with a calibrated accelerometer scatter as the rig's budget then states."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_lab.accelerometer_calibration import (
    SIX_POSITIONS,
    Position,
    calibrate_accelerometer,
    section,
    specific_force,
)
from towtank_rig import load_rig
from towtank_rig.conversion import accelerometer_conversion, pitch, roll, rotation
from towtank_rig.loading import replaced
from towtank_uncertainty import sensor_errors
from towtank_uncertainty.inclination_budget import inclination_budget

pytestmark = pytest.mark.slow

RIG = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
BARE = replaced(RIG, {"calibrations": {}})
SIX = [(math.radians(r), math.radians(p)) for r, p in SIX_POSITIONS.values()]
LEVEL = math.radians(0.3)
TRIALS = 200
ATTITUDES = ((0.0, 0.0), (0.2, 0.0), (-0.2, 0.1))  # pitch and roll, rad


def _calibrated(sensor, rng):
    """The rig with the sensor calibrated on a table that leans, the first positions twice."""
    table = rotation(rng.uniform(-LEVEL, LEVEL), rng.uniform(-LEVEL, LEVEL), 0.0)
    up = table.T @ (0.0, 0.0, RIG.water.gravity.value)
    positions = [
        Position(r, p, tuple(sensor.volts(rotation(r, p, 0.0).T @ up) + rng.normal(0.0, 2e-4, 3)))
        for r, p in [*SIX, *SIX[:2]]
    ]
    result = calibrate_accelerometer(BARE, positions, level_limit=LEVEL)
    found = {"id": "test", "date": "2026-01-01", **section(result, len(positions))}
    return replaced(RIG, {"calibrations.accelerometer": found})


@pytest.fixture(scope="module")
def readings():
    """Errors over stated standard uncertainties, and whether they lie in the intervals: pitch and
    roll at the attitudes, shapes (trials, attitudes, 2).

    Each sensor has errors drawn from the data sheet's budget, which is that of the conversion too;
    it is warmer or colder when it is used than when it was calibrated, and its supply another.
    """
    normalised = np.zeros((TRIALS, len(ATTITUDES), 2))
    inside = np.zeros(normalised.shape, dtype=bool)
    for seed in range(TRIALS):
        terms = sensor_errors.draw(BARE, seed).terms
        changes = ("over temperature", "supply")
        on_the_day = {k: x for k, x in terms.items() if not any(word in k for word in changes)}
        before, later = (
            sensor_errors.realise(BARE, t, BARE.board.excitation.value, 0.0).accelerometer
            for t in (on_the_day, terms)
        )
        rig = _calibrated(before, np.random.default_rng(seed))
        for number, (theta, phi) in enumerate(ATTITUDES):
            volts = later.volts(specific_force(phi, theta, RIG.water.gravity.value))
            force = accelerometer_conversion(rig).specific_force(volts)
            errors = float(pitch(force)) - theta, float(roll(force)) - phi
            budget = inclination_budget(rig, theta, phi)
            normalised[seed, number] = np.array(errors) / (budget.pitch, budget.roll)
            inside[seed, number] = np.abs(errors) <= (budget.pitch_u95(), budget.roll_u95())
    return normalised, inside


def test_stated_uncertainties_are_those_of_the_errors(readings):
    """A table counted twice, or a lean taken for scatter, makes it 0.5. The root mean square of 200
    is good to 5 %, the budget's bend comes on top of the calibration's."""
    rms = np.sqrt(np.mean(readings[0] ** 2, axis=0))
    assert np.all((rms > 0.75) & (rms < 1.15)), rms


def test_stated_intervals_cover_the_inclinations(readings):
    """Of 200 at 95 % the share is good to 1.5 %, and three of these are given. It may lie above:
    lean and bend never leave their limits (of 1000 it is 96 to 98 %)."""
    assert np.all(np.mean(readings[1], axis=0) >= 0.905), np.mean(readings[1], axis=0)
