# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budgets of depth, heave amplitude, heave ratio and inclination (GUM, JCGM 100:2008).

Each error term of a sensor is a component with its standard uncertainty (k = 1) and what it does to
the results. Three kinds matter to a heave trial:

* gain-like components scale the amplitude;
* components of the zero shift absolute depth only, and most of them vanish by zeroing;
* components that both pressure sensors share (density, gravity, the ADC's reference) scale both
  amplitudes alike and cancel in the ratio.

Combination is of first order, root of the sum of squares. Expanded uncertainties are at 95 %,
``COVERAGE`` times the standard uncertainty.
"""

import math
from dataclasses import dataclass

import numpy as np

from towtank_rig.conversion import pitch as pitch_of
from towtank_rig.conversion import roll as roll_of
from towtank_rig.conversion import rotation
from towtank_rig.error_terms import (
    ErrorTerm,
    PressureEffect,
    accelerometer_error_terms,
    pressure_error_terms,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.quantity import NORMAL_95
from towtank_rig.schema import Rig
from towtank_rig.sensor_errors import realise

COVERAGE = NORMAL_95


@dataclass(frozen=True)
class OperatingPoint:
    """Where a depth budget holds.

    Attributes:
        mean_depth: Depth below the place of zeroing (still water by default), m.
        amplitude: Heave amplitude, m, positive.
        speed: Speed of the water past the port, m/s.
    """

    mean_depth: float
    amplitude: float
    speed: float


@dataclass(frozen=True)
class Component:
    """One line of a depth budget; all figures are standard uncertainties.

    Attributes:
        name: The error's name.
        value: In the error's own unit.
        unit: Of value.
        gain: Relative effect on the heave amplitude.
        depth: Effect on absolute depth after zeroing, m.
        removed_depth: Effect on absolute depth that zeroing removes, m.
        shared: True if the other pressure sensor has the same error.
        source: Where the tolerance comes from.
    """

    name: str
    value: float
    unit: str
    gain: float = 0.0
    depth: float = 0.0
    removed_depth: float = 0.0
    shared: bool = False
    source: str = ""


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
        """Return the standard uncertainty of absolute depth after zeroing, noise aside, m."""
        return math.hypot(*(c.depth for c in self.components))

    @property
    def depth_before_zeroing(self) -> float:
        """Return the standard uncertainty of absolute depth without zeroing, noise aside, m."""
        parts = ((c.depth, c.removed_depth) for c in self.components)
        return math.hypot(*(part for pair in parts for part in pair))

    def amplitude(self, samples: int) -> float:
        """Return the standard uncertainty in m of the amplitude fitted to that many samples."""
        return math.hypot(self.gain * self.at.amplitude, amplitude_noise(self.noise, samples))

    def rows(self) -> list[dict[str, object]]:
        """Return the budget as a table, largest effect on the amplitude first, the sum last.

        Keys: name, standard_uncertainty, unit, amplitude_percent, depth_mm (after zeroing),
        removed_depth_mm, shared, source.
        """
        ordered = sorted(self.components, key=lambda c: (c.gain, c.depth), reverse=True)
        total = Component(
            "combined",
            math.nan,
            "",
            self.gain,
            self.depth,
            math.hypot(*(c.removed_depth for c in self.components)),
        )
        return [
            {
                "name": c.name,
                "standard_uncertainty": c.value,
                "unit": c.unit,
                "amplitude_percent": 100.0 * c.gain,
                "depth_mm": 1000.0 * c.depth,
                "removed_depth_mm": 1000.0 * c.removed_depth,
                "shared": c.shared,
                "source": c.source,
            }
            for c in (*ordered, total)
        ]


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
    pressure = weight * at.mean_depth
    full_scale = given.full_scale.value
    calibration = getattr(rig.calibrations, sensor)
    line = calibration or given
    metres_per_volt = full_scale / line.span.value / weight  # at the reference excitation
    fitted = (calibration.fitted_range if calibration else given.full_scale).value
    head = 0.5 * rig.water.density.value * at.speed**2 / weight  # m

    # Sensitivities (gain, depth, removed depth) of one unit of each kind of error. The parabola of
    # a non-linear sensor passes zero and the end of the fitted range; its slope at the mean depth
    # is what the amplitude feels.
    bend = 4.0 * pressure * (fitted - pressure) / full_scale
    bend_slope = 4.0 * (fitted - 2.0 * pressure) / full_scale
    sensitivity: dict[PressureEffect, tuple[float, float, float]] = {
        "gain": (1.0, at.mean_depth, 0.0),
        "water": (1.0, at.mean_depth, 0.0),
        "linearity": (bend_slope, bend / weight, 0.0),
        "zero_offset": (0.0, 0.0, metres_per_volt),
        "zero_drift": (0.0, metres_per_volt, 0.0),
        "flow": (0.0, head, 0.0),
    }
    components = [
        _component(term, sensitivity[term.effect]) for term in pressure_error_terms(rig, sensor)
    ]
    components.append(_surge_component(rig, sensor, at))
    # Volts at the terminals are those at the board's excitation.
    reference = given.reference_excitation.value / rig.board.excitation.value
    noise = math.hypot(given.errors.noise.value, board_noise) * reference * metres_per_volt
    return SensorBudget(sensor, at, tuple(components), noise)


def ratio_relative_uncertainty(fish: SensorBudget, depressor: SensorBudget) -> float:
    """Return the relative standard uncertainty of fish amplitude over depressor amplitude.

    Systematic components only; each amplitude's noise comes on top (``amplitude_noise``). A shared
    component acts by the difference of its two effects.
    """
    others = {c.name: c.gain for c in depressor.components if c.shared}
    own = [c.gain for b in (fish, depressor) for c in b.components if not c.shared]
    both = [c.gain - others.pop(c.name, 0.0) for c in fish.components if c.shared]
    return math.hypot(*own, *both, *others.values())


@dataclass(frozen=True)
class InclinationComponent:
    """One line of an inclination budget: standard uncertainties in rad."""

    name: str
    pitch: float
    roll: float
    source: str = ""


@dataclass(frozen=True)
class InclinationBudget:
    """Static budget of pitch and roll; accelerations along the hull are not in it.

    Attributes:
        components: Systematic components.
        pitch_noise: Standard deviation of one sample, rad.
        roll_noise: Standard deviation of one sample, rad.
    """

    components: tuple[InclinationComponent, ...]
    pitch_noise: float
    roll_noise: float

    @property
    def pitch(self) -> float:
        """Return the standard uncertainty of pitch, noise aside, rad."""
        return math.hypot(*(c.pitch for c in self.components))

    @property
    def roll(self) -> float:
        """Return the standard uncertainty of roll, noise aside, rad."""
        return math.hypot(*(c.roll for c in self.components))


def inclination_budget(rig: Rig, pitch: float = 0.0, roll: float = 0.0) -> InclinationBudget:
    """Return the budget of the accelerometer as an inclinometer at an attitude (rad, REP-103).

    Sensitivities are differences of the sensor's model, as GUM 5.1.3 allows.
    """
    upright = np.array([0.0, 0.0, rig.water.gravity.value])
    force = rotation(roll, pitch, 0.0).T @ upright
    components = []
    for term in accelerometer_error_terms(rig):
        u = term.standard_uncertainty
        above, below = (_attitude(rig, force, {f"accelerometer/{term.name}": s}) for s in (u, -u))
        effect = np.abs(above - below) / 2.0
        components.append(
            InclinationComponent(term.name, float(effect[0]), float(effect[1]), term.source)
        )
    # Noise of each axis in m/s² turns the vector by noise/g; roll turns about a shortened arm.
    sensitivity = rig.sensors.accelerometer.sensitivity.value
    noise = rig.sensors.accelerometer.errors.noise.value / sensitivity / upright[2]
    return InclinationBudget(tuple(components), noise, noise / math.cos(pitch))


def _attitude(rig: Rig, force: np.ndarray, errors: dict[str, float]) -> np.ndarray:
    """Return (pitch, roll) that the sensor with these errors reads under ``force``."""
    excitation = rig.board.excitation.value
    sensor = realise(rig, errors, excitation=excitation, noise_scale=0.0).accelerometer
    read = sensor.conversion.specific_force(sensor.volts(force))
    return np.array([pitch_of(read), roll_of(read)])


def _component(term: ErrorTerm, sensitivity: tuple[float, float, float]) -> Component:
    u = term.standard_uncertainty
    gain, depth, removed = (abs(s) * u for s in sensitivity)
    return Component(term.name, u, term.unit, gain, depth, removed, term.shared, term.source)


def _surge_component(rig: Rig, sensor: PressureSensorName, at: OperatingPoint) -> Component:
    """Return the effect of a speed past the port that oscillates in phase with heave.

    d(Cp·½ρU²) = Cp·ρ·U·dU; Cp counts with its error, for the surge is not measured.
    """
    given = getattr(rig.sensors, sensor)
    surge = given.errors.surge_speed
    u = surge.standard_uncertainty
    cp = math.hypot(
        given.flow_coefficient.value, given.errors.flow_coefficient.standard_uncertainty
    )
    oscillation = cp * at.speed * u / rig.water.gravity.value  # m
    return Component("surge", u, surge.unit, gain=oscillation / at.amplitude, source=surge.source)
