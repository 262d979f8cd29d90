# SPDX-License-Identifier: Apache-2.0
"""Sobol indices: which share of an output's variance each parameter is answerable for.

First-order indices by Saltelli et al. (2010), total ones by Jansen (1999), as SALib has them, with
bootstrap confidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank_study.designs import unit_problem
from towtank_study.study import Sobol

LEAST_BLOCKS = 8
"""Of the scheme without failed samples; fewer tell nothing."""


@dataclass(frozen=True)
class Indices:
    """Sobol indices of one output, by parameter, each (parameters,) with half-widths of their 95 %
    confidence intervals. blocks: of the scheme that were whole and used, of `samples`."""

    first: NDArray[np.float64]
    first_confidence: NDArray[np.float64]
    total: NDArray[np.float64]
    total_confidence: NDArray[np.float64]
    blocks: int


def sobol_indices(values: NDArray[np.float64], design: Sobol, dimensions: int) -> Indices | None:
    """Return the indices from an output's values in the scheme's order; NaN where a sample failed.

    A block of the scheme (see designs.saltelli) with a failed sample is left out as a whole, which
    conditions the indices on what can be solved. None if too few are left or nothing varies.
    """
    blocks = values.reshape(design.samples, dimensions + 2)
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < LEAST_BLOCKS or np.ptp(whole) == 0.0:
        return None
    import SALib.analyze.sobol  # a second for pandas, which other studies need not spend

    found = SALib.analyze.sobol.analyze(
        unit_problem(dimensions),
        whole.ravel(),
        calc_second_order=False,
        num_resamples=design.resamples,
        conf_level=0.95,
        seed=design.seed,
    )
    return Indices(found["S1"], found["S1_conf"], found["ST"], found["ST_conf"], len(whole))


def independent_rows(design: Sobol, dimensions: int) -> NDArray[np.int64]:
    """Return the samples of the scheme that are independent of each other: the first and the last
    one of each block."""
    starts = np.arange(design.samples) * (dimensions + 2)
    return np.sort(np.concatenate((starts, starts + dimensions + 1)))
