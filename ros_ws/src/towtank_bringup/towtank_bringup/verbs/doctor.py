# SPDX-License-Identifier: Apache-2.0
"""`towtank doctor`: look whether a connected board is well, with numbers."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from towtank_daq.board import AdcBoard, BoardError, Scan
from towtank_daq.description import installed_description, load_description
from towtank_daq.doctor import REST_S, Examination, examine, port_checks
from towtank_daq.protocol import Protocol
from towtank_daq.self_test import Check
from towtank_daq.serial_port import SerialPort
from towtank_rig import Rig, RigError, load_rig

from towtank_bringup.plan import PlanError
from towtank_bringup.processes import ProcessError
from towtank_bringup.progress import ProgressLine
from towtank_bringup.rigs import rig_path
from towtank_bringup.virtual_station import virtual_station

_END_S = 0.5  # of the stream, in which the virtual shafts stand where they were to go
Move = Callable[[float, float], None]
"""Puts the shafts by so many turns of the crank and so many m of the carriage from their start."""


@click.command(name="doctor")
@click.option("--port", type=click.Path(path_type=Path), help="Serial port of the ADC board.")
@click.option("--virtual", is_flag=True, help="The virtual board instead.")
@click.option("--rig", "rig_name", default="nit_calicut_2012", help="Rig file, or name of one.")
@click.option(
    "--seconds", type=click.FloatRange(2.0, 3600.0), default=10.0, help="Of streaming (10)."
)
@click.option(
    "--turns",
    type=click.FloatRange(-100.0, 100.0),
    help="Turn the crank by so many in its running sense while the board streams.",
)
@click.option(
    "--travel",
    type=click.FloatRange(-100.0, 100.0),
    help="Move the carriage by so many metres along the run while the board streams.",
)
@click.option("--seed", type=int, default=1, help="Virtual board: seed of its sensors' errors (1).")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(
    port: Path | None,
    virtual: bool,
    rig_name: str,
    seconds: float,
    turns: float | None,
    travel: float | None,
    seed: int,
    as_json: bool,
) -> None:
    """Identify, self-test, noise, encoders, clock and counters of a board, against their limits.

    The sensors must be at rest, in air or in water; crank and carriage for the first second.
    """
    if (port is None) != virtual:
        raise click.UsageError("give one of --port and --virtual")
    say = ProgressLine()
    try:
        rig_file = rig_path(rig_name)
        rig = load_rig(rig_file)
        with _place(port, rig, rig_file, seed) as (path, move):
            found = _examine(path, rig, seconds, turns, travel, move, say)
    except (RigError, PlanError, ProcessError, BoardError, OSError) as error:
        raise click.ClickException(str(error)) from error
    finally:
        say.close()
    if as_json:
        click.echo(json.dumps(_as_json(found), indent=2))
    else:
        _print(found)
    if found.failures:
        names = ", ".join(check.name for check in found.failures)
        raise click.ClickException(
            f"{len(found.failures)} of {len(found.all)} checks failed: {names}; the mends are above"
        )


@contextlib.contextmanager
def _place(port: Path | None, rig: Rig, rig_file: Path, seed: int) -> Iterator[tuple[Path, Move]]:
    """The port, and what puts the shafts there."""
    if port is not None:
        yield port, lambda turns, travel: None  # somebody moves them by hand
        return
    with virtual_station(rig, rig_file, seed) as (virtual_port, sensors):
        yield (
            virtual_port,
            lambda turns, travel: sensors.move({"angle_deg": 360.0 * turns, "travel_m": travel}),
        )


def _examine(
    path: Path,
    rig: Rig,
    seconds: float,
    turns: float | None,
    travel: float | None,
    move: Move,
    say: ProgressLine,
) -> Examination:
    description = load_description(installed_description())
    protocol = Protocol(description)
    line = SerialPort(str(path), description.wire.baud)
    scans: list[Scan] = []
    requests = [f"turn the crank by {turns:g} turns"] if turns else []
    requests += [f"move the carriage by {travel:g} m"] if travel else []

    def passed(passed_s: float) -> None:
        told = requests if passed_s >= REST_S else ["leave crank and carriage alone"]
        say(f"{', '.join(told) or 'streaming'}: {passed_s:.1f} of {seconds:g} s")
        share = (passed_s - REST_S) / (seconds - REST_S - _END_S)
        share = min(max(share, 0.0), 1.0)
        move(share * (turns or 0.0), share * (travel or 0.0))

    try:
        say("looking for the board, and letting it test itself")
        # Without patience: a line that goes is a finding
        board = AdcBoard(line, protocol, scans.append, say, patience_s=0.0)
        others = line.suspects()
        found = examine(
            board,
            scans,
            rig,
            description,
            seconds=seconds,
            turns=turns,
            travel=travel,
            passed=passed,
        )
        port = port_checks(others, line.is_exclusive, board.statistics.line_repairs)
        return dataclasses.replace(found, checks={"port": port, **found.checks})
    finally:
        line.close()


def _as_json(found: Examination) -> dict[str, object]:
    return {
        "passed": not found.failures,
        "facts": found.facts,
        "checks": [
            {
                "section": section,
                "name": check.name,
                "value": _finite(check.value),
                "unit": check.unit,
                "minimum": _finite(check.minimum),
                "maximum": _finite(check.maximum),
                "passed": check.passed,
                "mend": check.mend,
            }
            for section, checks in found.checks.items()
            for check in checks
        ],
        "not_checked": [dataclasses.asdict(left) for left in found.not_checked],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _print(found: Examination) -> None:
    console = Console(highlight=False, markup=False)
    console.print(", ".join(f"{name} {fact}" for name, fact in found.facts.items()))
    table = Table("", "", "found", "limits", "")
    for section in dict.fromkeys((*found.checks, *(left.section for left in found.not_checked))):
        names = iter((section,))  # once
        for check in found.checks.get(section, ()):
            table.add_row(
                next(names, ""),
                check.name,
                f"{check.value:.4g} {check.unit}".rstrip(),
                _limits(check),
                "pass" if check.passed else "FAIL",
            )
        for left in found.not_checked:
            if left.section == section:
                table.add_row(next(names, ""), left.name, "", "", "not checked")
        table.add_section()
    console.print(table)
    for check in found.failures:
        click.echo(f"{check.name}: {check.mend}")
    for left in found.not_checked:
        click.echo(f"{left.name}: not checked: {left.wanted}")
    click.echo(
        f"{len(found.all) - len(found.failures)} of {len(found.all)} checks passed, "
        f"{len(found.not_checked)} not checked"
    )


def _limits(check: Check) -> str:
    if check.minimum == check.maximum:
        return f"{check.minimum:g}"
    if math.isinf(check.maximum):
        return f"at least {check.minimum:g}"
    if math.isinf(check.minimum):
        return f"at most {check.maximum:.4g}"
    return f"{check.minimum:.4g} to {check.maximum:.4g}"
