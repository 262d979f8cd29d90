# SPDX-License-Identifier: Apache-2.0
"""A manoeuvre study, planned: its cases are its samples."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from towtank_rig import RigError
from towtank_rig.document import Document

import sim_core as sc
from towtank_study.errors import StudyError
from towtank_study.loading import validate
from towtank_study.manoeuvre import Manoeuvre
from towtank_study.manoeuvre_run import FIGURES, Passage, case_of, pass_through
from towtank_study.planned import HISTORIES, RESULTS, EvaluateAll, Planned
from towtank_study.report import manoeuvre_report
from towtank_study.results import table_with_units, unit_of

GIVEN = "as given"
"""Name of the case that changes nothing."""

Case = tuple[str, Manoeuvre]


@dataclass(frozen=True)
class PlannedManoeuvre(Planned[Case, Passage]):
    """A manoeuvre study that can be run: its text, and all cases by name."""

    document: Document
    study: Manoeuvre
    cases: dict[str, Manoeuvre]

    @property
    def name(self) -> str:
        return self.study.name

    @property
    def texts(self) -> dict[str, str]:
        return {"study": self.document.text}

    @property
    def most_samples(self) -> int:
        return len(self.cases)

    @property
    def finding(self) -> type[Passage]:
        return Passage

    @property
    def table_names(self) -> list[str]:
        return [HISTORIES, RESULTS]

    def evaluation(self) -> Callable[[int, Case], Passage]:
        return _evaluate

    def batches(self) -> Generator[list[Case], list[Passage], None]:
        yield list(self.cases.items())

    def tables(
        self, arguments: list[Case], findings: list[Passage], evaluate: EvaluateAll
    ) -> dict[str, pa.Table]:
        names = [name for name, _ in arguments]
        return {HISTORIES: _histories(names, findings), RESULTS: _results(names, findings)}

    def summary(self, tables: Mapping[str, pa.Table]) -> dict[str, Any]:
        """Return the figures by case, with their units."""
        results = tables[RESULTS]
        found = [name for name in FIGURES if name in results.column_names]
        return {
            "study": self.study.name,
            "statement": self.study.statement,
            "units": {name: unit_of(results, name) for name in found},
            "cases": {
                row["case"]: {
                    "changes": self.study.cases.get(row["case"], {}),
                    "figures": {name: row[name] for name in found},
                }
                for row in results.to_pylist()
            },
        }

    def report(self, tables: Mapping[str, pa.Table], summary: dict[str, Any]) -> str:
        return manoeuvre_report(self.study, tables[HISTORIES], summary)


def plan_manoeuvre(document: Document) -> PlannedManoeuvre:
    """Make a study of a document; StudyError for its first fault or that of one of its cases."""
    study = validate(document, Manoeuvre)
    cases = {GIVEN: study}
    for name, changes in study.cases.items():
        try:
            cases[name] = case_of(document, changes)
        except (StudyError, RigError) as error:
            raise StudyError(f"case {name!r}: {error}") from None
    return PlannedManoeuvre(document, study, cases)


def _evaluate(number: int, case: Case) -> Passage:
    name, study = case
    try:
        return pass_through(number, study)
    except (sc.InvalidInput, sc.ConvergenceError) as error:
        raise StudyError(f"case {name!r} cannot be simulated: {error}") from None


def _results(names: list[str], passages: list[Passage]) -> pa.Table:
    """A row for each case: its name and its figures."""
    columns = {
        "case": ("", pa.array(names, pa.string())),
        **{
            name: (FIGURES[name], pa.array([p.figures[name] for p in passages], pa.float64()))
            for name in passages[0].figures
        },
    }
    return table_with_units(columns)


def _histories(names: list[str], passages: list[Passage]) -> pa.Table:
    """A row for each case and instant: positions of ship and body, velocity of the body, top
    tension."""
    of_rows = [name for name, p in zip(names, passages, strict=True) for _ in p.time]
    columns: dict[str, tuple[str, pa.Array]] = {
        "case": ("", pa.array(of_rows, pa.string())),
        "time": ("s", pa.array(np.concatenate([p.time for p in passages]))),
    }
    for name, unit in (("ship", "m"), ("body", "m"), ("body_velocity", "m/s")):
        stacked = np.concatenate([getattr(p, name) for p in passages])
        for place, axis in enumerate("xyz"):
            columns[f"{name}_{axis}"] = (unit, pa.array(np.ascontiguousarray(stacked[:, place])))
    columns["top_tension"] = ("N", pa.array(np.concatenate([p.top_tension for p in passages])))
    return table_with_units(columns)
