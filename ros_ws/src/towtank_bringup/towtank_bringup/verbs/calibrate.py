# SPDX-License-Identifier: Apache-2.0
"""`towtank calibrate`: sensors against known depths, attitudes and angles."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from towtank_daq.board import BoardError
from towtank_lab import procedures
from towtank_lab.calibration_record import (
    Circumstances,
    make_record,
    write_record,
    write_referring_rig,
)
from towtank_lab.errors import ProcedureError
from towtank_lab.guide import accelerometer_rows, crank_rows, pressure_rows
from towtank_lab.procedures import Evaluation, Row
from towtank_rig import Rig, RigError, load_rig
from towtank_rig.calibration_files import CalibrationFile

from towtank_bringup.calibration_session import (
    Guide,
    Readings,
    read_file,
    take_at_port,
    take_at_virtual_board,
)
from towtank_bringup.plan import PlanError
from towtank_bringup.processes import ProcessError
from towtank_bringup.rigs import rig_path

_LIMIT = click.FloatRange(min=0.0)

_OPTIONS = (
    click.option("--rig", "rig_name", required=True, help="Rig file, or name of a shipped one."),
    click.option("--port", type=click.Path(path_type=Path), help="Serial port of the ADC board."),
    click.option("--virtual", is_flag=True, help="The virtual board and virtual sensors instead."),
    click.option("--seed", type=int, default=1, help="Virtual sensors: seed of their errors (1)."),
    click.option(
        "--readings", type=click.Path(path_type=Path), help="CSV with readings already taken."
    ),
    click.option("--by", required=True, help="Who calibrates."),
    click.option("--reference", required=True, help="Reference instrument and its certificate."),
    click.option(
        "--valid-days", type=click.IntRange(min=1), default=180, help="Due after so many (180)."
    ),
    click.option("--seconds", type=click.FloatRange(min=1.0), default=5.0, help="A reading (5)."),
    click.option(
        "--out",
        type=click.Path(path_type=Path),
        help="Folder for the record (default: calibrations/ beside the rig file).",
    ),
    click.option(
        "--new-rig",
        type=click.Path(path_type=Path),
        help="Also write a copy of the rig file that refers to the record.",
    ),
    click.option("--json", "as_json", is_flag=True, help="Print JSON."),
)


def _common(function: Callable[..., None]) -> Callable[..., None]:
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


@dataclass(frozen=True)
class _Wishes:
    """The common options."""

    rig_name: str
    port: Path | None
    virtual: bool
    seed: int
    readings: Path | None
    by: str
    reference: str
    valid_days: int
    seconds: float
    out: Path | None
    new_rig: Path | None
    as_json: bool

    def __post_init__(self) -> None:
        if sum((self.port is not None, self.virtual, self.readings is not None)) != 1:
            raise click.UsageError("give one of --port, --virtual and --readings")


@click.group(name="calibrate")
def command() -> None:
    """Calibrate a sensor: guided at the board, or from readings already taken.

    The result is a new dated file with all readings; nothing is edited.
    """


@command.command()
@click.argument("sensor", type=click.Choice(["fish_pressure", "depressor_pressure"]))
@click.option(
    "--depths",
    default="0,0.5,1,1.5,2,1.5,1,0.5,0",
    help="Depths of the guided immersions, m, in their order (0,0.5,1,1.5,2 and back).",
)
@click.option(
    "--tape-limit", type=_LIMIT, default=5e-4, help="Limit of the tape's relative error (0.0005)."
)
@click.option(
    "--zero-limit",
    type=_LIMIT,
    default=2e-3,
    help="Limit of the tape's zero at the port, m (0.002).",
)
@_common
def pressure(
    sensor: str, depths: str, tape_limit: float, zero_limit: float, **options: Any
) -> None:
    """Immerse SENSOR to known depths, going down and coming up again."""
    steps = _numbers(depths, "--depths")
    _run(
        _Wishes(**options),
        procedures.PRESSURE_COLUMNS,
        lambda rig, seconds, desk, at: pressure_rows(rig, sensor, steps, seconds, desk, at),
        lambda rig, rows: procedures.evaluate_pressure(
            rig, sensor, rows, tape_limit=tape_limit, zero_limit=zero_limit
        ),
    )


@command.command()
@click.option(
    "--level-limit",
    type=_LIMIT,
    default=0.3,
    help="Limit of the table's inclination, degrees (0.3).",
)
@click.option(
    "--tilts",
    default="",
    help="More attitudes, of a tilt table: ROLL:PITCH in degrees, with commas between.",
)
@_common
def accelerometer(level_limit: float, tilts: str, **options: Any) -> None:
    """Lay the fish on its six sides on a levelled table, and tilt it further if wished."""
    attitudes = _tilts(tilts)
    _run(
        _Wishes(**options),
        procedures.ACCELEROMETER_COLUMNS,
        lambda rig, seconds, desk, at: accelerometer_rows(rig, attitudes, seconds, desk, at),
        lambda rig, rows: procedures.evaluate_accelerometer(
            rig, rows, level_limit=math.radians(level_limit)
        ),
    )


@command.command()
@click.option(
    "--angles",
    default="0,90,180,270,360,450,540,630,720",
    help="Angles of the marks, degrees, in their order (0, 90 ... 720).",
)
@click.option("--heights", is_flag=True, help="Ask for the tow point's height at each mark, too.")
@click.option(
    "--mark-limit", type=_LIMIT, default=0.5, help="Limit of mark 0's place, degrees (0.5)."
)
@_common
def crank(angles: str, heights: bool, mark_limit: float, **options: Any) -> None:
    """Turn the crank to known marks: counts per turn, direction, zero."""
    steps = _numbers(angles, "--angles")
    _run(
        _Wishes(**options),
        procedures.CRANK_COLUMNS,
        lambda rig, seconds, desk, at: crank_rows(steps, heights, seconds, desk, at),
        lambda rig, rows: procedures.evaluate_crank(rig, rows, mark_limit=math.radians(mark_limit)),
    )


_Evaluate = Callable[[Rig, Sequence[Row]], Evaluation]


def _run(wishes: _Wishes, columns: Sequence[str], guide: Guide, evaluate: _Evaluate) -> None:
    """Take or read the rows, evaluate them, write and tell what was found."""
    try:
        rig_file = rig_path(wishes.rig_name)
        rig = load_rig(rig_file)
        if wishes.new_rig and wishes.new_rig.exists():
            raise ProcedureError(f"{wishes.new_rig} exists: give another file with --new-rig")
        readings = _readings(wishes, rig, rig_file, columns, guide)
        evaluation = evaluate(rig, readings.rows)
        record = make_record(
            rig,
            evaluation,
            readings.rows,
            Circumstances(
                datetime.datetime.now(datetime.UTC),
                wishes.by,
                wishes.reference,
                datetime.timedelta(days=wishes.valid_days),
                readings.board,
                readings.conditions,
            ),
        )
        folder = wishes.out or rig_file.parent / "calibrations"
        path, plot = write_record(record, evaluation.residuals, folder)
        if wishes.new_rig:
            write_referring_rig(rig_file, record, path, wishes.new_rig)
    except (ProcedureError, RigError, PlanError, ProcessError, BoardError, OSError) as error:
        raise click.ClickException(str(error)) from error
    if wishes.as_json:
        click.echo(json.dumps(_as_json(record, evaluation, path, plot), indent=2))
    else:
        _print(record, evaluation, path, plot, wishes.new_rig)


def _readings(
    wishes: _Wishes, rig: Rig, rig_file: Path, columns: Sequence[str], guide: Guide
) -> Readings:
    if wishes.readings is not None:
        return read_file(wishes.readings, columns)
    if wishes.port is not None:
        return take_at_port(wishes.port, rig, wishes.seconds, guide)
    return take_at_virtual_board(wishes.seed, rig, rig_file, wishes.seconds, guide)


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _numbers(text: str, option: str) -> list[float]:
    try:
        return [_finite(part) for part in text.split(",")]
    except ValueError:
        raise click.UsageError(f"{option} {text!r}: give numbers with commas between") from None


def _tilts(text: str) -> list[tuple[float, float]]:
    try:
        pairs = [part.split(":") for part in text.split(",") if part.strip()]
        return [(_finite(roll), _finite(pitch)) for roll, pitch in pairs]
    except ValueError:
        raise click.UsageError(f"--tilts {text!r}: give ROLL:PITCH, with commas between") from None


def _as_json(
    record: CalibrationFile, evaluation: Evaluation, path: Path, plot: Path
) -> dict[str, Any]:
    return {
        "id": record.id,
        "record": str(path),
        "plot": str(plot),
        "due": record.due.isoformat(),
        "findings": [asdict(finding) for finding in evaluation.findings],
        "calibration": evaluation.section,
        "drift": evaluation.drift,
        "notes": list(evaluation.notes),
    }


def _print(
    record: CalibrationFile,
    evaluation: Evaluation,
    path: Path,
    plot: Path,
    new_rig: Path | None,
) -> None:
    console = Console(highlight=False, markup=False)
    table = Table(record.id, "found", "± 95 %", "unit")
    for finding in evaluation.findings:
        interval = "" if finding.u95 is None else f"{finding.u95:.2g}"
        unit = "" if finding.unit == "1" else finding.unit
        table.add_row(finding.name, f"{finding.value:.6g}", interval, unit)
    console.print(table)
    for note in evaluation.notes:
        click.echo(f"note: {note}")
    click.echo(f"{path}: written, due {record.due}; residuals in {plot.name}")
    if new_rig:
        click.echo(f"{new_rig}: a copy of the rig that refers to it")
    else:
        click.echo(f"in the rig, under calibrations: {record.sensor}: {{file: …, id: {record.id}}}")
