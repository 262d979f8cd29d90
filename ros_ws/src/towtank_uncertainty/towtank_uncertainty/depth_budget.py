# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budget of depth and heave amplitude by one pressure sensor (GUM, JCGM 100:2008).

Each error term of a sensor is a component with its standard uncertainty (k = 1) and what it does to
the results. Two kinds matter to a heave trial:

* gain-like components scale the amplitude;
* components of the zero shift absolute depth only, and most of them vanish by zeroing.

Combination is of first order, root of the sum of squares. Expanded uncertainties are half-widths of
95 % intervals of the errors' own distributions (towtank_uncertainty.intervals): most are
rectangular, and 1.96 standard uncertainties of a sum of few of those hold more than 95 %.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from towtank_rig.conversion import pressure_conversion
from towtank_rig.instruments import PressureSensorName
from towtank_rig.schema import Rig

from towtank_uncertainty.error_terms import (
    ErrorTerm,
    PressureEffect,
    distribution_of,
    pressure_error_terms,
)
from towtank_uncertainty.intervals import (
    Distribution,
    Normal,
    Oscillation,
    Product,
    Scaled,
    half_width,
)


@dataclass(frozen=True)
class OperatingPoint:
    """Where a depth budget holds.

    Attributes:
        mean_depth: Depth below still water, m.
        amplitude: Heave amplitude, m, positive.
        speed: Speed of the water past the port, m/s.
        zeroed_at: Depth below still water at which the sensor was zeroed, m.
    """

    mean_depth: float
    amplitude: float
    speed: float
    zeroed_at: float = 0.0


@dataclass(frozen=True)
class Component:
    """One line of a depth budget; all figures are standard uncertainties.

    Attributes:
        name: The error's name.
        effect: How the sensor feels it.
        value: In the error's own unit.
        unit: Of value.
        distribution: Of the error, in its own unit.
        gain: Relative effect on the heave amplitude.
        depth: Effect on the depth below the place of zeroing, m.
        absolute_depth: Effect on the depth below still water that an unzeroed sensor gives, m.
        shared: True if the other pressure sensor has the same error.
        source: Where the tolerance comes from.
    """

    name: str
    effect: PressureEffect
    value: float
    unit: str
    distribution: Distribution
    gain: float = 0.0
    depth: float = 0.0
    absolute_depth: float = 0.0
    shared: bool = False
    source: str = ""


Effect = Callable[[Component], float]


@dataclass(frozen=True)
class SensorBudget:
    """Budget of one pressure channel at one operating point.

    Attributes:
        sensor: Name of the sensor in the rig.
        at: The operating point.
        components: Systematic components.
        noise: Standard deviation of one sample's white noise, m.
    """

    sensor: PressureSensorName
    at: OperatingPoint
    components: tuple[Component, ...]
    noise: float

    @property
    def gain(self) -> float:
        """Return the relative standard uncertainty of the amplitude, noise aside."""
        return math.hypot(*(c.gain for c in self.components))

    @property
    def depth(self) -> float:
        """Return the standard uncertainty of depth after zeroing, noise aside, m."""
        return math.hypot(*(c.depth for c in self.components))

    @property
    def depth_before_zeroing(self) -> float:
        """Return the standard uncertainty of absolute depth without zeroing, noise aside, m."""
        return math.hypot(*(c.absolute_depth for c in self.components))

    @property
    def head_before_zeroing(self) -> float:
        """Return the standard uncertainty of the pressure at the port, noise aside, as m of water.

        What makes a pressure another depth (water, flow) is no error of the pressure.
        """
        others = ("water", "flow", "surge")
        return math.hypot(*(c.absolute_depth for c in self.components if c.effect not in others))

    def errors(self, effect: Effect) -> tuple[Distribution, ...]:
        """Return the distributions of one kind of effect: ``lambda c: c.depth``, say."""
        return distributions(self.components, effect)

    def depth_u95(self, noise: float = 0.0) -> float:
        """Return half the 95 % interval of a zeroed depth, m; noise: its standard deviation, m."""
        return half_width((*self.errors(lambda c: c.depth), Normal(noise)))

    def depth_before_zeroing_u95(self, noise: float = 0.0) -> float:
        """Return half the 95 % interval of an absolute depth, m; noise: standard deviation, m."""
        return half_width((*self.errors(lambda c: c.absolute_depth), Normal(noise)))

    def amplitude(self, samples: int) -> float:
        """Return the standard uncertainty in m of the amplitude fitted to that many samples."""
        return math.hypot(self.gain * self.at.amplitude, amplitude_noise(self.noise, samples))

    def rows(self) -> list[dict[str, object]]:
        """Return the budget as a table, largest effect on the amplitude first, the sum last.

        Keys: name, standard_uncertainty, unit, amplitude_percent, depth_mm (after zeroing),
        absolute_depth_mm (without), shared, source.
        """
        ordered = sorted(self.components, key=lambda c: (c.gain, c.depth), reverse=True)
        rows: list[dict[str, object]] = [
            {
                "name": c.name,
                "standard_uncertainty": c.value,
                "unit": c.unit,
                "amplitude_percent": 100.0 * c.gain,
                "depth_mm": 1000.0 * c.depth,
                "absolute_depth_mm": 1000.0 * c.absolute_depth,
                "shared": c.shared,
                "source": c.source,
            }
            for c in ordered
        ]
        total = {
            "name": "combined",
            "standard_uncertainty": math.nan,
            "unit": "",
            "amplitude_percent": 100.0 * self.gain,
            "depth_mm": 1000.0 * self.depth,
            "absolute_depth_mm": 1000.0 * self.depth_before_zeroing,
            "shared": False,
            "source": "",
        }
        return [*rows, total]


