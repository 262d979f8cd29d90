# SPDX-License-Identifier: Apache-2.0
"""The optimiser on a problem with a known trade-off, and in a whole study."""

import math

import numpy as np
import pyarrow as pa
import pytest
import scipy.stats
from small_study import SMALL
from towtank_study.designs import batches
from towtank_study.evaluation import Outcome
from towtank_study.optimisation import excesses, trade_off_rows
from towtank_study.running import run_study
from towtank_study.study import Optimisation
from towtank_study.variables import Variable

TWO = Optimisation(
    kind="optimisation",
    minimise=("heave_ratio_nose", "top_tension"),
    limits=({"output": "fish_depth", "least": 1.0},),
    population=24,
    generations=40,
)
VARIABLES = [
    Variable(path, "1", 0.0, (-2.0, 4.0), scipy.stats.uniform(-2.0, 6.0)) for path in ("x", "y")
]


def schaffer(x: float, y: float) -> dict[str, float]:
    """Schaffer's problem, x² and (x − 2)², with a second variable that only costs; the trade-off
    is y = 0, 0 ≤ x ≤ 2, of which the limit x ≥ 1 leaves the upper half."""
    return {
        "heave_ratio_nose": x**2 + y**2,
        "top_tension": (x - 2.0) ** 2 + y**2,
        "fish_depth": x,
    }


def solve(design: Optimisation) -> list[tuple[dict, Outcome]]:
    proposals = batches(design, VARIABLES)
    found: list[tuple[dict, Outcome]] = []
    outcomes = None
    while True:
        try:
            batch = proposals.send(outcomes)
        except StopIteration:
            return found
        outcomes = [
            Outcome(len(found) + place, schaffer(**sample), None)
            for place, sample in enumerate(batch)
        ]
        found += zip(batch, outcomes, strict=True)


def table_of(found: list[tuple[dict, Outcome]]) -> pa.Table:
    names = found[0][1].outputs
    columns = {name: [outcome.outputs[name] for _, outcome in found] for name in names}
    return pa.table({"x": [sample["x"] for sample, _ in found], **columns})


def test_finds_the_known_trade_off():
    table = table_of(solve(TWO))
    rows = trade_off_rows(TWO, table)
    x = table["x"].take(rows).to_numpy()
    assert x.min() >= 1.0
    # The front is spread over its range, which pymoo's crowding distance sees to; ends within 5 %.
    assert x.min() == pytest.approx(1.0, abs=0.05)
    assert x.max() == pytest.approx(2.0, abs=0.05)
    first, second = (table[name].take(rows).to_numpy() for name in TWO.minimise)
    # On the front √f₁ + √f₂ = 2; y ≠ 0 and generations that end leave a little above it.
    assert np.all(np.sqrt(first) + np.sqrt(second) < 2.05)
    assert np.all(np.diff(first) > 0)
    assert np.all(np.diff(second) < 0)


def test_the_same_seed_gives_the_same_samples():
    short = TWO.model_copy(update={"generations": 3})
    assert solve(short) == solve(short)
    other = solve(short.model_copy(update={"seed": 2}))
    assert other[0][0] != solve(short)[0][0]


def test_what_cannot_be_solved_keeps_no_limit():
    assert excesses(TWO, {"fish_depth": math.nan})[0] > 1e6
    assert excesses(TWO, {"fish_depth": 1.5})[0] == pytest.approx(-0.5)


def test_a_study_that_optimises(plan, one_thread, tmp_path):
    text = SMALL.replace("values: [1.0, 1.5, 2.0]", "range: [0.5, 3.0]").replace(
        "design: {kind: full_factorial}",
        "design:\n"
        "  kind: optimisation\n"
        "  minimise: [heave_ratio_nose, top_tension]\n"
        "  limits: [{output: depressor_heave, greatest: 1.0}]\n"
        "  population: 4\n"
        "  generations: 2\n",
    )
    planned = plan(text)
    summary = run_study(planned, tmp_path / "o", one_thread, 1)
    assert summary["samples"] == planned.most_samples == 8
    assert summary["feasible"] == 8  # a heave of a metre is beyond the crank
    ratios = [entry["outputs"]["heave_ratio_nose"] for entry in summary["trade_off"]]
    assert min(ratios) == summary["outputs"]["heave_ratio_nose"]["least"]["value"]
    assert 'id="trade-off"' in (tmp_path / "o" / "report.html").read_text()
