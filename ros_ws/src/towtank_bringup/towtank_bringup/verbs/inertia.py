# SPDX-License-Identifier: Apache-2.0
"""`towtank inertia`: a moment of inertia from a bifilar suspension."""

from __future__ import annotations

import json
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from towtank_lab.bifilar import Inertia, Suspension, evaluate
from towtank_rig import RigError
from towtank_rig.loading import load_section


@click.command(name="inertia")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(file: Path, as_json: bool) -> None:
    """Moment of inertia from the bifilar suspension in FILE (YAML, see docs/laboratory.md)."""
    try:
        suspension = load_section(file, Suspension)
    except RigError as error:
        raise click.ClickException(str(error)) from error
    found = evaluate(suspension)
    if as_json:
        click.echo(json.dumps(_as_json(suspension, found), indent=2))
    else:
        _print(suspension, found)


def _as_json(suspension: Suspension, found: Inertia) -> dict[str, object]:
    def estimate(name: str, unit: str) -> dict[str, object]:
        result = getattr(found, name)
        return {"value": result.value, "u95": result.u95, "unit": unit}

    return {
        "name": suspension.name,
        "inertia": estimate("inertia", "kg m^2"),
        "radius_of_gyration": estimate("radius_of_gyration", "m"),
        "period": estimate("period", "s"),
        "theory": found.theory,
        "budget": dict(found.inertia.shares),
        "notes": list(found.notes),
    }


def _print(suspension: Suspension, found: Inertia) -> None:
    console = Console(highlight=False, markup=False)
    console.print(f"{suspension.name}: 95 % intervals")
    for label, result, unit in (
        ("moment of inertia", found.inertia, "kg m²"),
        ("radius of gyration", found.radius_of_gyration, "m"),
        ("period of small swings", found.period, "s"),
    ):
        console.print(f"  {label:24} {result.value:9.5f} ± {result.u95:.5f} {unit}")
    if found.theory is not None:
        difference = 100.0 * (found.inertia.value / found.theory - 1.0)
        console.print(f"  {'theory':24} {found.theory:9.5f} kg m² (found {difference:+.1f} %)")
    table = Table("input", "share of the standard uncertainty, kg m²", "%")
    ranked = sorted(found.inertia.shares.items(), key=lambda item: item[1], reverse=True)
    for name, share in ranked:
        percent = 100.0 * share / found.inertia.value
        table.add_row(name.replace("_", " "), f"{share:.2e}", f"{percent:.2f}")
    console.print(table)
    for note in found.notes:
        console.print(f"note: {note}")
