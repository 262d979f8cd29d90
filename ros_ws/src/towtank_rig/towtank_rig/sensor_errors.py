# SPDX-License-Identifier: Apache-2.0
"""Sensors as they might really be: one random realisation of every error that the rig allows.

The virtual bench turns the true pressure and specific force into volts at the sensors' terminals
with it. The errors come from the distributions of towtank_rig.error_terms, those that the
uncertainty budget is made of.
"""

from collections.abc import Iterable
from dataclasses import dataclass

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
from towtank_rig.error_terms import (
    AXES,
    PRESSURE_SENSORS,
    ErrorTerm,
    accelerometer_error_terms,
    pressure_error_terms,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.quantity import Tolerance
from towtank_rig.schema import Rig, Water

Array = NDArray[np.float64]

# The g of data sheets and of accelerometer calibrations, m/s².
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class PressureSensorErrors:
    """One pressure channel with its systematic errors.

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
    gain: float
    linearity: float
    zero_offset: float
    zero_drift: float
    flow_coefficient: float
    water_weight: float
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
        sensitivity: Relative error of each axis, shape (3,).
        zero_g: V, shape (3,).
        nonlinearity: Deviation of each axis at 1 g, growing with the square, m/s², shape (3,).
        coupling: What each axis sees of the others, shape (3, 3), zero diagonal.
        rotation: Small rotation of the sensor about its axes, rad, shape (3,).
        noise: Standard deviation of the white noise of one sample, V.
    """

    conversion: AccelerometerConversion
    sensitivity: Array
    zero_g: Array
    nonlinearity: Array
    coupling: Array
    rotation: Array
    noise: float

    def volts(self, specific_force: ArrayLike) -> Array:
        """Return the noiseless volts of x, y, z from specific force in fish axes; shape (…, 3)."""
        in_axes = np.asarray(specific_force, dtype=float) @ self.conversion.fish_to_axes.T
        felt = in_axes @ (rotation(*self.rotation).T + self.coupling).T
        felt = felt + self.nonlinearity * np.square(felt / STANDARD_GRAVITY)
        sensitivity = self.conversion.sensitivity * (1.0 + self.sensitivity)
        return self.conversion.zero_g + self.zero_g + sensitivity * felt


@dataclass(frozen=True)
class SensorErrors:
    """All sensors of a rig in one realisation.

    ``terms`` holds every drawn error by sensor and name, for records and tests. ``excitation`` is
    the true excitation, V.
    """

    fish_pressure: PressureSensorErrors
    depressor_pressure: PressureSensorErrors
    accelerometer: AccelerometerErrors
    excitation: float
    terms: dict[str, float]


def draw(rig: Rig, seed: int) -> SensorErrors:
    """Return a random realisation; the same seed gives the same."""
    rng = np.random.default_rng(seed)
    terms = {key: _draw(term, rng) for key, term in error_terms(rig).items()}
    low, high = rig.board.excitation.range or (rig.board.excitation.value,) * 2
    return realise(rig, terms, excitation=float(rng.uniform(low, high)), noise_scale=1.0)


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
    rig: Rig, terms: dict[str, float], excitation: float, noise_scale: float
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
    rig: Rig, sensor: PressureSensorName, terms: dict[str, float], noise_scale: float
) -> PressureSensorErrors:
    given = getattr(rig.sensors, sensor)
    calibration = getattr(rig.calibrations, sensor)
    own = pressure_error_terms(rig, sensor)

    def total(effect: str) -> float:
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


def _accelerometer(rig: Rig, terms: dict[str, float], noise_scale: float) -> AccelerometerErrors:
    def per_axis(*names: str) -> Array:
        keys = [[f"accelerometer/{name} {axis}" for name in names] for axis in AXES]
        return np.array([_sum(terms, axis_keys) for axis_keys in keys])

    coupling = np.array(
        [[terms.get(f"accelerometer/cross axis {a}{b}", 0.0) for b in AXES] for a in AXES]
    )
    return AccelerometerErrors(
        conversion=accelerometer_conversion(rig),
        sensitivity=per_axis("sensitivity"),
        zero_g=per_axis("zero g", "zero g over temperature"),
        nonlinearity=per_axis("nonlinearity"),
        coupling=coupling,
        rotation=per_axis("alignment about"),
        noise=rig.sensors.accelerometer.errors.noise.value * noise_scale,
    )


def _sum(terms: dict[str, float], keys: Iterable[str]) -> float:
    return sum(terms.get(key, 0.0) for key in keys)


def _draw(term: ErrorTerm, rng: np.random.Generator) -> float:
    return float(np.prod([_draw_factor(factor, rng) for factor in term.factors]))


def _draw_factor(factor: Tolerance, rng: np.random.Generator) -> float:
    if factor.distribution == "rectangular":
        return rng.uniform(-factor.value, factor.value)
    return rng.normal(0.0, factor.standard_uncertainty)
