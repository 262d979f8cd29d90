# SPDX-License-Identifier: Apache-2.0
"""Heave of the tow point over the crank angle, and its slope.

Sine: ``h = r sin θ`` (thesis of P. P. Lalu, 8.4).
Slider crank: ``h = −r cos θ + l [1 − √(1 − (r/l)² sin² θ)]`` (its equation 6.1; the "1 −" under the
root is missing in print).

θ is the crank's angle in rad; heave h is upwards, in m, about the tow point's height. The tow
point's heave velocity is ``slope(θ) · dθ/dt`` at any crank rate, also while the crank speeds up.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towtank_rig.tow import Motion, TowPoint

Law = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class TowPointMotion:
    """Height of the tow point and its derivatives over the crank angle.

    Attributes:
        mean_height: z at zero displacement, m.
        heave: Displacement over the crank angle, m.
        slope: d heave / d angle, m/rad.
        curvature: d² heave / d angle², m/rad².
    """

    mean_height: float
    heave: Law
    slope: Law
    curvature: Law

    def height(self, crank_angle: ArrayLike) -> NDArray[np.float64]:
        """Return z of the tow point, m, at crank angles of any shape, rad."""
        return self.mean_height + self.heave(np.asarray(crank_angle, dtype=float))

    def heave_of(self, crank_angle: float, crank_rate: float) -> tuple[float, float]:
        """Return heave, m, and its rate, m/s, at a crank angle, rad, and rate, rad/s."""
        angle = np.asarray(crank_angle, dtype=float)
        return float(self.heave(angle)), float(self.slope(angle)) * crank_rate


def tow_point_motion(tow_point: TowPoint) -> TowPointMotion:
    """Return the motion law of a rig's tow point."""
    laws = {"sine": _sine, "slider_crank": _slider_crank}
    heave, slope, curvature = laws[tow_point.motion.kind](tow_point.motion)
    return TowPointMotion(tow_point.height.value, heave, slope, curvature)


def _sine(motion: Motion) -> tuple[Law, Law, Law]:
    r = motion.crank_radius.value
    return (
        lambda angle: r * np.sin(angle),
        lambda angle: r * np.cos(angle),
        lambda angle: -r * np.sin(angle),
    )


def _slider_crank(motion: Motion) -> tuple[Law, Law, Law]:
    assert motion.rod_length is not None  # the schema demands it of a slider crank
    r, rod = motion.crank_radius.value, motion.rod_length.value
    ratio = r / rod

    def cosine_of_rod(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sqrt(1.0 - (ratio * np.sin(angle)) ** 2)

    def heave(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        return -r * np.cos(angle) + rod * (1.0 - cosine_of_rod(angle))

    def slope(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        return r * np.sin(angle) * (1.0 + ratio * np.cos(angle) / cosine_of_rod(angle))

    def curvature(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        sine, cosine, rod_cosine = np.sin(angle), np.cos(angle), cosine_of_rod(angle)
        straight = (cosine**2 - sine**2) / rod_cosine
        tilted = (ratio * sine * cosine) ** 2 / rod_cosine**3
        return r * cosine + r * ratio * (straight + tilted)

    return heave, slope, curvature
