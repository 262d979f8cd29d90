# SPDX-License-Identifier: Apache-2.0
"""Propagation of uncertainty through a formula, of first order (GUM, JCGM 100:2008, 5.1).

Sensitivities are central differences over one standard uncertainty, as GUM 5.1.3 allows. How
degrees of freedom combine, and what the expanded uncertainty is: towtank_uncertainty.combination.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from towtank_rig.quantity import Quantity
from towtank_uncertainty.combination import Estimate, effective_freedom

Formula = Callable[[Mapping[str, float]], float]


@dataclass(frozen=True)
class Propagated(Estimate):
    """A result. shares: what each input adds to the standard uncertainty, by the input's name."""

    shares: Mapping[str, float] = field(default_factory=dict)


def within_range(quantity: Quantity) -> Estimate:
    """Return a quantity as an estimate: anywhere within its range, exact if it has none.

    The variance of an even distribution between the limits (GUM 4.3.7).
    """
    low, high = quantity.range or (quantity.value, quantity.value)
    return Estimate(quantity.value, (high - low) / math.sqrt(12.0))


def relative_limit(quantity: Quantity) -> float:
    """Return half the width of a quantity's range over its value; 0 if it has none."""
    low, high = quantity.range or (quantity.value, quantity.value)
    return (high - low) / 2.0 / abs(quantity.value)


def worst(normalised: Mapping[str, float]) -> dict[str, object]:
    """Return the greatest of the normalised differences, and ``of`` what it is, for a record."""
    of = max(normalised, key=lambda name: normalised[name])
    return {"normalised": normalised[of], "of": of}


def mean_of(values: Sequence[float], label: str) -> Estimate:
    """Return the mean of repeated readings, type A (GUM 4.2). ValueError for fewer than two."""
    if len(values) < 2:
        raise ValueError(f"one {label} tells nothing of its scatter: repeat it")
    scatter = float(np.std(values, ddof=1))
    return Estimate(
        float(np.mean(values)), scatter / math.sqrt(len(values)), float(len(values) - 1)
    )


def propagate(formula: Formula, inputs: Mapping[str, Estimate]) -> Propagated:
    """Return the formula's result at the inputs, which are taken as independent."""
    values = {name: estimate.value for name, estimate in inputs.items()}
    shares = {}
    for name, estimate in inputs.items():
        u = estimate.uncertainty
        above, below = (formula({**values, name: estimate.value + s}) for s in (u, -u))
        shares[name] = abs(above - below) / 2.0
    combined = math.hypot(*shares.values())
    freedom = effective_freedom((share, inputs[name].freedom) for name, share in shares.items())
    return Propagated(formula(values), combined, freedom, shares)
