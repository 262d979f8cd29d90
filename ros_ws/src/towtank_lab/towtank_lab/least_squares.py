# SPDX-License-Identifier: Apache-2.0
"""Linear least squares with what a calibration wants of it: covariance and residuals.

All values weigh the same; their scatter about the model, with n − k degrees of freedom, is taken
for their standard uncertainty (GUM 4.2, type A), so that Student's t applies to the coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from towtank_uncertainty.combination import Estimate, effective_freedom

from towtank_lab.errors import ProcedureError

Array = NDArray[np.float64]

# Beyond this the readings lie too close together to tell the coefficients apart.
_GREATEST_CONDITION = 1e6


@dataclass(frozen=True)
class Fit:
    """coefficients: shape (k,); covariance: (k, k); residuals: value less model, (n,); scatter:
    their standard deviation with `freedom` = n − k degrees of freedom."""

    coefficients: Array
    covariance: Array
    residuals: Array
    scatter: float
    freedom: int

    def estimate(self, index: int) -> Estimate:
        """Return one coefficient with its type A uncertainty."""
        uncertainty = float(np.sqrt(self.covariance[index, index]))
        return Estimate(float(self.coefficients[index]), uncertainty, float(self.freedom))

    def as_json(self) -> dict[str, object]:
        """Return the numbers as lists."""
        return {
            "coefficients": self.coefficients.tolist(),
            "covariance": self.covariance.tolist(),
            "scatter": self.scatter,
            "degrees_of_freedom": self.freedom,
        }


def fit(design: ArrayLike, values: ArrayLike) -> Fit:
    """Fit values (n,) by design (n, k) times coefficients.

    Raises ProcedureError for fewer than k + 1 values, or values that do not tell the coefficients
    apart.
    """
    matrix, observed = np.asarray(design, dtype=float), np.asarray(values, dtype=float)
    count, unknowns = matrix.shape
    if count <= unknowns:
        raise ProcedureError(
            f"{count} readings for {unknowns} coefficients tell nothing of their uncertainty: "
            f"take {unknowns + 2} or more"
        )
    # Columns of one length: the condition then tells of the readings, not of their units.
    lengths = np.linalg.norm(matrix, axis=0)
    if not np.all(lengths > 0.0) or np.linalg.cond(matrix / lengths) > _GREATEST_CONDITION:
        raise ProcedureError(
            "the readings lie too close together to tell the coefficients apart: spread them"
        )
    coefficients = np.linalg.lstsq(matrix / lengths, observed, rcond=None)[0] / lengths
    residuals = observed - matrix @ coefficients
    freedom = count - unknowns
    scatter = float(np.sqrt(residuals @ residuals / freedom))
    inverse = np.linalg.inv((matrix / lengths).T @ (matrix / lengths))
    covariance = scatter**2 * inverse / np.outer(lengths, lengths)
    return Fit(coefficients, covariance, residuals, scatter, freedom)


def combined(estimate: Estimate, *limits: float) -> Estimate:
    """Return an estimate with type B errors added, each anywhere within ± its limit."""
    others = math.hypot(*(limit / math.sqrt(3.0) for limit in limits))
    freedom = effective_freedom([(estimate.uncertainty, estimate.freedom), (others, math.inf)])
    return Estimate(estimate.value, math.hypot(estimate.uncertainty, others), freedom)
