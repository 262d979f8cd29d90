# SPDX-License-Identifier: Apache-2.0
"""What a study found, as plain dictionaries for JSON. What is missing is null."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from towtank_study.curves import course, curves, is_a_grid, plots_of
from towtank_study.optimisation import feasible_rows, trade_off_rows
from towtank_study.results import unit_of
from towtank_study.sensitivity import independent_rows, sobol_indices
from towtank_study.study import LatinHypercube, Optimisation, Sobol, Study
from towtank_study.variables import Variable


def summarise(study: Study, variables: Sequence[Variable], table: pa.Table) -> dict[str, Any]:
    """Return the summary of a study's results.

    Keys: study, rig, statement, references; samples, failed, errors (number by reason); parameters
    (path, unit, base, range); outputs, by name: unit, least and greatest value with the sample of
    each, median, and for random designs band_95 (2.5 and 97.5 percentiles); for Sobol designs
    sensitivity, by output: blocks, and by parameter first, first_confidence, total,
    total_confidence (half-widths of 95 % intervals); curves, of the plots of a grid: x, y, by and
    its value, and what `curves.course` says; for optimisations feasible (number) and trade_off:
    sample, parameters and outputs of the designs that no other one beats in every objective.
    """
    errors = [error for error in table["error"].to_pylist() if error is not None]
    summary: dict[str, Any] = {
        "study": study.name,
        "rig": study.rig,
        "design": study.design.model_dump(),
        "statement": study.statement,
        "references": [reference.model_dump() for reference in study.references],
        "samples": table.num_rows,
        "failed": len(errors),
        "errors": by_reason(errors),
        "parameters": {
            variable.path: {
                "unit": variable.unit,
                "base": variable.base,
                "from": variable.levels[0],
                "to": variable.levels[-1],
            }
            for variable in variables
        },
        "outputs": {name: _output(study, len(variables), table, name) for name in study.outputs},
    }
    if isinstance(study.design, Sobol):
        summary["sensitivity"] = {
            name: _sensitivity(study.design, variables, column(table, name))
            for name in study.outputs
        }
    summary["curves"] = [
        {"x": plot.x, "y": name, "by": plot.by, "value": curve.label} | found
        for plot in plots_of(study)
        if not pa.types.is_string(table[plot.x].type) and is_a_grid(study)
        for curve in curves(study, table, plot)
        for name in plot.y
        if (found := course(column(table, plot.x)[curve.rows], column(table, name)[curve.rows]))
    ]
    if isinstance(study.design, Optimisation):
        summary["feasible"] = int(feasible_rows(study.design, table).sum())
        summary["trade_off"] = [
            {
                "sample": row,
                "parameters": {v.path: table[v.path][row].as_py() for v in variables},
                "outputs": {name: table[name][row].as_py() for name in study.design.outputs},
            }
            for row in trade_off_rows(study.design, table)
        ]
    return summary


def by_reason(errors: Sequence[str]) -> dict[str, int]:
    """Return how many errors there are of each reason, the most frequent first; what differs in
    numbers only is one reason, for which its first text stands."""
    first: dict[str, str] = {}
    counts: Counter[str] = Counter()
    for error in errors:
        counts[first.setdefault(_NUMBER.sub("#", error), error)] += 1
    return dict(counts.most_common())


_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


def column(table: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column of numbers, NaN where there is none."""
    return table[name].to_numpy().astype(float)


def _output(study: Study, dimensions: int, table: pa.Table, name: str) -> dict[str, Any]:
    values = column(table, name)
    found = np.isfinite(values)
    entry: dict[str, Any] = {"unit": unit_of(table, name)}
    if not found.any():
        return entry | {"least": None, "greatest": None, "median": None}
    for key, row in (("least", np.nanargmin(values)), ("greatest", np.nanargmax(values))):
        entry[key] = {"value": float(values[row]), "sample": int(row)}
    entry["median"] = float(np.median(values[found]))
    if isinstance(study.design, (Sobol, LatinHypercube)):
        if isinstance(study.design, Sobol):
            values = values[independent_rows(study.design, dimensions)]
        values = values[np.isfinite(values)]
        entry["band_95"] = (
            [float(limit) for limit in np.percentile(values, [2.5, 97.5])] if len(values) else None
        )
    return entry


def _sensitivity(
    design: Sobol, variables: Sequence[Variable], values: NDArray[np.float64]
) -> dict[str, Any] | None:
    indices = sobol_indices(values, design, len(variables))
    if indices is None:
        return None
    names = ("first", "first_confidence", "total", "total_confidence")
    return {
        "blocks": indices.blocks,
        "parameters": {
            variable.path: {name: float(getattr(indices, name)[place]) for name in names}
            for place, variable in enumerate(variables)
        },
    }
