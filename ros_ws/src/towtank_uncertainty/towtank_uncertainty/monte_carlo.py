# SPDX-License-Identifier: Apache-2.0
"""Errors of depth, pitch and heave ratio by propagation of distributions (JCGM 101:2008).

Random sensors, with every error that the rig allows, read a known truth; the rig's conversion makes
values of it. Nothing is linear here that is not linear in the sensor: beside a budget of first
order this shows what first order leaves out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from towtank_rig.conversion import (
    depth_from_pressure,
    flow_pressure,
    pitch,
    pressure_conversion,
    pressure_from_depth,
    rotation,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.schema import Rig

from towtank_uncertainty.depth_budget import OperatingPoint
from towtank_uncertainty.error_terms import draw_tolerance
from towtank_uncertainty.sensor_errors import PressureSensorErrors, draw_many

Array = NDArray[np.float64]

_PHASES = 2.0 * math.pi * np.arange(16) / 16  # of one heave: enough for its first harmonic


@dataclass(frozen=True)
class Propagated:
    """A sample of errors: mean, standard deviation, and the interval from 2.5 % to 97.5 %."""

    mean: float
    standard_uncertainty: float
    low: float
    high: float

    @classmethod
    def of(cls, errors: Array) -> Propagated:
        """Sum up errors of shape (n,)."""
        low, high = np.quantile(errors, (0.025, 0.975))
        return cls(float(np.mean(errors)), float(np.std(errors)), float(low), float(high))


class RandomSensors:
    """Many random realisations of a rig's sensors; each reads everything that is asked for."""

    def __init__(self, rig: Rig, count: int, seed: int) -> None:
        self._rig = rig
        self._count = count
        self._rng = np.random.default_rng(seed)
        self._drawn = draw_many(rig, self._rng, count)

    def depth(self, sensor: PressureSensorName, at: OperatingPoint, noise: float) -> Array:
        """Return errors of single depths that are not zeroed, m, shape (count,).

        noise: Standard deviation of one sample, m.
        """
        return self._depth_on_the_way(sensor, at) - at.mean_depth + self._white(noise)

    def zeroed_depth(self, sensor: PressureSensorName, at: OperatingPoint, noise: float) -> Array:
        """Return errors of single depths below the place of zeroing, m, shape (count,)."""
        zero = self._read(sensor, at.zeroed_at, drift=0.0)
        way = at.mean_depth - at.zeroed_at
        return self._depth_on_the_way(sensor, at) - zero - way + self._white(noise)

    def pitch(self, angle: float, crank_rate: float, noise: float) -> Array:
        """Return errors of pitch at a true angle, rad, the fish upright; shape (count,).

        crank_rate: rad/s, with which the fish surges. noise: of the specific force, m/s².
        """
        force = np.zeros((self._count, 3))
        force[:, 0] = crank_rate * self._surge("fish_pressure") * self._at_any_instant()
        force[:, 2] = self._rig.water.gravity.value
        accelerometer = self._drawn.accelerometer
        volts = accelerometer.volts(force @ rotation(0.0, angle, 0.0))
        read = accelerometer.conversion.specific_force(volts)
        return pitch(read + noise * self._rng.standard_normal(read.shape)) - angle

    def ratio(
        self,
        fish: OperatingPoint,
        depressor: OperatingPoint,
        noises: tuple[float, float],
    ) -> Array:
        """Return relative errors of fish amplitude over depressor amplitude, shape (count,).

        noises: Standard deviations of the fitted amplitudes of fish and depressor, m.
        """
        measured = self._amplitude("fish_pressure", fish) + self._white(noises[0])
        measured /= self._amplitude("depressor_pressure", depressor) + self._white(noises[1])
        return measured / (fish.amplitude / depressor.amplitude) - 1.0

    def _white(self, deviation: float) -> Array:
        return deviation * self._rng.standard_normal(self._count)

    def _surge(self, sensor: PressureSensorName) -> Array | float:
        """Amplitudes of the port's surge, m/s."""
        limit = getattr(self._rig.sensors, sensor).errors.surge_speed
        return draw_tolerance(limit, self._rng, self._count)

    def _at_any_instant(self) -> Array:
        return np.cos(self._rng.uniform(0.0, 2.0 * math.pi, self._count))

    def _hum(self, sensor: PressureSensorName) -> Array:
        """Hum folded onto the crank's frequency, m: its part in step with heave, or of a depth."""
        given = getattr(self._rig.sensors, sensor)
        volts = draw_tolerance(given.errors.hum, self._rng, self._count) * self._at_any_instant()
        bridge = pressure_conversion(self._rig, sensor)
        pascals_per_volt = bridge.full_scale / bridge.span
        reference = bridge.reference_excitation / bridge.excitation
        return depth_from_pressure(volts * reference * pascals_per_volt, self._rig.water)

    def _depth_on_the_way(self, sensor: PressureSensorName, at: OperatingPoint) -> Array:
        """Single depths, m; what is towed surges, too."""
        surge = self._surge(sensor) * self._at_any_instant() if at.speed else 0.0
        return self._read(sensor, at.mean_depth, at.speed, surge) + self._hum(sensor)

    def _amplitude(self, sensor: PressureSensorName, at: OperatingPoint) -> Array:
        """First harmonic of a heave that the drawn sensors read, m."""
        surge = self._surge(sensor)
        harmonic = np.zeros(self._count, dtype=complex)
        for phase in _PHASES.tolist():
            depth = at.mean_depth - at.amplitude * math.cos(phase)
            read = self._read(sensor, depth, at.speed, surge * math.cos(phase))
            harmonic -= read * np.exp(-1j * phase)
        return np.abs(harmonic) * (2.0 / len(_PHASES)) + self._hum(sensor)

    def _read(
        self,
        sensor: PressureSensorName,
        depth: float,
        speed: float = 0.0,
        surge: float | Array = 0.0,
        drift: float = 1.0,
    ) -> Array:
        """Depths that the drawn sensors read at a true one, m; only ``speed`` is known, m/s."""
        model: PressureSensorErrors = getattr(self._drawn, sensor)
        volts = model.volts(pressure_from_depth(depth, self._rig.water), speed + surge, drift)
        flow = flow_pressure(model.nominal_flow_coefficient, speed, self._rig.water)
        return depth_from_pressure(model.conversion.pressure(volts) - flow, self._rig.water)
