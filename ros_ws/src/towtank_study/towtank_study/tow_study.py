# SPDX-License-Identifier: Apache-2.0
"""A parameter study of a rig's tow, planned."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
from towtank_rig import Rig, load_rig
from towtank_rig.document import Document
from towtank_rig.loading import replaced

from towtank_study.designs import Sample, batches, most_samples
from towtank_study.evaluation import Outcome, TowEvaluation
from towtank_study.histories import TowHistory, histories_table
from towtank_study.loading import StudyFile, validate
from towtank_study.planned import HISTORIES, RESULTS, EvaluateAll, Planned
from towtank_study.report import tows_report
from towtank_study.results import results_table
from towtank_study.study import Study
from towtank_study.summary import summarise
from towtank_study.variables import Variable, variables


@dataclass(frozen=True)
class PlannedTows(Planned[Sample, Outcome]):
    """A parameter study that can be run: its file, its rig, and what they come to."""

    file: StudyFile
    rig: Rig
    variables: list[Variable]

    @property
    def name(self) -> str:
        return self.file.study.name

    @property
    def texts(self) -> dict[str, str]:
        return {"study": self.file.text, "rig": self.rig.text}

    @property
    def most_samples(self) -> int:
        return most_samples(self.file.study.design, self.variables)

    @property
    def finding(self) -> type[Outcome]:
        return Outcome

    @property
    def table_names(self) -> list[str]:
        return [HISTORIES, RESULTS] if self.file.study.histories else [RESULTS]

    def evaluation(self) -> TowEvaluation:
        return TowEvaluation(self.file.text, self.rig.text)

    def batches(self) -> Generator[list[Sample], list[Outcome], None]:
        return batches(self.file.study.design, self.variables)

    def tables(
        self, arguments: list[Sample], findings: list[Outcome], evaluate: EvaluateAll
    ) -> dict[str, pa.Table]:
        """The results; and what the chosen samples, simulated again, did over time."""
        wanted = [
            (number, arguments[number])
            for number in self.file.study.histories
            if number < len(arguments)  # an optimisation may end early
        ]
        runs = evaluate(TowHistory(self.file.text, self.rig.text), wanted)
        return {
            HISTORIES: histories_table(sorted(runs, key=lambda run: run[0])),
            RESULTS: results_table(self.variables, arguments, findings),
        }

    def summary(self, tables: Mapping[str, pa.Table]) -> dict[str, Any]:
        return summarise(self.file.study, self.variables, tables[RESULTS])

    def report(self, tables: Mapping[str, pa.Table], summary: dict[str, Any]) -> str:
        histories = tables.get(HISTORIES)
        return tows_report(self.file.study, self.variables, tables[RESULTS], summary, histories)


def plan_tows(document: Document, find_rig: Callable[[str], Path]) -> PlannedTows:
    """Make a study and find its rig. find_rig: gives the path of a rig that comes with the project.

    Raises StudyError and RigError.
    """
    file = StudyFile(validate(document, Study), document)
    beside = Path(document.source).parent / file.study.rig
    rig = load_rig(beside if beside.is_file() else find_rig(file.study.rig))
    if file.study.changes:
        rig = replaced(rig, file.study.changes)
    planned = PlannedTows(file, rig, variables(file, rig))
    for number in file.study.histories:
        if number >= planned.most_samples:
            raise file.error(
                "histories", f"there is no sample {number}", f"take 0 to {planned.most_samples - 1}"
            )
    return planned
