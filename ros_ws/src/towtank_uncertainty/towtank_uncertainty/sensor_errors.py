# SPDX-License-Identifier: Apache-2.0
"""Sensors as they might really be: random realisations of every error that the rig allows.

The virtual bench turns the true pressure and specific force into volts at the sensors' terminals
with one; a Monte Carlo study takes many at once. The errors come from the distributions of
towtank_uncertainty.error_terms, those that the uncertainty budget is made of.

In many realisations at once every error is an array with one value a realisation in its first
axis; what the sensors are given then needs that axis, or none.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from towtank_rig.conversion import (
    AccelerometerConversion,
    PressureConversion,
    accelerometer_conversion,
    flow_pressure,
    pressure_conversion,
    rotation,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.schema import Rig, Water

from towtank_uncertainty.error_terms import (
    AXES,
    PRESSURE_SENSORS,
    ErrorTerm,
    accelerometer_error_terms,
    draw_tolerance,
    pressure_error_terms,
)

Array = NDArray[np.float64]

# The g of data sheets and of accelerometer calibrations, m/s².
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class PressureSensorErrors:
    """One pressure channel with its systematic errors, each a number or an array.

    Attributes:
        conversion: The conversion that the errors falsify.
        water: For the flow pressure.
        full_scale: Pa.
        fitted_range: Pa; a non-linear sensor reads right at zero and at this pressure.
        nominal_flow_coefficient: Cp of the port as the rig states it.
        gain: Relative error of the slope.
        linearity: Greatest deviation from the straight line over the full scale, fraction of it.
        zero_offset: V at the reference excitation, constant.
        zero_drift: V at the reference excitation, come about since zeroing.
        flow_coefficient: Error of Cp.
        water_weight: Relative error of density times gravity, the same for both sensors.
        noise: Standard deviation of the white noise of one sample, V.
    """

    conversion: PressureConversion
    water: Water
    full_scale: float
    fitted_range: float
    nominal_flow_coefficient: float
    gain: float | Array
    linearity: float | Array
    zero_offset: float | Array
    zero_drift: float | Array
    flow_coefficient: float | Array
    water_weight: float | Array
    noise: float

    def volts(
        self,
        pressure: ArrayLike,
        speed: ArrayLike = 0.0,
        drift: ArrayLike = 1.0,
        excitation: float | None = None,
    ) -> Array:
        """Return the noiseless volts at the bridge's terminals.

        Args:
            pressure: Hydrostatic gauge pressure at the port, Pa, of the rig's stated water.
            speed: Speed of the water past the port, m/s.
            drift: Share of the drift since zeroing that has come about, 0 at the zeroing.
            excitation: The true excitation, V; the nominal one by default.
        """
        nominal = self.conversion.excitation
        cp = self.nominal_flow_coefficient + self.flow_coefficient
        at_port = np.asarray(pressure, dtype=float) * (1.0 + self.water_weight)
        at_port = at_port + flow_pressure(cp, speed, self.water)
        # Data sheets state linearity as the deviation at mid range from a line through the end
        # points: a parabola. With the line fitted up to less, it is zero there instead.
        bend = 4.0 * self.linearity / self.full_scale * at_port * (self.fitted_range - at_port)
        read = self.conversion.volts(at_port * (1.0 + self.gain) + bend)
        offset = self.zero_offset + self.zero_drift * np.asarray(drift, dtype=float)
        read = read + offset * nominal / self.conversion.reference_excitation
        return read * ((nominal if excitation is None else excitation) / nominal)


@dataclass(frozen=True)
class AccelerometerErrors:
    """The accelerometer with its systematic errors.

    Attributes:
        conversion: The conversion that the errors falsify.
        sensitivity: Relative error of each axis, shape (…, 3).
        zero_g: V, shape (…, 3).
        supply: Relative error of the supply over the ADC's reference: all volts are shares of it.
        nonlinearity: Deviation of each axis at 1 g, growing with the square, m/s², shape (…, 3).
        coupling: What each axis sees of the others, shape (…, 3, 3), zero diagonal.
        rotation: Small rotation of the sensor about its axes, rad, shape (…, 3).
        noise: Standard deviation of the white noise of one sample, V.
    """

    conversion: AccelerometerConversion
    sensitivity: Array
    zero_g: Array
    supply: float | Array
    nonlinearity: Array
    coupling: Array
    rotation: Array
    noise: float

    def volts(self, specific_force: ArrayLike) -> Array:
        """Return the noiseless volts of x, y, z from specific force in fish axes; shape (…, 3)."""
        in_axes = np.asarray(specific_force, dtype=float) @ self.conversion.fish_to_axes.T
        felt = (self._axes @ in_axes[..., np.newaxis])[..., 0]
        felt = felt + self.nonlinearity * np.square(felt / STANDARD_GRAVITY)
        sensitivity = self.conversion.sensitivity * (1.0 + self.sensitivity)
        volts = self.conversion.zero_g + self.zero_g + sensitivity * felt
        return volts * (1.0 + np.asarray(self.supply)[..., np.newaxis])

    @cached_property
    def _axes(self) -> Array:
        """Directions of the sensor's axes as its errors turn them, shape (…, 3, 3)."""
        turned = rotation(*np.moveaxis(self.rotation, -1, 0))
        return np.swapaxes(turned, -1, -2) + self.coupling


