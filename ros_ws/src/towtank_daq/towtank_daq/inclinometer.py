# SPDX-License-Identifier: Apache-2.0
"""Specific force, pitch and roll from the codes of the accelerometer's three channels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from towtank_rig import Rig
from towtank_rig.conversion import accelerometer_conversion, pitch, roll
from towtank_uncertainty.inclination_budget import inclination_budget
from towtank_uncertainty.sample import UNKNOWN, SampleUncertainty

from towtank_daq.description import BoardDescription
from towtank_daq.encoder import AT_REST, Drive
from towtank_daq.health_limits import FORCE_TOLERANCE

# Budgets take some milliseconds and change slowly: they are worked out in steps of these.
_ANGLE_STEP = 0.1  # rad
_CRANK_STEP = 0.2  # rad/s
_ACCELERATION_STEP = 0.05  # m/s^2, 0.3 deg


@dataclass(frozen=True, slots=True)
class InclinometerReading:
    """One sample. NaN where the board lacks a conversion.

    The angles' uncertainties are NaN, too, while it is not known how the drive moves (the first
    0.4 s, and as long after a gap): the angles are measured, but nobody knows what acts on them.
    """

    specific_force: tuple[float, float, float]
    """In fish axes, m/s^2."""
    pitch: float
    roll: float
    """rad by REP-103: positive pitch is bow down."""
    pitch_uncertainty: SampleUncertainty
    roll_uncertainty: SampleUncertainty
    force_covariance: tuple[float, ...]
    """Of the specific force, type A and B, (m/s^2)^2, row by row."""
    valid: bool
    """False without all three conversions or too far from 1 g to mean attitude."""


_MISSING = InclinometerReading(
    (math.nan,) * 3, math.nan, math.nan, UNKNOWN, UNKNOWN, (math.nan,) * 9, False
)

_Stated = tuple[SampleUncertainty, SampleUncertainty, tuple[float, ...]]


class Inclinometer:
    """The rig's accelerometer as an inclinometer; unfiltered."""

    def __init__(self, rig: Rig, board: BoardDescription) -> None:
        names = rig.sensors.accelerometer.channels
        axes = (names.x, names.y, names.z)
        excitation = rig.board.excitation.value
        self.channels = tuple(board.channel_names.index(name) for name in axes)
        self._mask = sum(1 << channel for channel in self.channels)
        self._adc = tuple(board.adc_channel(name, excitation) for name in axes)
        self._conversion = accelerometer_conversion(rig)
        self._gravity = rig.water.gravity.value
        self._rig = rig
        sensor_noise = rig.sensors.accelerometer.errors.noise.value
        board_noise = max(board.terminal_noise(name, excitation) for name in axes)
        self._force_noise = (
            math.hypot(sensor_noise, board_noise) / rig.sensors.accelerometer.sensitivity.value
        )
        """Standard deviation of one sample of one axis by noise, m/s^2."""
        self._stated = lru_cache(maxsize=1000)(self._stated_at)
        self._stated(0, 0, 0, 0)  # the first takes long, for what all have in common

    def process(
        self, codes: Sequence[int], valid_mask: int, drive: Drive = AT_REST
    ) -> InclinometerReading:
        """Convert the accelerometer's codes out of one scan."""
        if valid_mask & self._mask != self._mask:
            return _MISSING
        raw = [codes[channel] for channel in self.channels]
        volts = [float(adc.volts(code)) for adc, code in zip(self._adc, raw, strict=True)]
        force = self._conversion.specific_force(volts)
        x, y, z = (float(component) for component in force)
        pitch_rad, roll_rad = float(pitch(force)), float(roll(force))
        known = not math.isnan(drive.crank_rate + drive.carriage_acceleration)
        stated = self._stated(
            round(pitch_rad / _ANGLE_STEP),
            round(roll_rad / _ANGLE_STEP),
            round(abs(drive.crank_rate) / _CRANK_STEP) if known else 0,
            round(abs(drive.carriage_acceleration) / _ACCELERATION_STEP) if known else 0,
        )
        if not known:
            stated = (UNKNOWN, UNKNOWN, stated[2])  # the force is what the sensor feels
        magnitude = math.sqrt(x * x + y * y + z * z)
        valid = abs(magnitude - self._gravity) <= FORCE_TOLERANCE * self._gravity and not any(
            adc.saturated(code) for adc, code in zip(self._adc, raw, strict=True)
        )
        return InclinometerReading((x, y, z), pitch_rad, roll_rad, *stated, valid)

    def _stated_at(
        self, pitch_steps: int, roll_steps: int, crank_steps: int, acceleration_steps: int
    ) -> _Stated:
        pitch_rad = _ANGLE_STEP * pitch_steps
        budget = inclination_budget(
            self._rig,
            pitch_rad,
            _ANGLE_STEP * roll_steps,
            _CRANK_STEP * crank_steps,
            _ACCELERATION_STEP * acceleration_steps,
        )
        noise = self._force_noise / self._gravity  # turns the vector; roll about a shortened arm
        roll_noise = noise / max(math.cos(pitch_rad), _ANGLE_STEP)
        covariance = budget.force_covariance + self._force_noise**2 * np.eye(3)
        return (
            SampleUncertainty(noise, budget.pitch, budget.pitch_u95(noise)),
            SampleUncertainty(roll_noise, budget.roll, budget.roll_u95(roll_noise)),
            tuple(covariance.ravel().tolist()),
        )
