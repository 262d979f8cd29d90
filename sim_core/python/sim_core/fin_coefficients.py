# SPDX-License-Identifier: Apache-2.0
"""Estimates of what a :class:`Fin` and a :class:`Downwash` want to know."""

from __future__ import annotations

import math


def lift_slope(aspect_ratio: float, sweep: float = 0.0) -> float:
    """Return the lift slope of a fin alone, 1/rad: Helmbold's formula for a straight fin.

    aspect_ratio: span² over area, of the fin with its mirror image if its root is at a hull.
    sweep: rad, of the mid-chord line (Polhamus & DATCOM form, incompressible):
    a = 2πA / (2 + √(4 + A²(1 + tan²Λ))). It goes to Jones's πA/2 for low and to 2π cos Λ for high
    aspect ratio. Sources: Helmbold 1942, Jahrb. dt. Luftfahrtf. I, 111–113; USAF DATCOM 4.1.3.2.
    """
    if not aspect_ratio > 0.0:
        raise ValueError("aspect_ratio must be above 0")
    swept = aspect_ratio**2 * (1.0 + math.tan(sweep) ** 2)
    return 2.0 * math.pi * aspect_ratio / (2.0 + math.sqrt(4.0 + swept))


def body_lift_factor(body_radius: float, tip_radius: float) -> float:
    """Return by how much a pair of fins on a slender round hull lifts more than the fins alone.

    The angle of attack of the fins rises in the flow round the hull, and part of their lift is
    carried over to it: (1 + r/s)², r the hull's radius at the fins, s the distance of the tips from
    its axis (both m). Slender-body theory: Pitts, Nielsen & Kaattari 1957, NACA Report 1307.
    """
    if not 0.0 <= body_radius < tip_radius:
        raise ValueError("body_radius must lie between 0 and tip_radius")
    return (1.0 + body_radius / tip_radius) ** 2


def downwash_slope(lift_slope: float, aspect_ratio: float) -> float:
    """Return dε/dα far behind a fin with elliptic lift: 2a/(πA).

    lift_slope a: 1/rad of the front fin; aspect_ratio: its own. Prandtl's lifting line: the
    downwash angle is C_L/(πA) at the fin itself and twice that far behind. A rear fin above or
    below the wake, or beyond its tips, meets less.
    """
    return 2.0 * lift_slope / (math.pi * aspect_ratio)