@dataclass(frozen=True)
class SensorErrors:
    """All sensors of a rig.

    ``terms`` holds every drawn error by sensor and name, for records and tests. ``excitation`` is
    the true excitation, V.
    """

    fish_pressure: PressureSensorErrors
    depressor_pressure: PressureSensorErrors
    accelerometer: AccelerometerErrors
    excitation: float | Array
    terms: dict[str, float | Array]


def draw(rig: Rig, seed: int) -> SensorErrors:
    """Return a random realisation; the same seed gives the same."""
    return _drawn(rig, np.random.default_rng(seed), None)


def draw_many(rig: Rig, rng: np.random.Generator, count: int) -> SensorErrors:
    """Return that many random realisations at once: every error has the shape (count,)."""
    return _drawn(rig, rng, count)


def none(rig: Rig) -> SensorErrors:
    """Return ideal sensors: the rig's conversion exactly inverted, no noise."""
    return realise(rig, {}, excitation=rig.board.excitation.value, noise_scale=0.0)


def error_terms(rig: Rig) -> dict[str, ErrorTerm]:
    """Return all error terms as ``sensor/term``; an error that both share as ``shared/term``."""
    terms: dict[str, ErrorTerm] = {}
    for sensor in PRESSURE_SENSORS:
        for term in pressure_error_terms(rig, sensor):
            terms[f"{'shared' if term.shared else sensor}/{term.name}"] = term
    for term in accelerometer_error_terms(rig):
        terms[f"accelerometer/{term.name}"] = term
    return terms


def realise(
    rig: Rig,
    terms: Mapping[str, float | Array],
    excitation: float | Array,
    noise_scale: float,
) -> SensorErrors:
    """Return the sensors with the given errors (keys of ``error_terms``); others are zero."""
    unknown = set(terms) - set(error_terms(rig))
    if unknown:
        raise KeyError(f"no such error terms: {', '.join(sorted(unknown))}")
    fish, depressor = (_pressure_sensor(rig, s, terms, noise_scale) for s in PRESSURE_SENSORS)
    accelerometer = _accelerometer(rig, terms, noise_scale)
    return SensorErrors(fish, depressor, accelerometer, excitation, dict(terms))


def add_noise(volts: ArrayLike, noise: float, rng: np.random.Generator) -> Array:
    """Return ``volts`` with white noise of standard deviation ``noise`` added to each sample."""
    volts = np.asarray(volts, dtype=float)
    return volts + noise * rng.standard_normal(volts.shape)


def _pressure_sensor(
    rig: Rig, sensor: PressureSensorName, terms: Mapping[str, float | Array], noise_scale: float
) -> PressureSensorErrors:
    given = getattr(rig.sensors, sensor)
    calibration = getattr(rig.calibrations, sensor)
    own = pressure_error_terms(rig, sensor)

    def total(effect: str) -> float | Array:
        keys = [f"{'shared' if t.shared else sensor}/{t.name}" for t in own if t.effect == effect]
        return _sum(terms, keys)

    full_scale = given.full_scale.value
    return PressureSensorErrors(
        conversion=pressure_conversion(rig, sensor),
        water=rig.water,
        full_scale=full_scale,
        fitted_range=calibration.fitted_range.value if calibration else full_scale,
        nominal_flow_coefficient=given.flow_coefficient.value,
        gain=total("gain"),
        linearity=total("linearity"),
        zero_offset=total("zero_offset"),
        zero_drift=total("zero_drift"),
        flow_coefficient=total("flow"),
        water_weight=total("water"),
        noise=given.errors.noise.value * noise_scale,
    )


def _accelerometer(
    rig: Rig, terms: Mapping[str, float | Array], noise_scale: float
) -> AccelerometerErrors:
    def per_axis(*names: str) -> Array:
        keys = [[f"accelerometer/{name} {axis}" for name in names] for axis in AXES]
        return _stacked(_sum(terms, axis_keys) for axis_keys in keys)

    columns = [
        _stacked(terms.get(f"accelerometer/cross axis {a}{b}", 0.0) for a in AXES) for b in AXES
    ]
    return AccelerometerErrors(
        conversion=accelerometer_conversion(rig),
        sensitivity=per_axis("sensitivity"),
        zero_g=per_axis("zero g", "zero g over temperature"),
        supply=terms.get("accelerometer/supply ratio", 0.0),
        nonlinearity=per_axis("nonlinearity"),
        coupling=_stacked(columns),
        rotation=per_axis("alignment about"),
        noise=rig.sensors.accelerometer.errors.noise.value * noise_scale,
    )


def _stacked(values: Iterable[float | Array]) -> Array:
    """Return values of one shape, or scalars, along a new last axis."""
    return np.stack(np.broadcast_arrays(*map(np.asarray, values)), axis=-1)


def _sum(terms: Mapping[str, float | Array], keys: Iterable[str]) -> float | Array:
    return sum(terms.get(key, 0.0) for key in keys)


def _drawn(rig: Rig, rng: np.random.Generator, count: int | None) -> SensorErrors:
    terms = {key: _draw(term, rng, count) for key, term in error_terms(rig).items()}
    low, high = rig.board.excitation.range or (rig.board.excitation.value,) * 2
    return realise(rig, terms, excitation=rng.uniform(low, high, count), noise_scale=1.0)


def _draw(term: ErrorTerm, rng: np.random.Generator, count: int | None) -> float | Array:
    return math.prod(draw_tolerance(factor, rng, count) for factor in term.factors)
