# SPDX-License-Identifier: Apache-2.0
"""Noise of a channel by its samples, told from motion, and how far it may lie off by chance."""

from __future__ import annotations

import math

import numpy as np

SIGMAS = 5.0
"""What is judged by scatter is judged beyond so many standard deviations of the estimate."""

# Third differences of white noise have 20 times its variance. The median of their sizes, 0.6745
# deviations, is not moved by a few jumps. Of n it scatters by 1.166/√n of itself if they were
# independent; the sum of their squared correlations, C(12, 6)/C(6, 3)², makes fewer of them.
_DIFFERENCES = 20.0
_MEDIAN = 0.6745
_FEWEST_MEANS = 6  # of half a second each, less two for the straight line
_NOISE_SCATTER = 1.166 * math.sqrt(924.0 / 400.0)


def white_noise(codes: np.ndarray) -> float:
    """Return the standard deviation of the white noise in samples, by third differences."""
    sizes = np.abs(np.diff(codes, 3))
    return float(np.median(sizes)) / (_MEDIAN * math.sqrt(_DIFFERENCES))


def noise_margin(samples: int) -> float:
    """Return how far white_noise() may lie above the truth by chance, relative; for 4 or more."""
    return SIGMAS * _NOISE_SCATTER / math.sqrt(samples - 3)


def wander_samples(rate_hz: float) -> int:
    """Return how many samples slow_wander() takes into each mean."""
    return max(round(rate_hz / 2.0), 1)


def wander_margin(samples: int, rate_hz: float) -> float:
    """Return how far slow_wander() of white noise may lie above the truth by chance, relative."""
    return SIGMAS / math.sqrt(2.0 * max(samples // wander_samples(rate_hz) - 2, 1))


def slow_wander(values: np.ndarray, rate_hz: float) -> float:
    """Return the amplitude of what is slower than 1 Hz in samples, as of one oscillation.

    Means over half a second, less a straight line: their standard deviation times √2. White noise
    leaves √2 times its own over the root of a mean's samples. NaN for less than three seconds.
    """
    size = wander_samples(rate_hz)
    means = values[: len(values) // size * size].reshape(-1, size).mean(axis=1)
    if len(means) < _FEWEST_MEANS:
        return math.nan
    time = np.arange(len(means))
    left = means - np.polyval(np.polyfit(time, means, 1), time)
    return math.sqrt(2.0 * float(np.sum(left**2)) / (len(means) - 2))


def is_still(codes: np.ndarray, greatest_noise: float) -> bool:
    """Return whether samples hold nothing but white noise, of no more than a greatest deviation."""
    if len(codes) < 20:
        return False
    noise = min(white_noise(codes), greatest_noise) ** 2
    # Of one variance by itself and of the other, twice that of its root
    scatter = math.hypot(2.0 * _NOISE_SCATTER, math.sqrt(2.0)) / math.sqrt(len(codes))
    return float(np.var(codes)) <= noise * (1.0 + SIGMAS * scatter)


def passed_motion(angle: float) -> float:
    """Return how much of the amplitude of an oscillation third differences take for noise.

    angle: that it goes on by from sample to sample, ω/f, rad; at most π. (2 sin(ω/2f))³/√2, its
    effective value, over √20.
    """
    return (2.0 * math.sin(min(angle, math.pi) / 2.0)) ** 3 / math.sqrt(2.0 * _DIFFERENCES)
