# SPDX-License-Identifier: Apache-2.0
"""What Froude scaling does not scale, with numbers at both scales.

Similarity holds exactly for gravity, inertia, added mass and drag with coefficients that do not
change. What depends on viscosity, on the stuff of the cables, on surface tension, on the air's
pressure or on the instruments is another number at another scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from towtank_rig import Rig
from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget

from towtank_lab.fresh_water import ATMOSPHERE, surface_tension, vapour_pressure, viscosity


@dataclass(frozen=True)
class ScaleEffect:
    """A number that should be the same at both scales and is not.

    Attributes:
        name: What it is.
        original: Of the rig that was scaled.
        scaled: Of the scaled rig.
        unit: Unit of both; ``1`` for a dimensionless number.
        consequence: What it changes, and when it matters.
    """

    name: str
    original: float
    scaled: float
    unit: str
    consequence: str


def scale_effects(original: Rig, scaled: Rig, scale: float) -> list[ScaleEffect]:
    """Return what differs between a rig and its Froude-scaled copy (lengths times ``scale``)."""
    effects = [
        ScaleEffect(name, number(original), number(scaled), "1", consequence)
        for name, number, consequence in _NUMBERS
    ]
    stuff = [_of_the_same_stuff(*row, original, scaled, scale) for row in _STUFF]
    return effects + [effect for effect in stuff if effect.original != 0.0]


def _reynolds(rig: Rig, length: float) -> float:
    water = rig.water
    speed = rig.run.carriage_speed.value
    return water.density.value * speed * length / viscosity(water.temperature.value)


def _weber(rig: Rig) -> float:
    inertia = rig.water.density.value * rig.run.carriage_speed.value**2
    return inertia * rig.lines.primary.diameter.value / surface_tension(rig.water.temperature.value)


def _greatest_depth(rig: Rig) -> float:
    lines = rig.lines
    hung = lines.primary.length.value + lines.depressor.length.value
    return hung - rig.tow_point.height.value


def _hydrostatic(rig: Rig) -> float:
    return rig.water.density.value * rig.water.gravity.value * _greatest_depth(rig)


def _cavitation(rig: Rig) -> float:
    speed = rig.run.carriage_speed.value
    if speed == 0.0:
        return math.inf
    margin = ATMOSPHERE + _hydrostatic(rig) - vapour_pressure(rig.water.temperature.value)
    return margin / (0.5 * rig.water.density.value * speed**2)


def _noise(rig: Rig) -> float:
    radius = rig.tow_point.motion.crank_radius.value
    at = OperatingPoint(_greatest_depth(rig), radius or 1.0, rig.run.carriage_speed.value)
    return depth_budget(rig, "fish_pressure", at).noise / radius if radius else math.inf


def _samples(rig: Rig) -> float:
    rate = rig.run.crank_rate.value
    return rig.board.sample_rate.value * 2.0 * math.pi / rate if rate else math.inf


_NUMBERS: tuple[tuple[str, Callable[[Rig], float], str], ...] = (
    (
        "Reynolds number, primary line",
        lambda rig: _reynolds(rig, rig.lines.primary.diameter.value),
        "a smooth cylinder's drag falls from 1.2 to 0.3 between 2e5 and 5e5, a rough one's earlier",
    ),
    (
        "Reynolds number, depressor",
        lambda rig: _reynolds(rig, rig.depressor.diameter.value),
        "a smooth sphere's drag falls from 0.47 to 0.1 between 2e5 and 4e5",
    ),
    (
        "Reynolds number, fish's length",
        lambda rig: _reynolds(rig, rig.fish.length.value),
        "skin friction goes by about the 1/5 power; the boundary layer turns turbulent near 5e5",
    ),
    (
        "Weber number, primary line",
        _weber,
        "below about 10 surface tension shapes the spray where the line passes the surface",
    ),
    (
        "cavitation number, deepest point",
        _cavitation,
        "the air's pressure stays; bluff bodies begin to cavitate near 2",
    ),
    (
        "water's pressure over the air's",
        lambda rig: _hydrostatic(rig) / ATMOSPHERE,
        "trapped air and soft buoyancy chambers shrink by another share: weigh at depth",
    ),
    (
        "depth noise of one sample over the crank's radius",
        _noise,
        "the sensors stay: their noise in mm is the same, the heave is not",
    ),
    (
        "deepest pressure over the sensor's full scale",
        lambda rig: _hydrostatic(rig) / rig.sensors.fish_pressure.full_scale.value,
        "above 1 another sensor is needed; far below, linearity and zero weigh more",
    ),
    (
        "samples a crank period",
        _samples,
        "the board's rate stays: 20 or more are wanted",
    ),
)


def _axial_stiffness(rig: Rig) -> float:
    return rig.lines.primary.axial_stiffness.value


def _axial_damping(rig: Rig) -> float:
    return rig.lines.primary.axial_damping.value


def _bending_stiffness(rig: Rig) -> float:
    stiffness = rig.lines.primary.bending_stiffness
    return stiffness.value if stiffness else 0.0


# Name, unit, number of a rig, and the power of λ by which the same stuff would have it.
_STUFF = (
    ("axial stiffness EA", "N", _axial_stiffness, 2),
    ("axial damping", "N s", _axial_damping, 2),
    ("bending stiffness EI", "N m^2", _bending_stiffness, 4),
)


def _of_the_same_stuff(
    name: str,
    unit: str,
    number: Callable[[Rig], float],
    power: int,
    original: Rig,
    scaled: Rig,
    scale: float,
) -> ScaleEffect:
    """A line of the same material and build at the scaled diameter, beside what is wanted."""
    wanted = number(scaled)
    return ScaleEffect(
        f"{name} of the same rope, primary line",
        number(original),
        number(original) * scale**power,
        unit,
        f"similarity wants {wanted:.3g} {unit}: choose a rope that has it, or show that it does "
        "not matter",
    )
