# SPDX-License-Identifier: Apache-2.0
"""The systematic errors of a rig's sensors, one term each.

Both the budgets (depth_budget, inclination_budget) and the random sensors of the virtual bench
(sensor_errors) read this list, so a stated interval and the errors that it must cover cannot drift
apart.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from towtank_rig.instruments import PressureSensorName
from towtank_rig.quantity import Quantity, Tolerance
from towtank_rig.schema import Rig

from towtank_uncertainty.intervals import Distribution, Normal, Product, Rectangular

PRESSURE_SENSORS: tuple[PressureSensorName, ...] = ("fish_pressure", "depressor_pressure")
AXES = ("x", "y", "z")

PressureEffect = Literal[
    "gain", "linearity", "zero_offset", "zero_drift", "flow", "surge", "hum", "water"
]
AccelerometerEffect = Literal[
    "sensitivity", "zero_g", "supply", "nonlinearity", "coupling", "rotation"
]


@dataclass(frozen=True)
class ErrorTerm:
    """One systematic error with zero expectation: the product of independent factors.

    Most terms have one factor. A temperature effect has two, an unknown coefficient and an unknown
    change of temperature; their product has the product of their standard uncertainties.

    Attributes:
        name: Name of the term, unique within its sensor.
        effect: How the sensor's reading feels it.
        factors: The tolerances whose product the error is.
        unit: Unit of the error.
        shared: True if both pressure sensors have the same error, not merely the same tolerance.
    """

    name: str
    effect: str
    factors: tuple[Tolerance, ...]
    unit: str
    shared: bool = False

    @property
    def standard_uncertainty(self) -> float:
        """Return the standard deviation of the error in the term's unit."""
        return math.prod(factor.standard_uncertainty for factor in self.factors)

    @property
    def distribution(self) -> Distribution:
        """Return how the error is distributed, in the term's unit."""
        return reduce(Product, map(distribution_of, self.factors))

    @property
    def source(self) -> str:
        """Return where the tolerances come from."""
        return "; ".join(factor.source for factor in self.factors if factor.source)


def distribution_of(tolerance: Tolerance) -> Distribution:
    """Return how an error with this tolerance is distributed."""
    if tolerance.distribution == "rectangular":
        return Rectangular(tolerance.value)
    return Normal(tolerance.standard_uncertainty)


def draw_tolerance(
    tolerance: Tolerance, rng: np.random.Generator, count: int | None
) -> float | NDArray[np.float64]:
    """Return one random error with this tolerance, or an array of that many."""
    if tolerance.distribution == "rectangular":
        return rng.uniform(-tolerance.value, tolerance.value, count)
    return rng.normal(0.0, tolerance.standard_uncertainty, count)


def greatest(terms: Sequence[ErrorTerm], effect: str) -> float:
    """Return the greatest sum of the errors with one effect, each at its limit."""
    return sum(
        math.prod(factor.value for factor in term.factors)
        for term in terms
        if term.effect == effect
    )


def pressure_error_terms(rig: Rig, sensor: PressureSensorName) -> tuple[ErrorTerm, ...]:
    """Return the error terms of one pressure channel, sensor to ADC.

    A calibration in place covers sensor, amplifier and reference: its slope's uncertainty takes
    the place of theirs.
    """
    errors = getattr(rig.sensors, sensor).errors
    calibration = getattr(rig.calibrations, sensor)
    if calibration is None:
        gains = (
            ErrorTerm("span", "gain", (errors.span,), "1"),
            # One divider makes the reference of both channels.
            ErrorTerm("reference ratio", "gain", (errors.reference_ratio,), "1", shared=True),
            ErrorTerm("amplifier gain", "gain", (errors.amplifier_gain,), "1"),
        )
    else:
        gains = (ErrorTerm("calibrated span", "gain", (calibration.span_error,), "1"),)
    # A polynomial has taken the bend out
    straight = calibration is None or not any(calibration.bends)
    linearity = (ErrorTerm("linearity", "linearity", (errors.linearity,), "1"),) if straight else ()
    since_zeroing = errors.temperature_since_zeroing
    return (
        *gains,
        *_span_over_temperature(rig, sensor),
        # A loop that ends below full scale is narrower in proportion.
        ErrorTerm("hysteresis", "gain", (errors.hysteresis,), "1"),
        *linearity,
        ErrorTerm("offset", "zero_offset", (errors.offset,), "V"),
        ErrorTerm("offset stability", "zero_offset", (errors.offset_stability,), "V"),
        ErrorTerm("temperature hysteresis", "zero_offset", (errors.temperature_hysteresis,), "V"),
        ErrorTerm("amplifier offset", "zero_offset", (errors.amplifier_offset,), "V"),
        ErrorTerm(
            "offset over temperature",
            "zero_drift",
            (errors.offset_temperature, since_zeroing),
            "V",
        ),
        ErrorTerm(
            "amplifier offset over temperature",
            "zero_drift",
            (errors.amplifier_offset_temperature, since_zeroing),
            "V",
        ),
        ErrorTerm("flow pressure", "flow", (errors.flow_coefficient,), "1"),
        ErrorTerm("water density", "water", (_relative_limit(rig.water.density),), "1", True),
        ErrorTerm("gravity", "water", (_relative_limit(rig.water.gravity),), "1", True),
    )


