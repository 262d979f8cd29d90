# SPDX-License-Identifier: Apache-2.0
"""All comparisons of the simulation core, side by side on one core: `towtank bench sim`."""

from __future__ import annotations

import json
import os
import platform
import sys
from pathlib import Path

import click
import deep_tow
import dense_newton
import first_step
import growth
import sweep
import vs_cabledyn
import vs_moordyn
from measuring import Outcome
from rich.console import Console
from rich.table import Table

ON_ONE_CORE = (
    vs_moordyn.measure,
    vs_cabledyn.measure,
    growth.measure_growth,
    growth.measure_step,
    growth.measure_waves,
    deep_tow.measure,
    first_step.measure,
    dense_newton.measure,
)


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def print_table(outcomes: list[Outcome]) -> None:
    table = Table(title=f"sim_core on one core of {processor()}", title_justify="left")
    table.add_column("")
    for heading in ("here", "peer", "ratio", "to reach", ""):
        table.add_column(heading, justify="right")
    for outcome in outcomes:
        for row in outcome.rows:
            verdict = {None: "", True: "[green]✓[/]", False: "[red]missed[/]"}[row.good]
            table.add_row(row.what, row.here, row.peer, row.ratio, row.to_reach, verdict)
        table.add_section()
    Console(width=None if sys.stdout.isatty() else 120).print(table)


@click.command()
@click.option("--json", "as_json", is_flag=True)
def main(as_json: bool) -> None:
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    outcomes = [measure() for measure in ON_ONE_CORE]
    os.sched_setaffinity(0, cores)
    outcomes.append(sweep.measure())
    if as_json:
        click.echo(json.dumps({outcome.key: outcome.value for outcome in outcomes}))
    else:
        print_table(outcomes)


if __name__ == "__main__":
    main()