def distributions(components: Sequence[Component], effect: Effect) -> tuple[Distribution, ...]:
    """Return the distributions of what the components do, by one kind of effect."""
    return tuple(
        Scaled(effect(c) / c.value, c.distribution) for c in components if effect(c) != 0.0
    )


def amplitude_noise(noise: float, samples: int) -> float:
    """Return the standard deviation of a harmonic's amplitude fitted over whole periods.

    Least squares on ``samples`` even samples with white noise: noise·√(2/samples).
    """
    return noise * math.sqrt(2.0 / samples)


def depth_budget(
    rig: Rig, sensor: PressureSensorName, at: OperatingPoint, board_noise: float = 0.0
) -> SensorBudget:
    """Return the budget of one pressure channel.

    Args:
        rig: The rig.
        sensor: Which sensor.
        at: Operating point; the amplitude must be positive.
        board_noise: Noise of amplifier and ADC, quantisation included, as the standard deviation
            of one sample in V at the sensor's terminals. It comes on top of the sensor's.

    Raises:
        ValueError: amplitude not positive.
    """
    if at.amplitude <= 0.0:
        raise ValueError(f"heave amplitude is {at.amplitude} m; it must be positive")
    given = getattr(rig.sensors, sensor)
    weight = rig.water.density.value * rig.water.gravity.value  # Pa/m
    full_scale = given.full_scale.value
    calibration = getattr(rig.calibrations, sensor)
    span = pressure_conversion(rig, sensor).span
    metres_per_volt = full_scale / span / weight  # at the reference excitation
    fitted = (calibration.fitted_range if calibration else given.full_scale).value
    head = 0.5 * rig.water.density.value * at.speed**2 / weight  # m
    way = at.mean_depth - at.zeroed_at

    # The parabola of a non-linear sensor passes zero and the end of the fitted range; its slope at
    # the mean depth is what the amplitude feels.
    def bend(depth: float) -> float:
        pressure = weight * depth
        return 4.0 * pressure * (fitted - pressure) / full_scale / weight

    bend_slope = 4.0 * (fitted - 2.0 * weight * at.mean_depth) / full_scale
    # Of one unit of each kind of error: gain, depth after zeroing, depth without it
    sensitivity: dict[PressureEffect, tuple[float, float, float]] = {
        "gain": (1.0, way, at.mean_depth),
        "water": (1.0, way, at.mean_depth),
        "linearity": (bend_slope, bend(at.mean_depth) - bend(at.zeroed_at), bend(at.mean_depth)),
        "zero_offset": (0.0, 0.0, metres_per_volt),
        "zero_drift": (0.0, metres_per_volt, metres_per_volt),
        "flow": (0.0, head, head),
    }
    components = [
        _component(term, sensitivity[term.effect]) for term in pressure_error_terms(rig, sensor)
    ]
    components.append(_surge_component(rig, sensor, at))
    components.append(_hum_component(rig, sensor, at, metres_per_volt))
    # Volts at the terminals are those at the board's excitation.
    reference = given.reference_excitation.value / rig.board.excitation.value
    noise = math.hypot(given.errors.noise.value, board_noise) * reference * metres_per_volt
    return SensorBudget(sensor, at, tuple(components), noise)


def _component(term: ErrorTerm, sensitivity: tuple[float, float, float]) -> Component:
    u = term.standard_uncertainty
    gain, depth, absolute = (abs(s) * u for s in sensitivity)
    return Component(
        term.name,
        term.effect,
        u,
        term.unit,
        term.distribution,
        gain,
        depth,
        absolute,
        term.shared,
        term.source,
    )


def _surge_component(rig: Rig, sensor: PressureSensorName, at: OperatingPoint) -> Component:
    """Return the effect of a speed past the port that oscillates in phase with heave.

    d(Cp·½ρU²) = Cp·ρ·U·dU; Cp counts with its error, for the surge is not measured. The amplitude
    feels all of it, a depth what there is of it at its instant.
    """
    given = getattr(rig.sensors, sensor)
    surge, error = given.errors.surge_speed, given.errors.flow_coefficient
    per_speed = at.speed / rig.water.gravity.value  # m of water per Cp and m/s
    distribution = Product(
        distribution_of(surge), distribution_of(error), given.flow_coefficient.value
    )
    oscillation = distribution.deviation * per_speed  # m
    return Component(
        "surge",
        "surge",
        surge.standard_uncertainty,
        surge.unit,
        Scaled(_ratio(surge.standard_uncertainty, distribution.deviation), distribution),
        gain=oscillation / at.amplitude,
        # 2·dU/U of the steady flow's error: too little for its shape to matter
        depth=oscillation / math.sqrt(2.0),
        absolute_depth=oscillation / math.sqrt(2.0),
        source=surge.source,
    )


def _hum_component(
    rig: Rig, sensor: PressureSensorName, at: OperatingPoint, metres_per_volt: float
) -> Component:
    """Return the effect of mains hum that the scan rate folds onto the crank's own frequency.

    Its phase against heave is anything; a depth has it at any instant. metres_per_volt: at the
    reference excitation.
    """
    given = getattr(rig.sensors, sensor)
    hum = given.errors.hum
    distribution = Product(distribution_of(hum), Oscillation(1.0))
    reference = given.reference_excitation.value / rig.board.excitation.value
    depth = distribution.deviation * reference * metres_per_volt
    return Component(
        "hum",
        "hum",
        hum.standard_uncertainty,
        hum.unit,
        Scaled(_ratio(hum.standard_uncertainty, distribution.deviation), distribution),
        gain=depth / at.amplitude,
        depth=depth,
        absolute_depth=depth,
        source=hum.source,
    )


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else 0.0
