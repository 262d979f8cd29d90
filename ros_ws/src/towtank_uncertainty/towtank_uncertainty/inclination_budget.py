# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budget of the accelerometer as an inclinometer (GUM, JCGM 100:2008).

Combination is of first order, root of the sum of squares, and expanded uncertainties are
half-widths of 95 % intervals of the errors' own distributions (towtank_uncertainty.intervals).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from towtank_rig.conversion import pitch as pitch_of
from towtank_rig.conversion import roll as roll_of
from towtank_rig.conversion import rotation
from towtank_rig.schema import Rig

from towtank_uncertainty.error_terms import ErrorTerm, accelerometer_error_terms, distribution_of
from towtank_uncertainty.intervals import (
    Distribution,
    Normal,
    Oscillation,
    Product,
    Rectangular,
    Scaled,
    half_width,
)
from towtank_uncertainty.sensor_errors import realise


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
