# SPDX-License-Identifier: Apache-2.0
"""Hull tables from what is known of a hull of revolution: forces over its angle to the flow."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from sim_core._core import HullTable

#: A coefficient over the angle (rad, 0 or more) between the hull's axis and its velocity.
Coefficient = Callable[[float], float]


def hull_of_revolution(
    drag: Coefficient,
    lift: Coefficient,
    moment: Coefficient,
    *,
    area: float,
    length: float,
    largest_angle: float,
    spacing: float = math.radians(2.5),
) -> HullTable:
    """Return the table of a hull that is round about its axis.

    drag: against the velocity; lift: normal to it in the plane of axis and velocity, towards the
    nose; moment: positive where it turns the nose away from the flow. On ½ρU² `area` (m²), the
    moment also × `length` (m), about the body's origin. Lift and moment must be 0 at angle 0.
    The table covers attack and sideslip up to `largest_angle` (rad) each, for which the
    coefficients are asked for up to √2 times that angle; `spacing`: rad between its nodes.
    """
    if not 0.0 < largest_angle < 0.5 * math.pi:
        raise ValueError("largest_angle must lie between 0 and pi/2 rad")
    if lift(0.0) != 0.0 or moment(0.0) != 0.0:
        raise ValueError("lift and moment of a hull of revolution are 0 at angle 0")
    half = max(1, math.ceil(largest_angle / spacing))
    angles = np.linspace(-largest_angle, largest_angle, 2 * half + 1).tolist()
    rows = [[_six(a, b, drag, lift, moment) for b in angles] for a in angles]
    return HullTable(attack=angles, sideslip=angles, coefficients=rows, area=area, length=length)


def polynomial_hull(
    drag: Sequence[float],
    lift: Sequence[float],
    moment: Sequence[float],
    *,
    area: float,
    length: float,
    largest_angle: float,
    spacing: float = math.radians(2.5),
) -> HullTable:
    """Return the table of a hull of revolution from polynomials in the angle to the flow (rad).

    drag, lift, moment: coefficients from the constant upwards, C = c0 + c1 ι + c2 ι², as a few runs
    of a CFD code and a fit of the second degree give them; the rest as in
    :func:`hull_of_revolution`.
    """

    def of(coefficients: Sequence[float]) -> Coefficient:
        return np.polynomial.Polynomial(coefficients)

    return hull_of_revolution(
        of(drag),
        of(lift),
        of(moment),
        area=area,
        length=length,
        largest_angle=largest_angle,
        spacing=spacing,
    )


def _six(
    attack: float, sideslip: float, drag: Coefficient, lift: Coefficient, moment: Coefficient
) -> list[float]:
    """The six coefficients of a HullTable at one node."""
    ahead = np.array([math.cos(attack), 0.0, -math.sin(attack)])
    along = math.cos(sideslip) * ahead + math.sin(sideslip) * np.array([0.0, 1.0, 0.0])
    up = np.array([math.sin(attack), 0.0, math.cos(attack)])
    side = np.cross(up, along)
    angle = math.acos(min(1.0, along[0]))
    six = [float(drag(angle)), 0.0, 0.0, 0.0, 0.0, 0.0]
    across = np.array([1.0, 0.0, 0.0]) - along[0] * along  # from the velocity towards the nose
    size = float(np.linalg.norm(across))
    if size < 1e-12:
        return six
    force = float(lift(angle)) / size * across
    about = np.cross(along, [1.0, 0.0, 0.0])  # turns the nose further off
    turn = float(moment(angle)) / float(np.linalg.norm(about)) * about
    return [six[0], float(force @ side), float(force @ up), *turn.tolist()]
