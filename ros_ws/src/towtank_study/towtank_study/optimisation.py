# SPDX-License-Identifier: Apache-2.0
"""Optimisation of a tow: the designs that no other one beats in every objective at once.

The non-dominated sorting genetic algorithm NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002)
as pymoo has it, over the parameters' ranges. With the same seed and the same outcomes it proposes
the same samples, which is how a study that was stopped goes on.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from towtank_study.evaluation import Outcome
from towtank_study.study import Limit, Optimisation
from towtank_study.variables import Value, Variable, from_unit_cube

Array = NDArray[np.float64]

_UNSOLVED = 1e30
"""Objective and excess of a sample that could not be solved: worse than any other."""


def propose(
    design: Optimisation, variables: Sequence[Variable]
) -> Generator[list[dict[str, Value]], list[Outcome], None]:
    """Yield one generation of samples after the other; send it the outcomes of each."""
    # Half a second to import, which other studies need not spend.
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    problem = Problem(
        n_var=len(variables),
        n_obj=len(design.minimise),
        n_ieq_constr=len(design.limits),
        xl=0.0,
        xu=1.0,
    )
    algorithm = NSGA2(pop_size=design.population)
    algorithm.setup(problem, termination=("n_gen", design.generations), seed=design.seed)
    while algorithm.has_next():
        generation = algorithm.ask()
        outcomes = yield from_unit_cube(generation.get("X"), variables)
        measures = {
            "F": np.array([objectives(design, outcome.outputs) for outcome in outcomes]),
            "G": np.array([excesses(design, outcome.outputs) for outcome in outcomes]),
        }
        if not design.limits:
            del measures["G"]
        Evaluator().eval(StaticProblem(problem, **measures), generation)
        algorithm.tell(infills=generation)


def objectives(design: Optimisation, outputs: dict[str, float]) -> list[float]:
    """Return what is to be minimised."""
    values = [outputs[name] for name in design.minimise]
    return values if all(map(math.isfinite, values)) else [_UNSOLVED] * len(values)


def excesses(design: Optimisation, outputs: dict[str, float]) -> list[float]:
    """Return by how much each limit is passed, as a share of it; not above 0 where it is kept."""
    return [_excess(limit, outputs[limit.output]) for limit in design.limits]


def _excess(limit: Limit, value: float) -> float:
    if not math.isfinite(value):
        return _UNSOLVED
    over = value - limit.greatest if limit.greatest is not None else -math.inf
    under = limit.least - value if limit.least is not None else -math.inf
    scale = max(abs(bound) for bound in (limit.least, limit.greatest) if bound is not None)
    return max(over, under) / (scale or 1.0)


def feasible_rows(design: Optimisation, table: pa.Table) -> NDArray[np.bool_]:
    """Return which samples of a table of results were solved and keep all limits, shape (rows,)."""
    columns = {name: _column(table, name) for name in design.outputs}
    return np.array(
        [
            all(math.isfinite(column[row]) for column in columns.values())
            and all(_excess(limit, columns[limit.output][row]) <= 0.0 for limit in design.limits)
            for row in range(table.num_rows)
        ],
        dtype=bool,
    )


def trade_off_rows(design: Optimisation, table: pa.Table) -> list[int]:
    """Return the rows that keep all limits and that no other such row beats: in no objective
    worse, in one better. In the order of the first objective."""
    rows = np.flatnonzero(feasible_rows(design, table))
    values = np.column_stack([_column(table, name)[rows] for name in design.minimise])
    kept = [
        int(row)
        for row, value in zip(rows, values, strict=True)
        if not np.any(np.all(values <= value, axis=1) & np.any(values < value, axis=1))
    ]
    return sorted(kept, key=lambda row: table[design.minimise[0]][row].as_py())


def _column(table: pa.Table, name: str) -> Array:
    return table[name].to_numpy().astype(float)
