# SPDX-License-Identifier: Apache-2.0
"""`towtank identity`: a board's serial number and calibration id, told or written."""

from __future__ import annotations

from pathlib import Path

import click
from towtank_daq.board import AdcBoard, BoardError
from towtank_daq.description import installed_description, load_description
from towtank_daq.identity import NO_NUMBER, StoredIdentity
from towtank_daq.protocol import Protocol
from towtank_daq.serial_port import SerialPort

_NUMBER = click.IntRange(0, NO_NUMBER - 1)


@click.command(name="identity")
@click.option("--port", type=click.Path(path_type=Path), required=True, help="Port of the board.")
@click.option("--serial", type=_NUMBER, help="Serial number to write.")
@click.option("--calibration", type=_NUMBER, help="Calibration id to write.")
def command(port: Path, serial: int | None, calibration: int | None) -> None:
    """Tell what a board has stored of itself; with --serial or --calibration, write it.

    What is not given stays, if it can be believed. A rig whose board.calibration_id is another
    refuses the board.
    """
    description = load_description(installed_description())
    try:
        line = SerialPort(str(port), description.wire.baud)
    except OSError as error:
        raise click.ClickException(str(error)) from error
    try:
        board = AdcBoard(line, Protocol(description), lambda scan: None, click.echo)
        board.connect()
        stored = board.stored_identity()
        if serial is not None or calibration is not None:
            board.store_identity(*_completed(stored, serial, calibration))
            stored = board.stored_identity()
    except (BoardError, OSError) as error:
        raise click.ClickException(str(error)) from error
    finally:
        line.close()
    if stored.state == "unset":
        click.echo(stored.trouble)
        return
    click.echo(f"serial number {stored.board_serial}, calibration id {stored.calibration_id}")
    if stored.trouble:
        raise click.ClickException(stored.trouble)


def _completed(
    stored: StoredIdentity, serial: int | None, calibration: int | None
) -> tuple[int, int]:
    """Both numbers, the one that is not given from what the board has."""
    if stored.trouble and (serial is None or calibration is None):
        raise BoardError(f"{stored.trouble}: give both --serial and --calibration")
    return (
        stored.board_serial if serial is None else serial,
        stored.calibration_id if calibration is None else calibration,
    )
