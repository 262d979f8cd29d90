# SPDX-License-Identifier: Apache-2.0
"""Crank and carriage from encoder counts: smooth positions and speeds, a fixed lag behind.

An encoder gives steps of one count. A simulation driven by them would shake its lines, and a line
of wire rope answers a step of 0.01 mm with newtons. So each sample is replaced by the value and the
slope of a parabola fitted to it and its neighbours on both sides (local polynomial regression of
order 2; Fan & Gijbels 1996, Local Polynomial Modelling and Its Applications, chapter 3). Being
centred on the sample, the fit has no phase error; it costs a lag of half the window.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

HALF_WIDTH = 10  # samples on each side: 0.1 s at 100 Hz
_WINDOW = 2 * HALF_WIDTH + 1


@dataclass(frozen=True, slots=True)
class DriveSample:
    """Smoothed crank (rad, rad/s) and carriage (m, m/s) at a sampling instant (ns)."""

    stamp: int
    crank_angle: float
    crank_rate: float
    carriage_position: float
    carriage_speed: float


class DriveSmoother:
    """Fits each sample with its HALF_WIDTH neighbours before and after it.

    Sampling instants need not be even: a lost sample only thins the fit.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[int, float, float]] = deque(maxlen=_WINDOW)

    def clear(self) -> None:
        """Forget all samples."""
        self._samples.clear()

    def push(self, stamp: int, crank_angle: float, carriage_position: float) -> DriveSample | None:
        """Take the newest sample; return the one HALF_WIDTH samples before it, smoothed.

        stamp: ns, greater than the stamp before. Returns None until the window is full.
        """
        samples = self._samples
        samples.append((stamp, crank_angle, carriage_position))
        if len(samples) < _WINDOW:
            return None
        centre, crank_centre, carriage_centre = samples[HALF_WIDTH]
        # One sample period beyond the outermost sample the weight is zero.
        reach = max(centre - samples[0][0], stamp - centre) * (1 + 1 / HALF_WIDTH)
        # Sums of the weighted normal equations, in u = (t − centre)/reach and in differences from
        # the centre's sample, so that no digits are lost far down the tank.
        s0 = s1 = s2 = s3 = s4 = 0.0
        p0 = p1 = p2 = q0 = q1 = q2 = 0.0
        for time, crank, carriage in samples:
            u = (time - centre) / reach
            uu = u * u
            weight = 1.0 - uu  # Epanechnikov's kernel: the least error that a weight can give
            wu, wuu = weight * u, weight * uu
            s0 += weight
            s1 += wu
            s2 += wuu
            s3 += wuu * u
            s4 += wuu * uu
            p = crank - crank_centre
            q = carriage - carriage_centre
            p0 += weight * p
            p1 += wu * p
            p2 += wuu * p
            q0 += weight * q
            q1 += wu * q
            q2 += wuu * q
        # Rows of the inverse (by cofactors) that give value and slope at u = 0.
        c00, c01, c02 = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2
        c11, c12 = s0 * s4 - s2 * s2, s1 * s2 - s0 * s3
        scale = 1.0 / (s0 * c00 + s1 * c01 + s2 * c02)
        per_second = scale * 1e9 / reach
        return DriveSample(
            centre,
            crank_centre + scale * (c00 * p0 + c01 * p1 + c02 * p2),
            per_second * (c01 * p0 + c11 * p1 + c12 * p2),
            carriage_centre + scale * (c00 * q0 + c01 * q1 + c02 * q2),
            per_second * (c01 * q0 + c11 * q1 + c12 * q2),
        )
