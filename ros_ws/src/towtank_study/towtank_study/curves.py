# SPDX-License-Identifier: Apache-2.0
"""The curves of a study's plots: which samples belong to each, and what course it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from towtank_study.study import Optimisation, Plot, Sobol, Study

DEFAULT_OUTPUTS = ("heave_ratio_nose", "heave_ratio_port", "depressor_heave")


@dataclass(frozen=True)
class Curve:
    """Samples of one curve of a plot, as rows of the results in the order of x where that is a
    number; label: the value of the plot's `by`, or empty."""

    label: str
    rows: list[int]


def plots_of(study: Study) -> tuple[Plot, ...]:
    """Return the study's plots; where it has none, a plot over each parameter, in Sobol designs
    and optimisations none."""
    if study.plots or isinstance(study.design, (Sobol, Optimisation)):
        return study.plots
    return tuple(Plot(x=parameter.path, y=main_outputs(study)) for parameter in study.parameters)


def main_outputs(study: Study) -> tuple[str, ...]:
    """Return what is shown where the study does not say it."""
    return tuple(name for name in DEFAULT_OUTPUTS if name in study.outputs) or study.outputs[:3]


def is_a_grid(study: Study) -> bool:
    """Return whether neighbouring samples can be joined by lines."""
    return study.design.kind in ("one_at_a_time", "full_factorial")


def curves(study: Study, table: pa.Table, plot: Plot) -> list[Curve]:
    """Return the curves of a plot.

    In a grid all parameters beside x and `by` keep their first values (in a one-at-a-time design
    the rig's); a plot over an output, and one of a random design, takes all samples.
    """
    rows = range(table.num_rows)
    paths = [parameter.path for parameter in study.parameters]
    if plot.x in paths and is_a_grid(study):
        fixed = [table[path].to_pylist() for path in paths if path not in (plot.x, plot.by)]
        rows = [row for row in rows if all(values[row] == values[0] for values in fixed)]
    groups: dict[Any, list[int]] = {}
    keys = table[plot.by].to_pylist() if plot.by else [""] * table.num_rows
    for row in rows:
        groups.setdefault(keys[row], []).append(row)
    x = table[plot.x].to_pylist()
    return [
        Curve(
            f"{key:g}" if isinstance(key, float) else str(key),
            sorted(group, key=lambda row: x[row]) if _are_numbers([x[r] for r in group]) else group,
        )
        for key, group in groups.items()
    ]


def _are_numbers(values: Sequence[object]) -> bool:
    return all(isinstance(value, (int, float)) for value in values)


def course(x: NDArray[np.float64], y: NDArray[np.float64]) -> dict[str, Any] | None:
    """Return how y goes with rising x, of which NaN are left out.

    course: rising, falling, constant, or not monotonic; first, last, least, greatest: `at` (x) and
    `value` (y). None with fewer than two values.
    """
    found = np.isfinite(x) & np.isfinite(y)
    x, y = x[found], y[found]
    if len(y) < 2:
        return None
    steps = np.diff(y)
    kind = "not monotonic"
    if not steps.any():
        kind = "constant"
    elif np.all(steps >= 0):
        kind = "rising"
    elif np.all(steps <= 0):
        kind = "falling"
    places = {"first": 0, "last": -1, "least": int(np.argmin(y)), "greatest": int(np.argmax(y))}
    return {
        "course": kind,
        **{key: {"at": float(x[i]), "value": float(y[i])} for key, i in places.items()},
    }
