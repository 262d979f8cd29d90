# SPDX-License-Identifier: Apache-2.0
"""`towtank sweep`: a study over the parameters of a rig."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path

import click
import psutil
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from towtank_rig import RigError
from towtank_study.errors import StudyError
from towtank_study.execution import dask_cluster, local_pool
from towtank_study.loading import read_document
from towtank_study.running import REPORT, plan_study, run_study

from towtank_bringup.rigs import rig_path


@click.command(name="sweep")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Directory for the results: a new one, or that of the same study to go on with it.",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes (default: one a core).")
@click.option("--scheduler", help="Address of a Dask scheduler to compute on, tcp://HOST:PORT.")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json instead of the table.")
def command(
    study: Path, out: Path | None, workers: int | None, scheduler: str | None, as_json: bool
) -> None:
    """Run the STUDY (a YAML file) on all cores and write results, summary and report.

    What was stopped goes on where it was when the same command is given again.
    """
    if workers and scheduler:
        raise click.UsageError("--workers and --scheduler exclude each other: give one")
    try:
        planned = plan_study(read_document(study), rig_path)
        name = planned.name
        directory = out or Path("sweeps") / f"{name}-{planned.fingerprint[:8]}"
        with (
            _executor(workers, scheduler) as (executor, parallel),
            _bar(name, planned.most_samples) as bar,
        ):
            summary = run_study(planned, directory, executor, parallel, bar)
    except (StudyError, RigError) as error:
        raise click.ClickException(str(error)) from error
    if as_json:
        click.echo(json.dumps(summary, indent=2))
    elif "cases" in summary:
        _print_figures(summary, directory)
    else:
        _print_summary(summary, directory)


@contextlib.contextmanager
def _executor(workers: int | None, scheduler: str | None) -> Iterator[tuple[Executor, int]]:
    if scheduler:
        with dask_cluster(scheduler) as cluster:
            yield cluster
        return
    count = workers or len(psutil.Process().cpu_affinity())
    with local_pool(count) as pool:
        yield pool, count


@contextlib.contextmanager
def _bar(name: str, total: int) -> Iterator:
    """A progress bar on standard error, to be told how many of how many samples are done."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task(name, total=total)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def _print_summary(summary: dict, directory: Path) -> None:
    console = Console(markup=False)
    table = Table(title=f"{summary['study']}: {summary['samples']} samples")
    for heading in ("", "least", "median", "greatest", "95 % band"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name, output in summary["outputs"].items():
        band = output.get("band_95")
        table.add_row(
            name if output["unit"] == "1" else f"{name}, {output['unit']}",
            _number(output["least"] and output["least"]["value"]),
            _number(output["median"]),
            _number(output["greatest"] and output["greatest"]["value"]),
            f"{_number(band[0])} … {_number(band[1])}" if band else "",
        )
    console.print(table)
    if summary["failed"]:
        reason, count = next(iter(summary["errors"].items()))
        console.print(
            f"{summary['failed']} samples could not be solved, {count} of them: {reason}",
            soft_wrap=True,
        )
    console.print(f"report: {directory / REPORT}", soft_wrap=True)


def _print_figures(summary: dict, directory: Path) -> None:
    console = Console(markup=False)
    table = Table(title=summary["study"])
    table.add_column("")
    for case in summary["cases"]:
        table.add_column(case, justify="right")
    for figure, unit in summary["units"].items():
        values = [case["figures"][figure] for case in summary["cases"].values()]
        table.add_row(f"{figure}, {unit}", *map(_number, values))
    console.print(table)
    console.print(f"report: {directory / REPORT}", soft_wrap=True)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
