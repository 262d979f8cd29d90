# SPDX-License-Identifier: Apache-2.0
"""A whole study: from its file to a directory with results, summary and report.

The directory holds study.yaml and rig.yaml (the texts), while the study runs journal.jsonl, and in
the end results.parquet, summary.json, report.html, and histories.parquet if asked for. A study that
was stopped, by whatever, goes on from the journal.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Generator
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from towtank_rig import Rig, load_rig
from towtank_rig.document import Document

from towtank_study.designs import Sample, batches, most_samples
from towtank_study.errors import StudyError
from towtank_study.evaluation import Outcome, TowEvaluation
from towtank_study.execution import evaluate_all
from towtank_study.histories import TowHistory, histories_table
from towtank_study.journal import Journal
from towtank_study.loading import StudyFile, validate
from towtank_study.report import report_html
from towtank_study.results import read_metadata, results_table, write_parquet
from towtank_study.software import software, software_text
from towtank_study.study import Study
from towtank_study.summary import summarise
from towtank_study.variables import Variable, variables

Proposals = Generator[list[Sample], list[Outcome], None]
Progress = Callable[[int, int], None]
"""Told how many of how many samples are done."""

JOURNAL = "journal.jsonl"
RESULTS = "results.parquet"
HISTORIES = "histories.parquet"
SUMMARY = "summary.json"
REPORT = "report.html"


@dataclass(frozen=True)
class PlannedStudy:
    """A study that can be run: its file, its rig, and what they come to."""

    file: StudyFile
    rig: Rig
    variables: list[Variable]
    most_samples: int

    @cached_property
    def software(self) -> str:
        """What computes, as it was when this was first asked for."""
        return software_text(software())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 over all that the results depend on: both texts and the software."""
        parts = [self.file.text, self.rig.text, self.software]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @property
    def metadata(self) -> dict[str, str]:
        """What the table of results says about itself."""
        return {
            "study": self.file.text,
            "rig": self.rig.text,
            "software": self.software,
            "fingerprint": self.fingerprint,
        }


def plan_study(document: Document, find_rig: Callable[[str], Path]) -> PlannedStudy:
    """Make a study and find its rig. find_rig: gives the path of a rig that comes with the project.

    Raises StudyError and RigError.
    """
    file = StudyFile(validate(document, Study), document)
    beside = Path(document.source).parent / file.study.rig
    rig = load_rig(beside if beside.is_file() else find_rig(file.study.rig))
    if file.study.changes:
        rig = rig.replace(file.study.changes)
    found = variables(file, rig)
    planned = PlannedStudy(file, rig, found, most_samples(file.study.design, found))
    for number in file.study.histories:
        if number >= planned.most_samples:
            raise file.error(
                "histories", f"there is no sample {number}", f"take 0 to {planned.most_samples - 1}"
            )
    return planned


def run_study(
    planned: PlannedStudy,
    directory: Path,
    executor: Executor,
    workers: int,
    progress: Progress = lambda done, total: None,
) -> dict[str, Any]:
    """Run a study, or what is left of it, and return its summary.

    directory: new, or one in which the same study was begun. workers: how many the executor has.
    Raises StudyError.
    """
    _claim(directory, planned)
    results = directory / RESULTS
    if not results.exists():
        with Journal(directory / JOURNAL, planned.fingerprint) as journal:
            samples = _evaluate(planned, journal, executor, workers, progress)
            outcomes = [journal.outcomes[number] for number in range(len(samples))]
            table = results_table(planned.variables, samples, outcomes, planned.metadata)
            write_parquet(table, results)
    if planned.file.study.histories and not (directory / HISTORIES).exists():
        histories = _histories(planned, pq.read_table(results), executor, workers)
        write_parquet(histories, directory / HISTORIES)
    (directory / JOURNAL).unlink(missing_ok=True)
    progress(planned.most_samples, planned.most_samples)
    return _conclude(planned, directory)


def _claim(directory: Path, planned: PlannedStudy) -> None:
    """Make the directory, or make sure that it is this study's."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        held = {path.name for path in directory.iterdir()}
        if not held:
            (directory / JOURNAL).touch(exist_ok=False)
    except OSError as error:
        raise StudyError(
            f"cannot write {directory}: {error.strerror}; give another directory with --out"
        ) from None
    if RESULTS in held:
        if read_metadata(directory / RESULTS).get("fingerprint") != planned.fingerprint:
            raise StudyError(
                f"{directory} holds another study, rig or version of towtank; give a new directory "
                f"with --out"
            )
    elif held and JOURNAL not in held:
        raise StudyError(f"{directory} exists and holds no study; give a new one with --out")


def _evaluate(
    planned: PlannedStudy, journal: Journal, executor: Executor, workers: int, progress: Progress
) -> list[Sample]:
    """Evaluate what the journal lacks, and return all samples."""
    evaluation = TowEvaluation(planned.file.text, planned.rig.text)
    samples: list[Sample] = []
    progress(len(journal.outcomes), planned.most_samples)
    proposals = batches(planned.file.study.design, planned.variables)
    outcomes: list[Outcome] | None = None  # a generator is started with None
    while (batch := _next_batch(proposals, outcomes)) is not None:
        numbered = list(enumerate(batch, start=len(samples)))
        samples += batch
        missing = [
            (number, values) for number, values in numbered if number not in journal.outcomes
        ]
        with closing(evaluate_all(evaluation, missing, executor, workers)) as chunks:
            for chunk in chunks:
                journal.append(chunk)
                progress(len(journal.outcomes), planned.most_samples)
        outcomes = [journal.outcomes[number] for number, _ in numbered]
    return samples


def _next_batch(proposals: Proposals, outcomes: list[Outcome] | None) -> list[Sample] | None:
    try:
        return proposals.send(outcomes)  # type: ignore[arg-type]
    except StopIteration:
        return None


def _histories(
    planned: PlannedStudy, table: pa.Table, executor: Executor, workers: int
) -> pa.Table:
    """Simulate the chosen samples again and return what they did over time."""
    history = TowHistory(planned.file.text, planned.rig.text)
    paths = [variable.path for variable in planned.variables]
    wanted = [
        (number, {path: table[path][number].as_py() for path in paths})
        for number in planned.file.study.histories
        if number < table.num_rows  # an optimisation may end early
    ]
    runs = [run for chunk in evaluate_all(history, wanted, executor, workers) for run in chunk]
    return histories_table(sorted(runs, key=lambda run: run[0]))


def _conclude(planned: PlannedStudy, directory: Path) -> dict[str, Any]:
    """Write what follows from the results, and the texts, unless they are there."""
    table = pq.read_table(directory / RESULTS)
    histories = None
    if planned.file.study.histories:
        histories = pq.read_table(directory / HISTORIES)
    summary = summarise(planned.file.study, planned.variables, table)
    for name, text in (
        ("study.yaml", planned.file.text),
        ("rig.yaml", planned.rig.text),
        (SUMMARY, json.dumps(summary, indent=2) + "\n"),
        (REPORT, report_html(planned.file.study, planned.variables, table, summary, histories)),
    ):
        path = directory / name
        if not path.exists():
            partial = path.with_suffix(".partial")
            partial.write_text(text, encoding="utf-8")
            partial.rename(path)
    return summary
