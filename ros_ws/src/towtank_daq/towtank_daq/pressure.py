# SPDX-License-Identifier: Apache-2.0
"""Gauge pressure and depth from the codes of one pressure channel."""

from __future__ import annotations

import math
import statistics
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from towtank_rig import Rig
from towtank_rig.conversion import (
    calibrated_channel,
    depth_from_pressure,
    pressure_conversion,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.uncertainty import OperatingPoint, SensorBudget, depth_budget

from towtank_daq.description import BoardDescription

_NOISE_LIMIT = 4.0  # times the expected noise: 200 samples scatter by 5 % about it
_RANGE_BELOW = 0.05  # of full scale: offsets read a little below zero at the surface
_ANY_AMPLITUDE = 1.0  # the depth's part of the budget does not depend on it


class ZeroingError(Exception):
    """The sensor cannot be zeroed now; one line with cause and mend."""


@dataclass(frozen=True, slots=True)
class PressureReading:
    """One sample. NaN where the board has no conversion."""

    pressure: float
    """Gauge pressure, Pa, not zeroed."""
    pressure_uncertainty: float
    """Standard uncertainty (k = 1), Pa."""
    depth: float
    """m below still water or, once zeroed, below the place of zeroing."""
    depth_uncertainty: float
    """Standard uncertainty (k = 1), m."""
    valid: bool
    """False without a conversion, at an end of the ADC's scale or beyond the sensor's range."""


class PressureSensor:
    """One pressure channel of a rig; process() takes the scans one after another."""

    def __init__(
        self, rig: Rig, board: BoardDescription, sensor: PressureSensorName, zero_scans: int
    ) -> None:
        given = getattr(rig.sensors, sensor)
        self.channel = board.channel_names.index(given.channel)
        nominal = board.adc_channel(given.channel, rig.board.excitation.value)
        self._rig, self._sensor = rig, sensor
        self._water = rig.water
        self._channel = calibrated_channel(rig, sensor, nominal)
        self._conversion = pressure_conversion(rig, sensor)
        self._full_scale = given.full_scale.value
        self._weight = rig.water.density.value * rig.water.gravity.value  # Pa/m
        self._board_noise = board.terminal_noise(given.channel, rig.board.excitation.value)
        # Tables by the centimetre: a budget takes long and changes slowly with depth
        self._budget = lru_cache(maxsize=1000)(self._budget_at)
        self._recent: deque[float] = deque(maxlen=zero_scans)
        self._rest_depth: float | None = None

    @property
    def zeroed(self) -> bool:
        return self._rest_depth is not None

    @property
    def zero_depth(self) -> float:
        """Where the sensor was zeroed, m below still water as it read then; NaN if it was not."""
        return math.nan if self._rest_depth is None else self._rest_depth

    @property
    def can_be_zeroed(self) -> bool:
        """Whether as many good scans have come as zeroing averages."""
        return len(self._recent) == self._recent.maxlen

    def process(self, codes: Sequence[int], valid_mask: int) -> PressureReading:
        """Convert this sensor's code out of one scan."""
        if not valid_mask >> self.channel & 1:
            return PressureReading(math.nan, math.nan, math.nan, math.nan, False)
        code = codes[self.channel]
        pressure = float(self._conversion.pressure(self._channel.volts(code)))
        depth = float(depth_from_pressure(pressure, self._water))
        valid = not self._channel.saturated(code) and (
            -_RANGE_BELOW * self._full_scale <= pressure <= self._full_scale
        )
        if valid:
            self._recent.append(depth)
        budget = self._budget(round(100.0 * depth))
        before_zeroing = math.hypot(budget.depth_before_zeroing, budget.noise)
        uncertainty = before_zeroing
        if self._rest_depth is not None:
            depth -= self._rest_depth
            uncertainty = math.hypot(budget.depth, budget.noise)
        return PressureReading(pressure, self._weight * before_zeroing, depth, uncertainty, valid)

    def zero(self) -> str:
        """Make the mean of the last scans the origin of depth; says in words what was done.

        Raises ZeroingError when there are too few, or when they scatter by more than the channel's
        noise explains: then the sensor moves, or something is wrong with it.
        """
        wanted = self._recent.maxlen
        if not self.can_be_zeroed:
            raise ZeroingError(
                f"only {len(self._recent)} of {wanted} good scans have come: wait and zero again"
            )
        mean = statistics.fmean(self._recent)
        scatter = statistics.pstdev(self._recent, mean)
        expected = self._budget(round(100.0 * mean)).noise
        if scatter > _NOISE_LIMIT * expected:
            raise ZeroingError(
                f"depth scatters by {1e3 * scatter:.2f} mm over the last {wanted} scans, expected "
                f"is {1e3 * expected:.2f} mm: bring the sensor to rest, or check its wiring, and "
                "zero again"
            )
        self._rest_depth = mean
        self._budget.cache_clear()
        return f"zero at {mean:.4f} m, mean of {wanted} scans, scatter {1e3 * scatter:.2f} mm"

    def _budget_at(self, centimetres: int) -> SensorBudget:
        # The speed past the port is not known here: the run's is the most there will be
        at = OperatingPoint(
            0.01 * centimetres,
            _ANY_AMPLITUDE,
            self._rig.run.carriage_speed.value,
            self._rest_depth or 0.0,
        )
        return depth_budget(self._rig, self._sensor, at, self._board_noise)
