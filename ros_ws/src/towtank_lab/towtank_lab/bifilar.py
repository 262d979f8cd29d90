# SPDX-License-Identifier: Apache-2.0
"""Moment of inertia from a bifilar suspension.

The body hangs level from two vertical strings of length L, a distance l apart, and turns to and fro
about the vertical through its centre of gravity. For small swings

    I = m g a b T² / (4 π² L),    a + b = l,

a and b being the distances of the strings from the centre of gravity; with a = b = l/2 the radius
of gyration is k = (l T / 4π) √(g/L). (The thesis of P. P. Lalu prints √(g l) T / (4π √L), its
equation 8.1: that is no length.)

A swing of amplitude A is slower by 1 + A² (3β/2 + ε/4), β = 1/24 − a²/(8 L²), ε = a⁴/(k² L²): the
string's rise gives the potential m g (a²/L) (θ²/2 − β θ⁴), the body's own rise the kinetic energy
½ I (1 + ε θ²) θ̇², and averaging the Lagrangian over θ = A cos ωt the shift of ω.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, model_validator
from towtank_rig.quantity import SI, Quantity, Section, rig_fault
from towtank_rig.tow import Length, Mass

from towtank_lab.propagation import Propagated, mean_of, propagate, within_range

Duration = Annotated[Quantity, SI("s", gt=0)]


class Cylinder(Section):
    """A solid, even cylinder."""

    length: Length
    diameter: Length


class Suspension(Section):
    """A file of `towtank inertia`. A quantity's range is the limits of its uncertainty.

    ``offset`` is the distance of the centre of gravity from midway between the strings,
    ``amplitude`` the mean amplitude of the timed swings; each of ``times`` is for as many whole
    ``oscillations``. ``timing`` is the clock's or the reaction's error of a whole time, common to
    all. ``cylinder`` is there if the body is one, solid and even: theory then stands beside.
    """

    name: str
    description: str = ""
    mass: Mass
    gravity: Annotated[Quantity, SI("m/s^2", gt=0)]
    string_length: Length
    string_distance: Length
    offset: Annotated[Quantity, SI("m")] = Quantity(value=0.0, unit="m")
    amplitude: Annotated[Quantity, SI("rad", ge=0, le=1)] = Quantity(value=0.0, unit="rad")
    oscillations: int = Field(ge=1)
    times: tuple[Duration, ...] = Field(min_length=2)
    timing: Annotated[Quantity, SI("s", ge=0)] = Quantity(value=0.0, unit="s")
    cylinder: Cylinder | None = None

    @model_validator(mode="after")
    def _hangs(self) -> Suspension:
        if abs(self.offset.value) >= self.string_distance.value / 2.0:
            raise rig_fault("the centre of gravity lies beyond a string", "correct it", at="offset")
        return self


@dataclass(frozen=True)
class Inertia:
    """What a suspension tells: inertia (kg m²), radius of gyration (m), period (s), all at small
    swings. theory: of the even cylinder, kg m², or None. notes: what limits the result."""

    inertia: Propagated
    radius_of_gyration: Propagated
    period: Propagated
    theory: float | None
    notes: tuple[str, ...]


def small_swing_inertia(
    mass: float, gravity: float, length: float, distance: float, offset: float, period: float
) -> float:
    """Return I in kg m² from the period (s) of small swings; lengths in m."""
    product = (distance / 2.0) ** 2 - offset**2
    return mass * gravity * product * period**2 / (4.0 * math.pi**2 * length)


def slowing(amplitude: float, arm: float, length: float, radius_of_gyration: float) -> float:
    """Return period at an amplitude (rad) over that of small swings, to the amplitude's square.

    arm: half the strings' distance; length: of the strings; all in m.
    """
    beta = 1.0 / 24.0 - arm**2 / (8.0 * length**2)
    epsilon = arm**4 / (radius_of_gyration * length) ** 2
    return 1.0 + amplitude**2 * (1.5 * beta + 0.25 * epsilon)


def solid_cylinder_inertia(mass: float, length: float, diameter: float) -> float:
    """Return the inertia about a diameter through the middle, kg m²: m r²/4 + m L²/12."""
    return mass * (diameter**2 / 16.0 + length**2 / 12.0)


def evaluate(suspension: Suspension) -> Inertia:
    """Return inertia, radius of gyration and period with their uncertainties."""
    mean = mean_of([time.value for time in suspension.times], "time")
    timing = suspension.timing.value
    inputs = {
        "mass": within_range(suspension.mass),
        "gravity": within_range(suspension.gravity),
        "string_length": within_range(suspension.string_length),
        "string_distance": within_range(suspension.string_distance),
        "offset": within_range(suspension.offset),
        "amplitude": within_range(suspension.amplitude),
        "scatter_of_times": mean,
        "timing": within_range(Quantity(value=0.0, unit="s", range=(-timing, timing))),
    }

    def period(given: Mapping[str, float]) -> float:
        timed = (given["scatter_of_times"] + given["timing"]) / suspension.oscillations
        arm, length = given["string_distance"] / 2.0, given["string_length"]
        # What slows a swing depends on k by little: the k of the uncorrected period will do.
        k = arm * timed / (2.0 * math.pi) * math.sqrt(given["gravity"] / length)
        return timed / slowing(given["amplitude"], arm, length, k)

    def inertia(given: Mapping[str, float]) -> float:
        return small_swing_inertia(
            given["mass"],
            given["gravity"],
            given["string_length"],
            given["string_distance"],
            given["offset"],
            period(given),
        )

    return Inertia(
        propagate(inertia, inputs),
        propagate(lambda given: math.sqrt(inertia(given) / given["mass"]), inputs),
        propagate(period, inputs),
        _theory(suspension),
        tuple(_notes(suspension)),
    )


def _theory(suspension: Suspension) -> float | None:
    if suspension.cylinder is None:
        return None
    length, diameter = suspension.cylinder.length.value, suspension.cylinder.diameter.value
    return solid_cylinder_inertia(suspension.mass.value, length, diameter)


def _notes(suspension: Suspension) -> list[str]:
    notes = []
    ratio = suspension.string_length.value / suspension.string_distance.value
    if ratio < 3.0:
        notes.append(
            f"the strings are {ratio:.2g} times as long as they are apart: 3 or more keeps their "
            "slope small"
        )
    if suspension.amplitude.value > 0.2:
        notes.append(
            f"swings of {math.degrees(suspension.amplitude.value):.0f} deg are corrected to their "
            "square only: stay below 11 deg"
        )
    return notes
