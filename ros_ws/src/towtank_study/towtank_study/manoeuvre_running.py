# SPDX-License-Identifier: Apache-2.0
"""A whole manoeuvre study: from its file to a directory with histories, summary and report."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank_rig import RigError
from towtank_rig.document import Document

import sim_core as sc
from towtank_study.errors import StudyError
from towtank_study.execution import evaluate_all
from towtank_study.loading import validate
from towtank_study.manoeuvre import Manoeuvre
from towtank_study.manoeuvre_report import GIVEN, passages_table, report_html, summary
from towtank_study.manoeuvre_run import Passage, case_of, pass_through
from towtank_study.results import write_parquet

HISTORIES, SUMMARY, REPORT = "histories.parquet", "summary.json", "report.html"


@dataclass(frozen=True)
class PlannedManoeuvre:
    """A manoeuvre study that can be run: its text, and all cases by name."""

    document: Document
    study: Manoeuvre
    cases: dict[str, Manoeuvre]


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


def run_manoeuvre(
    planned: PlannedManoeuvre,
    directory: Path,
    executor: Executor,
    workers: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> dict[str, Any]:
    """Run all cases into a new directory and return the summary; StudyError."""
    try:
        directory.mkdir(parents=True)
    except FileExistsError:
        raise StudyError(f"{directory} exists; give a new one with --out") from None
    except OSError as error:
        raise StudyError(
            f"cannot write {directory}: {error.strerror}; give another directory with --out"
        ) from None
    found: dict[int, Passage] = {}
    for chunk in evaluate_all(_numbered, list(enumerate(planned.cases.items())), executor, workers):
        found |= dict(chunk)
        progress(len(found), len(planned.cases))
    passages = [found[number] for number in range(len(planned.cases))]
    texts = summary(planned.study, passages)
    write_parquet(passages_table(passages, {"study": planned.document.text}), directory / HISTORIES)
    (directory / "study.yaml").write_text(planned.document.text, encoding="utf-8")
    (directory / SUMMARY).write_text(json.dumps(texts, indent=2) + "\n", encoding="utf-8")
    (directory / REPORT).write_text(report_html(planned.study, passages, texts), encoding="utf-8")
    return texts


def _numbered(number: int, case: tuple[str, Manoeuvre]) -> tuple[int, Passage]:
    name, study = case
    try:
        return number, pass_through(name, study)
    except (sc.InvalidInput, sc.ConvergenceError) as error:
        raise StudyError(f"case {name!r} cannot be simulated: {error}") from None
