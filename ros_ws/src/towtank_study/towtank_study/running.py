# SPDX-License-Identifier: Apache-2.0
"""A whole study: from its file to a directory with tables, summary and report.

The directory holds the texts (study.yaml, of a rig's tow also rig.yaml), while the study runs
journal.jsonl, and in the end results.parquet, histories.parquet if the study has any, summary.json
and report.html. A study that was stopped, by whatever, goes on from the journal.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import Any, TypeVar

import pyarrow.parquet as pq
from towtank_rig.document import Document

from towtank_study.errors import StudyError
from towtank_study.execution import evaluate_all
from towtank_study.journal import Journal
from towtank_study.manoeuvre_study import plan_manoeuvre
from towtank_study.planned import RESULTS, Argument, Found, Further, Planned
from towtank_study.results import read_metadata, write_parquet
from towtank_study.tow_study import plan_tows

Progress = Callable[[int, int], None]
"""Told how many of how many samples are done."""

JOURNAL = "journal.jsonl"
SUMMARY = "summary.json"
REPORT = "report.html"

Sent = TypeVar("Sent")


def plan_study(document: Document, find_rig: Callable[[str], Path]) -> Planned[Any, Any]:
    """Make a study of either kind. find_rig: gives the path of a rig that comes with the project.

    Raises StudyError and RigError.
    """
    if "manoeuvre" in document.data:
        return plan_manoeuvre(document)
    return plan_tows(document, find_rig)


def run_study(
    planned: Planned[Any, Any],
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
    if not all((directory / name).exists() for name in planned.table_names):
        with Journal(directory / JOURNAL, planned.fingerprint, planned.finding) as journal:
            _evaluate(planned, directory, journal, executor, workers, progress)
    (directory / JOURNAL).unlink(missing_ok=True)
    progress(planned.most_samples, planned.most_samples)
    return _conclude(planned, directory)


def _claim(directory: Path, planned: Planned[Any, Any]) -> None:
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
    planned: Planned[Argument, Found],
    directory: Path,
    journal: Journal[Found],
    executor: Executor,
    workers: int,
    progress: Progress,
) -> None:
    """Evaluate what the journal lacks, and write the tables."""

    def evaluate(
        function: Callable[[int, Any], Further], samples: Sequence[tuple[int, Any]], /
    ) -> list[Further]:
        chunks = evaluate_all(function, samples, executor, workers)
        return [one for chunk in chunks for one in chunk]

    evaluation = planned.evaluation()
    arguments: list[Argument] = []
    progress(len(journal.findings), planned.most_samples)
    batches = planned.batches()
    findings: list[Found] | None = None  # a generator is started with None
    while (batch := _next(batches, findings)) is not None:
        numbered = list(enumerate(batch, start=len(arguments)))
        arguments += batch
        missing = [one for one in numbered if one[0] not in journal.findings]
        with closing(evaluate_all(evaluation, missing, executor, workers)) as chunks:
            for chunk in chunks:
                journal.append(chunk)
                progress(len(journal.findings), planned.most_samples)
        findings = [journal.findings[number] for number, _ in numbered]
    everything = [journal.findings[number] for number in range(len(arguments))]
    tables = planned.tables(arguments, everything, evaluate)
    for name in planned.table_names:
        table = tables[name]
        metadata = planned.metadata | {
            key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()
        }
        write_parquet(table.replace_schema_metadata(metadata), directory / name)


def _next(batches: Generator[Argument, Sent, None], findings: Sent | None) -> Argument | None:
    try:
        return batches.send(findings)  # type: ignore[arg-type]
    except StopIteration:
        return None


def _conclude(planned: Planned[Any, Any], directory: Path) -> dict[str, Any]:
    """Write what follows from the tables, and the texts, unless they are there."""
    tables = {name: pq.read_table(directory / name) for name in planned.table_names}
    summary = planned.summary(tables)
    for name, text in (
        *((f"{name}.yaml", text) for name, text in planned.texts.items()),
        (SUMMARY, json.dumps(summary, indent=2) + "\n"),
        (REPORT, planned.report(tables, summary)),
    ):
        path = directory / name
        if not path.exists():
            partial = path.with_suffix(".partial")
            partial.write_text(text, encoding="utf-8")
            partial.rename(path)
    return summary
