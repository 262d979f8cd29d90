# SPDX-License-Identifier: Apache-2.0
"""Half-width of the interval that holds a sum of independent errors with a given probability.

1.96 standard uncertainties hold 95 % of a normal distribution only. An error that lies anywhere
within a limit never leaves it, and where one such error dominates, 1.65 of its standard
uncertainties hold 95 %. GUM Supplement 1 (JCGM 101:2008) propagates the distributions themselves,
with random numbers. For a sum of independent, symmetric errors they are not needed: the
characteristic function of the sum is the product of theirs, and the probability of an interval
about zero is its Fourier series.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Within ± _LIMIT standard deviations the sum counts as one period of a series of _TERMS terms. The
# probability is then right to 5e-5 (worst are an error or a product of limits alone: their
# characteristic functions fall slowly; test_rig_coverage.py).
_LIMIT = 16.0
_TERMS = 1024
_NEGLIGIBLE = 1e-6
# An error with less than this share of the sum's deviation counts as normal: what its shape does to
# the interval goes with the fourth power of the share.
_SHAPELESS = 0.1
_NODES = 64  # of the quadrature over one factor of a product


class Distribution(Protocol):
    """A symmetric distribution about zero."""

    @property
    def deviation(self) -> float:
        """Standard deviation."""

    def characteristic(self, t: Array) -> Array:
        """Characteristic function: the expectation of cos(t·x); t of any shape."""

    def nodes(self) -> tuple[Array, Array]:
        """Places and weights of a quadrature for expectations of even functions."""


@dataclass(frozen=True)
class Normal:
    """Normal distribution."""

    deviation: float

    def characteristic(self, t: Array) -> Array:
        return np.exp(-0.5 * np.square(self.deviation * t))

    def nodes(self) -> tuple[Array, Array]:
        places, weights = _hermite()
        return self.deviation * places, weights


@dataclass(frozen=True)
class Rectangular:
    """Anywhere within ± limit."""

    limit: float

    @property
    def deviation(self) -> float:
        return self.limit / math.sqrt(3.0)

    def characteristic(self, t: Array) -> Array:
        return np.sinc(self.limit / math.pi * t)

    def nodes(self) -> tuple[Array, Array]:
        places, weights = _legendre()
        return self.limit * places, weights


@dataclass(frozen=True)
class Oscillation:
    """A sinusoid of this amplitude at a random instant (arc sine distribution)."""

    amplitude: float

    @property
    def deviation(self) -> float:
        return self.amplitude / math.sqrt(2.0)

    def characteristic(self, t: Array) -> Array:
        places, weights = self.nodes()
        return np.cos(np.multiply.outer(t, places)) @ weights

    def nodes(self) -> tuple[Array, Array]:
        phases = (np.arange(_NODES) + 0.5) * (math.pi / 2.0 / _NODES)
        return self.amplitude * np.cos(phases), np.full(_NODES, 1.0 / _NODES)


@dataclass(frozen=True)
class Product:
    """Product of two independent quantities: one symmetric about zero, one about ``mean``."""

    first: Distribution
    second: Distribution
    mean: float = 0.0

    @property
    def deviation(self) -> float:
        return self.first.deviation * math.hypot(self.second.deviation, self.mean)

    def characteristic(self, t: Array) -> Array:
        places, weights = self.first.nodes()
        scaled = np.multiply.outer(t, places)
        return (np.cos(self.mean * scaled) * self.second.characteristic(scaled)) @ weights

    def nodes(self) -> tuple[Array, Array]:
        first, first_weights = self.first.nodes()
        second, second_weights = self.second.nodes()
        both = np.concatenate((self.mean + second, self.mean - second))
        weights = np.concatenate((second_weights, second_weights)) / 2.0
        return np.outer(first, both).ravel(), np.outer(first_weights, weights).ravel()


@dataclass(frozen=True)
class Scaled:
    """``factor`` times a quantity."""

    factor: float
    of: Distribution

    @property
    def deviation(self) -> float:
        return abs(self.factor) * self.of.deviation

    def characteristic(self, t: Array) -> Array:
        return self.of.characteristic(self.factor * t)

    def nodes(self) -> tuple[Array, Array]:
        places, weights = self.of.nodes()
        return self.factor * places, weights


def half_width(errors: Iterable[Distribution], probability: float = 0.95) -> float:
    """Return the x for which the sum of the errors lies within ± x with the given probability.

    Zero if no error has any width.
    """
    wide = [error for error in errors if error.deviation > 0.0]
    if not wide:
        return 0.0
    unit = math.hypot(*(error.deviation for error in wide))
    t = np.arange(1, _TERMS + 1) * (math.pi / _LIMIT)
    characteristic = np.ones(_TERMS)
    shaped = [error for error in wide if error.deviation > _SHAPELESS * unit]
    rest = math.hypot(*(error.deviation for error in wide if error not in shaped))
    for error in (Normal(rest), *sorted(shaped, key=_is_product)):  # products take long
        characteristic = characteristic * error.characteristic(t / unit)
        # What follows can only make it smaller
        last = np.flatnonzero(np.abs(characteristic) > _NEGLIGIBLE)[-1:] + 1
        t, characteristic = t[: int(last.sum())], characteristic[: int(last.sum())]
    series = characteristic * (2.0 / _LIMIT) / t
    low, high = 0.0, 1.0 / math.sqrt(1.0 - probability)  # Chebyshev's inequality
    while high - low > 1e-5:
        middle = (low + high) / 2.0
        if middle / _LIMIT + series @ np.sin(t * middle) < probability:
            low = middle
        else:
            high = middle
    return unit * (low + high) / 2.0


def _is_product(error: Distribution) -> bool:
    return _is_product(error.of) if isinstance(error, Scaled) else isinstance(error, Product)


@cache
def _legendre() -> tuple[Array, Array]:
    """Gauss-Legendre on [0, 1]."""
    places, weights = np.polynomial.legendre.leggauss(_NODES)
    return (places + 1.0) / 2.0, weights / 2.0


@cache
def _hermite() -> tuple[Array, Array]:
    """Gauss-Hermite for the standard normal distribution."""
    places, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    return places, weights / math.sqrt(2.0 * math.pi)
