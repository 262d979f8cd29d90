# SPDX-License-Identifier: Apache-2.0
"""`towtank trim`: ballast and trim of a tow-fish from weighings."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from towtank_lab.errors import ProcedureError
from towtank_lab.propagation import Propagated
from towtank_lab.trim import Ballast, Trim, Weighings, evaluate
from towtank_rig import RigError
from towtank_rig.loading import load_section


@click.command(name="trim")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(file: Path, as_json: bool) -> None:
    """Trim and ballast of a fish from the weighings in FILE (YAML, see docs/laboratory.md)."""
    try:
        weighings = load_section(file, Weighings)
        trim = evaluate(weighings)
    except RigError as error:
        raise click.ClickException(str(error)) from error
    except ProcedureError as error:
        raise click.ClickException(f"{file}: {error}") from error
    if as_json:
        click.echo(json.dumps(_as_json(weighings.name, trim), indent=2))
    else:
        _print(weighings.name, trim)


def _ballast_rows(ballast: Ballast) -> dict[str, tuple[Propagated, str]]:
    rows = {field.name: getattr(ballast, field.name) for field in fields(ballast)}
    return {name: (value, "m" if name == "x" else "kg") for name, value in rows.items()}


def _as_json(name: str, trim: Trim) -> dict[str, object]:
    def numbers(rows: dict[str, tuple[Propagated, str]]) -> dict[str, object]:
        return {
            key: {"value": value.value, "u95": value.u95, "unit": unit}
            for key, (value, unit) in rows.items()
        }

    return {
        "name": name,
        "results": numbers(dict(trim.results)),
        "ballast": numbers(_ballast_rows(trim.ballast)) if trim.ballast else None,
        "notes": list(trim.notes),
    }


def _print(name: str, trim: Trim) -> None:
    console = Console(highlight=False, markup=False)
    rows = [(key, *row) for key, row in trim.results.items()]
    if trim.ballast:
        rows += [(f"ballast: {key}", *row) for key, row in _ballast_rows(trim.ballast).items()]
    table = Table(name, "value", "± 95 %", "unit")
    for key, value, unit in rows:
        table.add_row(key.replace("_", " "), f"{value.value:.5g}", f"{value.u95:.2g}", unit)
    console.print(table)
    for note in trim.notes:
        console.print(f"note: {note}")
