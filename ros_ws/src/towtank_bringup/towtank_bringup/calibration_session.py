# SPDX-License-Identifier: Apache-2.0
"""Where a calibration's readings come from: the board, the virtual one, or a file."""

from __future__ import annotations

import contextlib
import datetime
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
from towtank_daq.description import installed_description, load_description
from towtank_daq.serial_port import SerialPort
from towtank_lab.board_readings import BoardReadings
from towtank_lab.calibration_record import write_new
from towtank_lab.guide import Station, Terminal
from towtank_lab.procedures import Row
from towtank_lab.readings_file import read_rows, rows_text
from towtank_rig import Rig
from towtank_rig.calibration_files import BoardIdentity

from towtank_bringup.plan import conversion_noise
from towtank_bringup.progress import ProgressLine
from towtank_bringup.virtual_station import virtual_station

Guide = Callable[[Rig, float, Terminal, Station], Iterable[Row]]
"""Leads through a procedure on a rig, with readings of so many seconds."""

Move = Callable[[Mapping[str, float]], None]


@dataclass(frozen=True)
class Readings:
    """All rows of a procedure, the board that took them, and what held meanwhile."""

    rows: list[Row]
    board: BoardIdentity | None
    conditions: Mapping[str, float | str]


def read_file(path: Path, columns: Sequence[str]) -> Readings:
    """Return readings that were taken before; ProcedureError if the file does not serve."""
    return Readings(read_rows(path, columns), None, {"readings_file": path.name})


def take_at_port(port: Path, rig: Rig, seconds: float, guide: Guide) -> Readings:
    """Take readings at the board on a port, sensors moved by hand."""
    return _take(port, lambda step: None, rig, seconds, guide, {})


def take_at_virtual_board(
    seed: int, rig: Rig, rig_file: Path, seconds: float, guide: Guide
) -> Readings:
    """Take readings at a virtual board, whose sensors go where the guide asks for."""
    with virtual_station(rig, rig_file, seed) as (port, sensors):
        return _take(port, sensors.move, rig, seconds, guide, {"virtual_board_seed": seed})


def _take(
    port: Path, move: Move, rig: Rig, seconds: float, guide: Guide, conditions: Mapping[str, float]
) -> Readings:
    progress = ProgressLine()
    description = load_description(installed_description())
    noise = {
        channel.name: volts / channel.gain
        for channel, volts in zip(description.channels, conversion_noise(rig), strict=True)
    }
    line = SerialPort(str(port), description.wire.baud)
    try:
        board = BoardReadings(line, rig, description, progress)
        desk = Terminal(_ask, _say, progress)
        rows: list[Row] = []
        with _kept(rows):
            for row in guide(rig, seconds, desk, Station(move, board.take, noise)):
                rows.append(row)
    finally:
        line.close()
    return Readings(rows, board.identity, {**board.conditions("excitation"), **conditions})


@contextlib.contextmanager
def _kept(rows: list[Row]) -> Iterator[None]:
    """Save what has been read when something ends it early: it was work to get there."""
    try:
        yield
    except BaseException:
        if rows:
            now = datetime.datetime.now(datetime.UTC)
            path = Path(f"readings-{now:%Y%m%dT%H%M%SZ}.csv").absolute()
            write_new(path, lambda file: file.write(rows_text(rows).encode()))
            _say(f"ended early: the {len(rows)} readings so far are in {path}")
        raise


def _ask(question: str) -> str:
    return click.prompt(question, default="", show_default=False, err=True)


def _say(line: str) -> None:
    click.echo(line, err=True)
