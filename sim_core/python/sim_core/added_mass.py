# SPDX-License-Identifier: Apache-2.0
"""Added mass of hulls and fins, as (6, 6) matrices for :class:`Body`.

A matrix acts on (velocity, angular velocity) in body axes: its blocks are [M, Dᵀ; D, J] in kg,
kg·m and kg·m². Matrices about the same origin add up: a body's is that of its hull plus those of
its fins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Fin
from sim_core.ring_panels import Rings

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class LambCoefficients:
    """Added mass of a prolate spheroid as shares of what the displaced water has."""

    axial: float  #: k1, of its mass, along the axis
    lateral: float  #: k2, of its mass, across
    rotational: float  #: k', of its moment of inertia, about an axis across


def lamb_coefficients(fineness: float) -> LambCoefficients:
    """Return Lamb's coefficients for a prolate spheroid.

    fineness: length over diameter, 1 (a sphere) or more; infinity gives the limit 0, 1, 1.
    Source: Lamb 1918, Aeronautical Research Committee Rep. Memo. 623, and Hydrodynamics (1932),
    §§ 114, 115. Raises ValueError.
    """
    if not fineness >= 1.0:
        raise ValueError(f"fineness {fineness:g} is that of no prolate spheroid: give 1 or more")
    if math.isinf(fineness):
        return LambCoefficients(0.0, 1.0, 1.0)
    e2 = 1.0 - 1.0 / fineness**2  # eccentricity squared
    if e2 < 0.1:  # the closed form cancels; 20 terms leave less than 1e-20
        alpha = 2.0 * (1.0 - e2) * sum(e2 ** (n - 1) / (2 * n + 1) for n in range(1, 21))
    else:
        e = math.sqrt(e2)
        # ½ ln((1+e)/(1−e)), without the cancellation in 1 − e = 1/(f² (1 + e))
        half_log = math.log((1.0 + e) * fineness)
        alpha = 2.0 * (1.0 - e2) / (e2 * e) * (half_log - e)
    beta = 1.0 - 0.5 * alpha
    difference = beta - alpha
    rotational = 0.0
    if e2 > 0.0:
        rotational = e2**2 * difference / ((2.0 - e2) * (2.0 * e2 - (2.0 - e2) * difference))
    return LambCoefficients(alpha / (2.0 - alpha), beta / (2.0 - beta), rotational)


def hull_added_mass(length: float, diameter: float, *, density: float = 1000.0) -> Matrix:
    """Return the added mass of a prolate spheroid about its middle: (6, 6), diagonal, none in roll.

    length, diameter: m; density of the water: kg/m³. Lamb's coefficients times the mass and the
    moment of inertia of the water that the spheroid displaces. A hull of another shape has other
    values (a cylinder of fineness 12: 1.5 times across, 2.3 times in pitch): see
    :func:`revolution_added_mass`. Raises ValueError.
    """
    k = lamb_coefficients(length / diameter)
    displaced_mass = density * math.pi / 6.0 * length * diameter**2
    lateral = k.lateral * displaced_mass
    rotational = k.rotational * displaced_mass * (length**2 + diameter**2) / 20.0
    return np.diag([k.axial * displaced_mass, lateral, lateral, 0.0, rotational, rotational])


def revolution_added_mass(
    profile: Sequence[Sequence[float]], *, density: float = 1000.0, rings: int = 80
) -> Matrix:
    """Return the added mass of a hull of revolution about the body's origin: (6, 6).

    profile: (n, 2), pairs (x, radius) in m, with x in body axes and not falling; straight between
    them, closed by a flat disc where it does not end on the axis. Two pairs are a cylinder.
    rings: how many the surface is cut into. Potential flow far from all boundaries, by a panel
    method (ring_panels.py): with 80 rings within 0.1 % for a spheroid, 0.2 % for a cylinder with
    flat ends. Takes half a second. Raises ValueError.
    """
    points = np.asarray(profile, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.isfinite(points).all():
        raise ValueError("profile must be two or more finite pairs (x, radius)")
    if (points[:, 1] < 0.0).any() or (points[1:-1, 1] == 0.0).any() or not points[:, 1].any():
        raise ValueError("a profile's radii must be above 0, at its ends not below")
    if (np.diff(points[:, 0]) < 0.0).any() or points[0, 0] == points[-1, 0]:
        raise ValueError("a profile's x must not fall, and rise from end to end")
    if rings < 10:
        raise ValueError("rings must be at least 10")
    tail, nose = points[0, 0], points[-1, 0]
    ends = [(tail, 0.0)] if points[0, 1] > 0.0 else [], [(nose, 0.0)] if points[-1, 1] > 0.0 else []
    corners = np.array([*ends[0], *points.tolist(), *ends[1]])
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    meridian = [corners[:1]]
    for start, end, share in zip(corners[:-1], corners[1:], lengths / lengths.sum(), strict=True):
        if share == 0.0:
            continue
        is_disc = start[1] == 0.0 == end[0] - start[0] or end[1] == 0.0 == end[0] - start[0]
        count = max(8 if is_disc else 1, round(share * rings))
        # Finer towards the corners, where the flow is fast
        at = 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, count + 1)[1:]))
        meridian.append(start + at[:, None] * (end - start))
    surface = Rings(np.concatenate(meridian))
    x, r = surface.middle.T
    along, outward = surface.normal.T
    # Sway and yaw; heave and pitch are the same but for the sign of the coupling
    across = density * surface.impulse(1, np.column_stack([outward, x * outward - r * along]))
    matrix = np.zeros((6, 6))
    matrix[0, 0] = density * surface.impulse(0, along[:, None])[0, 0]
    matrix[np.ix_((1, 5), (1, 5))] = across
    matrix[np.ix_((2, 4), (2, 4))] = across * [[1.0, -1.0], [-1.0, 1.0]]
    return matrix


def fin_added_mass(fin: Fin, span: float, *, density: float = 1000.0) -> Matrix:
    """Return the added mass of a fin about the body's origin: (6, 6), by strip theory.

    Each strip across the span (m) is a flat plate of the mean chord c = area/span: ρπ(c/2)² per
    span along the normal, at mid-chord, ρπ(c/2)⁴/8 in rotation about the span (Newman, Marine
    Hydrodynamics, 1977, table 4.3). Water that escapes round the tips is not allowed for: for an
    aspect ratio of 1 without a hull to shield the root the plate has 0.58 of this (Blevins 1979).
    density: kg/m³.
    """
    if not span > 0.0:
        raise ValueError("span must be above 0 m")
    normal = np.asarray(fin.normal, dtype=float)
    normal = normal / np.linalg.norm(normal)
    chord = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    chord /= np.linalg.norm(chord)
    spanwise = np.cross(normal, chord)
    c = fin.area / span
    mass = density * math.pi * (0.5 * c) ** 2 * span
    middle = fin.position - 0.25 * c * chord  # of the chord; the aerodynamic centre is at a quarter
    across = np.concatenate([normal, np.cross(middle, normal)])
    about_chord = np.concatenate([np.zeros(3), np.cross(spanwise, normal)])
    about_span = np.concatenate([np.zeros(3), spanwise])
    return (
        mass * np.outer(across, across)
        + mass * span**2 / 12.0 * np.outer(about_chord, about_chord)
        + density * math.pi / 8.0 * (0.5 * c) ** 4 * span * np.outer(about_span, about_span)
    )


def about_origin(mass_matrix: Matrix, place: Sequence[float]) -> Matrix:
    """Return a mass or added-mass matrix about the body's origin.

    mass_matrix: (6, 6) about `place` ((3,) m, body axes), with parallel axes. The parallel-axis
    theorem for all six degrees of freedom: the velocity at the place is v + ω × r.
    """
    x, y, z = place
    motion = np.eye(6)  # (v, ω) at the origin → (v, ω) at the place
    motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motion.T @ mass_matrix @ motion
