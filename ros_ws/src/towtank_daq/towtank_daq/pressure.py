# SPDX-License-Identifier: Apache-2.0
"""Gauge pressure and depth from the codes of one pressure channel."""

from __future__ import annotations

import math
import statistics
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from towtank_rig import Rig
from towtank_rig.conversion import depth_conversion
from towtank_rig.instruments import PressureSensorName
from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget

from towtank_daq.description import BoardDescription
from towtank_daq.encoder import AT_REST, Drive

_NOISE_LIMIT = 4.0  # times the expected noise: 200 samples scatter by 5 % about it
_RANGE_BELOW = 0.05  # of full scale: offsets read a little below zero at the surface
_ANY_AMPLITUDE = 1.0  # the depth's part of the budget does not depend on it

# Budgets take some milliseconds and change slowly: they are worked out in steps of these.
_DEPTH_STEP = 0.02  # m
_SPEED_STEP = 0.1  # m/s


class ZeroingError(Exception):
    """The sensor cannot be zeroed now; one line with cause and mend."""


@dataclass(frozen=True, slots=True)
class PressureReading:
    """One sample. Uncertainties are standard (k = 1).

    NaN where the board has no conversion. While the carriage's speed is not known (the first tenth
    of a second, and as long after a gap), neither is what the flow adds at the port: the depth and
    its uncertainty are NaN then, and no older speed stands in for it.
    """

    pressure: float
    """Gauge pressure at the port, Pa, that of the flow included, not zeroed."""
    pressure_uncertainty: float
    """Type A and B, Pa."""
    depth: float
    """m below still water or, once zeroed, below the place of zeroing."""
    depth_type_a: float
    """From the scatter of samples, m."""
    depth_type_b: float
    """From the rig's budget, m."""
    depth_u95: float
    """Half-width of the 95 % interval, m."""
    valid: bool
    """False without a conversion or a known speed, at an end of the ADC's scale or beyond the
    sensor's range."""

    @property
    def depth_uncertainty(self) -> float:
        """Type A and B combined, m."""
        return math.hypot(self.depth_type_a, self.depth_type_b)


_MISSING = PressureReading(*(6 * (math.nan,)), False)


@dataclass(frozen=True, slots=True)
class _Stated:
    """What the budget says at one operating point: m, the pressure as m of water."""

    head: float
    absolute: float
    absolute_u95: float
    zeroed: float
    zeroed_u95: float


class Zero(NamedTuple):
    """Where a sensor was zeroed, m below still water as it read then, and the scatter of a sample
    about it, m."""

    depth: float
    scatter: float


class PressureSensor:
    """One pressure channel of a rig; process() takes the scans one after another."""

    def __init__(
        self, rig: Rig, board: BoardDescription, sensor: PressureSensorName, zero_scans: int
    ) -> None:
        given = getattr(rig.sensors, sensor)
        self.channel = board.channel_names.index(given.channel)
        excitation = rig.board.excitation.value
        nominal = board.adc_channel(given.channel, excitation)
        self._rig, self._sensor = rig, sensor
        self._conversion = depth_conversion(rig, sensor, nominal)
        self._full_scale = given.full_scale.value
        self._weight = rig.water.density.value * rig.water.gravity.value  # Pa/m
        board_noise = board.terminal_noise(given.channel, excitation)
        at_surface = OperatingPoint(0.0, _ANY_AMPLITUDE, 0.0)
        self._expected_noise = depth_budget(rig, sensor, at_surface, board_noise).noise
        self._recent: deque[float] = deque(maxlen=zero_scans)
        self._rest_depth: float | None = None
        self._type_a = self._expected_noise
        self._stated = lru_cache(maxsize=1000)(self._stated_at)

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

    def process(
        self, codes: Sequence[int], valid_mask: int, drive: Drive = AT_REST
    ) -> PressureReading:
        """Convert this sensor's code out of one scan."""
        if not valid_mask >> self.channel & 1:
            return _MISSING
        code = codes[self.channel]
        pressure = float(self._conversion.pressure(code))
        known = not math.isnan(drive.carriage_speed)
        speed = abs(drive.carriage_speed) if known else 0.0
        depth = float(self._conversion.depth(pressure, speed))
        stated = self._stated(round(depth / _DEPTH_STEP), round(speed / _SPEED_STEP))
        # No flow acts on what the pressure is worth
        pressure_uncertainty = self._weight * math.hypot(stated.head, self._type_a)
        if not known:
            return PressureReading(
                pressure, pressure_uncertainty, math.nan, self._type_a, math.nan, math.nan, False
            )
        valid = not self._conversion.channel.saturated(code) and (
            -_RANGE_BELOW * self._full_scale <= pressure <= self._full_scale
        )
        if valid:
            self._recent.append(depth)
        if self._rest_depth is None:
            type_b, u95 = stated.absolute, stated.absolute_u95
        else:
            depth -= self._rest_depth
            type_b, u95 = stated.zeroed, stated.zeroed_u95
        return PressureReading(
            pressure, pressure_uncertainty, depth, self._type_a, type_b, u95, valid
        )

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
        scatter = statistics.stdev(self._recent, mean)
        expected = self._expected_noise
        if scatter > _NOISE_LIMIT * expected:
            raise ZeroingError(
                f"depth scatters by {1e3 * scatter:.2f} mm over the last {wanted} scans, expected "
                f"is {1e3 * expected:.2f} mm: bring the sensor to rest, or check its wiring, and "
                "zero again"
            )
        # a sample's, the mean's
        self.restore(Zero(mean, scatter * math.sqrt(1.0 + 1.0 / len(self._recent))))
        return f"zero at {mean:.4f} m, mean of {wanted} scans, scatter {1e3 * scatter:.2f} mm"

    @property
    def zero_taken(self) -> Zero | None:
        """What zeroing has found; None before."""
        return None if self._rest_depth is None else Zero(self._rest_depth, self._type_a)

    def restore(self, zero: Zero) -> None:
        """Go on from where the sensor was zeroed."""
        self._rest_depth, self._type_a = zero
        self._stated.cache_clear()

    def _stated_at(self, depth_steps: int, speed_steps: int) -> _Stated:
        at = OperatingPoint(
            _DEPTH_STEP * depth_steps,
            _ANY_AMPLITUDE,
            _SPEED_STEP * speed_steps,
            self._rest_depth or 0.0,
        )
        budget = depth_budget(self._rig, self._sensor, at)
        return _Stated(
            budget.head_before_zeroing,
            budget.depth_before_zeroing,
            budget.depth_before_zeroing_u95(self._type_a),
            budget.depth,
            budget.depth_u95(self._type_a),
        )
