# SPDX-License-Identifier: Apache-2.0
"""Combination of standard uncertainties of type A and B into one interval (GUM, JCGM 100:2008).

Type A comes from a scatter, with few degrees of freedom. Figures of type B count as exact, and each
error has its own distribution (towtank_uncertainty.intervals). Degrees of freedom combine by Welch
and Satterthwaite (GUM G.4.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scipy.special import stdtrit
from towtank_rig.quantity import NORMAL_95

from towtank_uncertainty.intervals import Distribution, Normal, half_width

COVERAGE_PROBABILITY = 0.95
"""Of every interval that this project states."""

_AS_GOOD_AS_NORMAL = 1e6
"""Degrees of freedom beyond which Student's factor is the normal one to 2e-6."""


@dataclass(frozen=True)
class Estimate:
    """A number with its standard uncertainty (k = 1) and degrees of freedom, inf for type B."""

    value: float
    uncertainty: float
    freedom: float = math.inf

    @property
    def u95(self) -> float:
        """Return the half-width of the 95 % interval, by Student's t."""
        return coverage_factor(self.freedom) * self.uncertainty


@dataclass(frozen=True)
class CombinedUncertainty:
    """Standard uncertainties and the expanded one, all in the unit of the result.

    coverage_factor: u95 over the combined standard uncertainty.
    """

    type_a: float
    type_b: float
    u95: float
    coverage_factor: float


def coverage_factor(freedom: float) -> float:
    """Return Student's t of the 95 % interval; inf degrees of freedom give the normal 1.96."""
    if freedom > _AS_GOOD_AS_NORMAL:
        return NORMAL_95
    return float(stdtrit(freedom, (1.0 + COVERAGE_PROBABILITY) / 2.0))


def effective_freedom(parts: Iterable[tuple[float, float]]) -> float:
    """Return the degrees of freedom of a sum, inf if no part has finite ones (GUM G.4.1).

    parts: standard uncertainty and degrees of freedom of each, independent of one another.
    """
    parts = list(parts)
    combined = math.hypot(*(uncertainty for uncertainty, _ in parts))
    if combined == 0.0:
        return math.inf
    # Of relative uncertainties, for the fourth power of a small one is zero to a computer
    inverse = sum(
        (uncertainty / combined) ** 4 / freedom if freedom > 0.0 else math.inf
        for uncertainty, freedom in parts
        if uncertainty > 0.0
    )
    return 1.0 / inverse if inverse > 0.0 else math.inf


def combine(type_a: float, freedom: float, errors: Sequence[Distribution]) -> CombinedUncertainty:
    """Return the expanded uncertainty of a result.

    The interval of the sum of a normal scatter and the errors, each with its own distribution, is
    widened as Student's factor for the effective degrees of freedom is wider than the normal one.

    freedom: degrees of freedom of `type_a`. errors: those of type B, in the unit of the result.
    """
    type_b = math.hypot(*(error.deviation for error in errors))
    combined = math.hypot(type_a, type_b)
    if combined == 0.0:
        return CombinedUncertainty(0.0, 0.0, 0.0, math.nan)
    effective = effective_freedom([(type_a, freedom), (type_b, math.inf)])
    widened = coverage_factor(effective) / NORMAL_95
    u95 = widened * half_width((Normal(type_a), *errors), COVERAGE_PROBABILITY)
    return CombinedUncertainty(type_a, type_b, u95, u95 / combined)
