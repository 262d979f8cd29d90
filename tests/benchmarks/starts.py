# SPDX-License-Identifier: Apache-2.0
"""Whether tows drawn from all that a rig file leaves open find their start, and how long it takes:
`towtank bench starts`.

The draws are a Latin hypercube over the parameters of the rig's sensitivity study. Each starts as
it hangs at rest, and as it is towed at the carriage's speed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np
from measuring import say
from rich.console import Console
from rich.table import Table
from towtank_rig import Rig, load_rig
from towtank_sim.model import build_model
from towtank_study.designs import samples
from towtank_study.evaluation import changed
from towtank_study.loading import parse_study
from towtank_study.study import LatinHypercube
from towtank_study.variables import variables

import sim_core as sc

ROOT = Path(__file__).parents[2]
STUDIES = ROOT / "studies"


@dataclass(frozen=True)
class Starts:
    """What came of the starts of one rig: how many of them failed and with which words, by draw;
    CPU time of one, ms."""

    drawn: int
    failed: dict[int, str]
    median_ms: float
    mean_ms: float
    longest_ms: float


def draws(
    study_name: str, count: int, seed: int, chosen: Iterable[int] | None = None
) -> Iterator[Rig]:
    """Rigs over the parameters of a study, always the same for the same count and seed.

    chosen: of so many draws, those with these numbers; by default all.
    """
    file = parse_study((STUDIES / f"{study_name}.yaml").read_text(encoding="utf-8"), study_name)
    rig = load_rig(ROOT / "hardware" / "rigs" / f"{file.study.rig}.yaml")
    design = LatinHypercube(kind="latin_hypercube", samples=count, seed=seed)
    drawn = samples(design, variables(file, rig))
    for number in range(count) if chosen is None else chosen:
        yield changed(file.study, rig, drawn[number])[0]


def start(rig: Rig, segments: int, speed: float) -> sc.State:
    """The steady tow of a rig at a speed, m/s. Raises ConvergenceError."""
    model = build_model(rig, segments)
    height = rig.tow_point.height.value
    return sc.steady_tow(model, position=(0.0, 0.0, height), velocity=(speed, 0.0, 0.0))


def tried(rigs: list[Rig], segments: int, at_rest: bool) -> Starts:
    failed = {}
    took = []
    for number, rig in enumerate(rigs):
        begun = time.process_time()
        try:
            start(rig, segments, 0.0 if at_rest else rig.run.carriage_speed.value)
        except sc.ConvergenceError as error:
            failed[number] = str(error)
        took.append(1e3 * (time.process_time() - begun))
    return Starts(
        len(rigs), failed, float(np.median(took)), float(np.mean(took)), float(np.max(took))
    )


@click.command()
@click.option("--draws", "count", type=click.IntRange(min=1), default=1000, show_default=True)
@click.option("--segments", type=click.IntRange(min=0), default=0, help="0: the rig file's own.")
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--json", "as_json", is_flag=True)
def main(count: int, segments: int, seed: int, as_json: bool) -> None:
    """Print the table, and each start that failed."""
    found = {}
    for path in sorted(STUDIES.glob("sensitivity_*.yaml")):
        say(path.stem)
        rigs = list(draws(path.stem, count, seed))
        for at_rest in (True, False):
            found[path.stem, at_rest] = tried(rigs, segments, at_rest)
    if as_json:
        named = {
            f"{name} {'at rest' if at_rest else 'under way'}": asdict(starts)
            for (name, at_rest), starts in found.items()
        }
        click.echo(json.dumps(named))
        return
    table = Table("", "", "failed", "median", "mean", "longest")
    for (name, at_rest), starts in found.items():
        times = (starts.median_ms, starts.mean_ms, starts.longest_ms)
        table.add_row(
            name,
            "at rest" if at_rest else "under way",
            f"{len(starts.failed)} of {starts.drawn}",
            *(f"{ms:.1f} ms" for ms in times),
        )
    Console().print(table)
    for (name, at_rest), starts in found.items():
        for number, why in starts.failed.items():
            click.echo(f"{name} {'at rest' if at_rest else 'under way'}, draw {number}: {why}")


if __name__ == "__main__":
    main()