def _span_over_temperature(rig: Rig, sensor: PressureSensorName) -> tuple[ErrorTerm, ...]:
    """Return what the water's temperature leaves of error in the span.

    Where a calibration knows the coefficient, the conversion takes it out; what is left are the
    coefficient's own range over the difference of temperatures, and the coefficient times what is
    not known of the difference.
    """
    errors = getattr(rig.sensors, sensor).errors
    calibration = getattr(rig.calibrations, sensor)
    unknown = errors.temperature_since_calibration
    if calibration is None or calibration.span_temperature is None:
        factors = (errors.span_temperature, unknown)
        return (ErrorTerm("span over temperature", "gain", factors, "1"),)
    coefficient = calibration.span_temperature
    warmer = abs(rig.water.temperature.value - calibration.temperature.value)
    low, high = coefficient.range or (coefficient.value, coefficient.value)
    source = coefficient.source
    range_left = Tolerance(value=(high - low) / 2.0 * warmer, unit="1", source=source)
    known = Tolerance(
        value=abs(coefficient.value) * unknown.value,
        unit="1",
        distribution=unknown.distribution,
        source=unknown.source,
    )
    return (
        ErrorTerm("span's temperature coefficient", "gain", (range_left,), "1"),
        ErrorTerm("span over temperature", "gain", (known,), "1"),
    )


def accelerometer_error_terms(rig: Rig) -> tuple[ErrorTerm, ...]:
    """Return the error terms of the accelerometer; an axis ends the name of what it has alone."""
    errors = rig.sensors.accelerometer.errors
    calibration = rig.calibrations.accelerometer
    if calibration is None:
        sensitivity, rotation = errors.sensitivity, errors.alignment
        zero_g = dict.fromkeys(AXES, errors.zero_g)
        couplings = tuple(
            ErrorTerm(f"cross axis {a}{b}", "coupling", (errors.cross_axis,), "1")
            for a in AXES
            for b in AXES
            if a != b
        )
    else:  # six positions show coupling and zero; what is left are the calibration's own errors
        sensitivity, rotation = calibration.sensitivity_error, calibration.alignment_error
        zero_g = {a: getattr(calibration, a).zero_g_error or calibration.zero_g_error for a in AXES}
        couplings = ()
    drift = (errors.zero_g_temperature, errors.temperature_since_calibration)
    return (
        *(ErrorTerm(f"sensitivity {a}", "sensitivity", (sensitivity,), "1") for a in AXES),
        *(ErrorTerm(f"zero g {a}", "zero_g", (zero_g[a],), "V") for a in AXES),
        *(ErrorTerm(f"zero g over temperature {a}", "zero_g", drift, "V") for a in AXES),
        # Zero and sensitivity of all axes are shares of one supply at the end of a cable.
        ErrorTerm("supply ratio", "supply", (errors.supply_ratio,), "1"),
        *(
            ErrorTerm(f"nonlinearity {a}", "nonlinearity", (errors.nonlinearity,), "m/s^2")
            for a in AXES
        ),
        *couplings,
        *(ErrorTerm(f"alignment about {a}", "rotation", (rotation,), "rad") for a in AXES),
    )


def _relative_limit(quantity: Quantity) -> Tolerance:
    """Return a quantity's range as a relative tolerance: half its width, anywhere within."""
    low, high = quantity.range or (quantity.value, quantity.value)
    half_width = (high - low) / 2.0 / quantity.value
    return Tolerance(value=half_width, unit="1", basis="derived", source=quantity.source)
