# SPDX-License-Identifier: Apache-2.0
"""Specific force, pitch and roll from the codes of the accelerometer's three channels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from towtank_rig import Rig
from towtank_rig.conversion import accelerometer_conversion, pitch, roll
from towtank_rig.uncertainty import inclination_budget

from towtank_daq.description import BoardDescription

_FORCE_TOLERANCE = 0.25  # of g; beyond, too much of the force is not gravity
_BUDGET_STEP = 0.1  # rad; a budget takes long and changes slowly with attitude


@dataclass(frozen=True, slots=True)
class InclinometerReading:
    """One sample. NaN where the board lacks a conversion."""

    specific_force: tuple[float, float, float]
    """In fish axes, m/s^2."""
    pitch: float
    roll: float
    """rad by REP-103: positive pitch is bow down."""
    pitch_uncertainty: float
    roll_uncertainty: float
    """Standard uncertainties (k = 1), rad."""
    valid: bool
    """False without all three conversions or too far from 1 g to mean attitude."""


_MISSING = InclinometerReading((math.nan,) * 3, math.nan, math.nan, math.nan, math.nan, False)


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
        board_noise = max(
            board.channels[c].noise_volts / board.channels[c].gain for c in self.channels
        )
        self.force_noise = (
            math.hypot(sensor_noise, board_noise) / rig.sensors.accelerometer.sensitivity.value
        )
        """Standard deviation of one sample of one axis by noise, m/s^2."""
        self._uncertainty = lru_cache(maxsize=1000)(self._uncertainty_at)

    def process(self, codes: Sequence[int], valid_mask: int) -> InclinometerReading:
        """Convert the accelerometer's codes out of one scan."""
        if valid_mask & self._mask != self._mask:
            return _MISSING
        raw = [codes[channel] for channel in self.channels]
        volts = [float(adc.volts(code)) for adc, code in zip(self._adc, raw, strict=True)]
        force = self._conversion.specific_force(volts)
        x, y, z = (float(component) for component in force)
        pitch_rad, roll_rad = float(pitch(force)), float(roll(force))
        pitch_u, roll_u = self._uncertainty(
            round(pitch_rad / _BUDGET_STEP), round(roll_rad / _BUDGET_STEP)
        )
        magnitude = math.sqrt(x * x + y * y + z * z)
        valid = abs(magnitude - self._gravity) <= _FORCE_TOLERANCE * self._gravity and not any(
            adc.saturated(code) for adc, code in zip(self._adc, raw, strict=True)
        )
        return InclinometerReading((x, y, z), pitch_rad, roll_rad, pitch_u, roll_u, valid)

    def _uncertainty_at(self, pitch_steps: int, roll_steps: int) -> tuple[float, float]:
        pitch_rad = _BUDGET_STEP * pitch_steps
        budget = inclination_budget(self._rig, pitch_rad, _BUDGET_STEP * roll_steps)
        noise = self.force_noise / self._gravity  # turns the vector; roll about a shortened arm
        return (
            math.hypot(budget.pitch, noise),
            math.hypot(budget.roll, noise / max(math.cos(pitch_rad), _BUDGET_STEP)),
        )
