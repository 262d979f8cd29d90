# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budgets of depth, heave amplitude, heave ratio and inclination (GUM, JCGM 100:2008).

Each error term of a sensor is a component with its standard uncertainty (k = 1) and what it does to
the results. Three kinds matter to a heave trial:

* gain-like components scale the amplitude;
* components of the zero shift absolute depth only, and most of them vanish by zeroing;
* components that both pressure sensors share (density, gravity, the ADC's reference) scale both
  amplitudes alike and cancel in the ratio.

Combination is of first order, root of the sum of squares. Expanded uncertainties are half-widths of
95 % intervals of the errors' own distributions (towtank_rig.coverage): most are rectangular, and
1.96 standard uncertainties of a sum of few of those hold more than 95 %.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank_rig.conversion import pitch as pitch_of
from towtank_rig.conversion import pressure_conversion, rotation
from towtank_rig.conversion import roll as roll_of
from towtank_rig.coverage import (
    Distribution,
    Normal,
    Oscillation,
    Product,
    Rectangular,
    Scaled,
    half_width,
)
from towtank_rig.error_terms import (
    ErrorTerm,
    PressureEffect,
    accelerometer_error_terms,
    distribution_of,
    pressure_error_terms,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.quantity import NORMAL_95
from towtank_rig.schema import Rig
from towtank_rig.sensor_errors import realise

COVERAGE = NORMAL_95


@dataclass(frozen=True, slots=True)
class SampleUncertainty:
    """Standard uncertainties (k = 1) by scatter (A) and by the rig's budget (B), and the half-width
    of the 95 % interval; in the sample's unit."""

    type_a: float
    type_b: float
    u95: float

    @property
    def combined(self) -> float:
        """Standard uncertainty, type A and B."""
        return math.hypot(self.type_a, self.type_b)


UNKNOWN = SampleUncertainty(math.nan, math.nan, math.nan)
"""Of a sample that is not known, or whose circumstances are not."""


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
        return _distributions(self.components, effect)

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


def _distributions(components: Sequence[Component], effect: Effect) -> tuple[Distribution, ...]:
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


def ratio_components(fish: SensorBudget, depressor: SensorBudget) -> tuple[Component, ...]:
    """Return the components of fish amplitude over depressor amplitude, by their ``gain``.

    The name of what one sensor has for itself ends with the sensor's. A shared component acts by
    the difference of its two effects.
    """
    others = {c.name: c for c in depressor.components if c.shared}
    own = [
        replace(c, name=f"{c.name}, {budget.sensor}")
        for budget in (fish, depressor)
        for c in budget.components
        if not c.shared
    ]
    both = []
    for c in fish.components:
        if c.shared:
            other = others.pop(c.name, None)
            both.append(replace(c, gain=abs(c.gain - other.gain) if other else c.gain))
    return (*own, *both, *others.values())


def ratio_relative_uncertainty(fish: SensorBudget, depressor: SensorBudget) -> float:
    """Return the relative standard uncertainty of fish amplitude over depressor amplitude.

    Systematic components only; each amplitude's noise comes on top (``amplitude_noise``).
    """
    return math.hypot(*(c.gain for c in ratio_components(fish, depressor)))


def ratio_errors(fish: SensorBudget, depressor: SensorBudget) -> tuple[Distribution, ...]:
    """Return the distributions of the relative errors of the ratio."""
    return _distributions(ratio_components(fish, depressor), lambda c: c.gain)


@dataclass(frozen=True)
class InclinationComponent:
    """One line of an inclination budget; all figures are standard uncertainties.

    Attributes:
        name: The error's name.
        value: In the error's own unit.
        unit: Of value.
        pitch: Effect on pitch, rad.
        roll: Effect on roll, rad.
        distribution: Of the error, scaled to a deviation of 1.
        source: Where the tolerance comes from.
    """

    name: str
    value: float
    unit: str
    pitch: float
    roll: float
    distribution: Distribution
    source: str = ""


@dataclass(frozen=True)
class InclinationBudget:
    """Budget of pitch and roll.

    Attributes:
        components: Systematic components.
        pitch_noise: Standard deviation of one sample, rad.
        roll_noise: Standard deviation of one sample, rad.
        force_covariance: Of the specific force in fish axes, noise aside, (m/s²)², shape (3, 3).
    """

    components: tuple[InclinationComponent, ...]
    pitch_noise: float
    roll_noise: float
    force_covariance: NDArray[np.float64]

    @property
    def pitch(self) -> float:
        """Return the standard uncertainty of pitch, noise aside, rad."""
        return math.hypot(*(c.pitch for c in self.components))

    @property
    def roll(self) -> float:
        """Return the standard uncertainty of roll, noise aside, rad."""
        return math.hypot(*(c.roll for c in self.components))

    @property
    def pitch_errors(self) -> tuple[Distribution, ...]:
        """Return the distributions of the errors of pitch, noise aside, rad."""
        return tuple(Scaled(c.pitch, c.distribution) for c in self.components)

    def pitch_u95(self, noise: float = 0.0) -> float:
        """Return half the 95 % interval of pitch, rad; noise: its standard deviation, rad."""
        return half_width((*self.pitch_errors, Normal(noise)))

    def roll_u95(self, noise: float = 0.0) -> float:
        """Return half the 95 % interval of roll, rad; noise: its standard deviation, rad."""
        errors = (Scaled(c.roll, c.distribution) for c in self.components)
        return half_width((*errors, Normal(noise)))


def inclination_budget(
    rig: Rig,
    pitch: float = 0.0,
    roll: float = 0.0,
    crank_rate: float = 0.0,
    carriage_acceleration: float = 0.0,
) -> InclinationBudget:
    """Return the budget of the accelerometer as an inclinometer at an attitude (rad, REP-103).

    Acceleration along the tank tilts the specific force and cannot be told from an inclination.
    While the crank turns (crank_rate, rad/s) the fish surges with it, by the limit that the rig
    gives for the speed past its port. What the carriage's own acceleration (m/s²) does to the fish
    at the end of its line is not known; it counts as a limit.

    Sensitivities are differences of the sensor's model, as GUM 5.1.3 allows.
    """
    upright = np.array([0.0, 0.0, rig.water.gravity.value])
    to_fish = rotation(roll, pitch, 0.0).T
    terms = accelerometer_error_terms(rig)
    readings = _readings(rig, to_fish @ upright, terms)
    components = [
        _inclination_component(term, *pair) for term, pair in zip(terms, readings, strict=True)
    ]
    shifts = (readings[:, 0] - readings[:, 1]) / 2.0
    for name, distribution, source in _accelerations(rig, crank_rate, carriage_acceleration):
        u = distribution.deviation
        along = np.array([u, 0.0, 0.0])
        above, below = to_fish @ (upright + along), to_fish @ (upright - along)
        unit = Scaled(1.0 / u, distribution)
        components.append(_attitudes(name, u, "m/s^2", above, below, unit, source))
    # Noise of each axis in m/s² turns the vector by noise/g; roll turns about a shortened arm.
    sensitivity = rig.sensors.accelerometer.sensitivity.value
    noise = rig.sensors.accelerometer.errors.noise.value / sensitivity / upright[2]
    return InclinationBudget(tuple(components), noise, noise / math.cos(pitch), shifts.T @ shifts)


def _readings(
    rig: Rig, force: NDArray[np.float64], terms: Sequence[ErrorTerm]
) -> NDArray[np.float64]:
    """Return the specific force that the sensor reads under ``force`` with one error alone.

    Shape (terms, 2, 3): with the error at plus and at minus one standard uncertainty.
    """
    errors = {}
    for number, term in enumerate(terms):
        values = np.zeros((len(terms), 2))
        values[number] = term.standard_uncertainty, -term.standard_uncertainty
        errors[f"accelerometer/{term.name}"] = values
    excitation = rig.board.excitation.value
    sensor = realise(rig, errors, excitation=excitation, noise_scale=0.0).accelerometer
    return sensor.conversion.specific_force(sensor.volts(force))


def _accelerations(
    rig: Rig, crank_rate: float, carriage_acceleration: float
) -> list[tuple[str, Distribution, str]]:
    """Return what accelerates the fish along the tank: name, distribution in m/s², source."""
    surge = rig.sensors.fish_pressure.errors.surge_speed
    found: list[tuple[str, Distribution, str]] = []
    if crank_rate != 0.0 and surge.value > 0.0:
        amplitude = Scaled(abs(crank_rate), distribution_of(surge))
        found.append(("surge", Product(amplitude, Oscillation(1.0)), surge.source))
    if carriage_acceleration != 0.0:
        limit = Rectangular(abs(carriage_acceleration))
        found.append(("carriage acceleration", limit, "measured by its encoder"))
    return found


def _inclination_component(
    term: ErrorTerm, above: NDArray[np.float64], below: NDArray[np.float64]
) -> InclinationComponent:
    u = term.standard_uncertainty
    unit = Scaled(1.0 / u, term.distribution) if u > 0.0 else Normal(1.0)
    return _attitudes(term.name, u, term.unit, above, below, unit, term.source)


def _attitudes(
    name: str,
    value: float,
    unit: str,
    above: NDArray[np.float64],
    below: NDArray[np.float64],
    distribution: Distribution,
    source: str,
) -> InclinationComponent:
    """Return the component of two forces that lie a standard uncertainty to both sides."""
    pitches, rolls = (
        abs(math.remainder(float(f(above) - f(below)), 2.0 * math.pi)) / 2.0
        for f in (pitch_of, roll_of)
    )
    return InclinationComponent(name, value, unit, pitches, rolls, distribution, source)


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
