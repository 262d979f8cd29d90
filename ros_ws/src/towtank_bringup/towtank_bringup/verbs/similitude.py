# SPDX-License-Identifier: Apache-2.0
"""`towtank similitude`: a rig Froude-scaled to another length."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from towtank_lab.scale_effects import ScaleEffect, scale_effects
from towtank_lab.similitude import scale_rig
from towtank_rig import RigError, load_rig
from towtank_rig.check import warnings

from towtank_bringup.rigs import rig_path


@click.command(name="similitude")
@click.argument("rig")
@click.option(
    "--scale",
    type=click.FloatRange(min=0.0, min_open=True),
    required=True,
    help="New length over old: 0.5 for a model of half the size, 10 for the ship.",
)
@click.option(
    "--out", type=click.Path(path_type=Path), help="New rig file (default: NAME_xSCALE.yaml here)."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(rig: str, scale: float, out: Path | None, as_json: bool) -> None:
    """Scale RIG by Froude's law, write the new rig file and name what does not scale."""
    try:
        original = load_rig(rig_path(rig))
        path = out or Path(f"{original.name}_x{scale:g}.yaml")
        scaled = scale_rig(original, scale, path.stem)
    except RigError as error:
        raise click.ClickException(str(error)) from error
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(scaled.text)
    except FileExistsError:
        raise click.ClickException(f"{path} exists: give another file with --out") from None
    except OSError as error:
        raise click.ClickException(f"{path}: {error.strerror}: give another with --out") from error
    effects = scale_effects(original, scaled, scale)
    if as_json:
        result = {
            "rig": str(path),
            "scale": scale,
            "effects": [asdict(effect) for effect in effects],
            "warnings": warnings(scaled),
        }
        click.echo(json.dumps(result, indent=2))
    else:
        _print(effects, scale)
        for warning in warnings(scaled):
            click.echo(f"warning: {warning}")
        click.echo(f"{path}: written")


def _print(effects: list[ScaleEffect], scale: float) -> None:
    table = Table("what does not scale", "now", f"at {scale:g}", "consequence")
    for effect in effects:
        unit = "" if effect.unit == "1" else f" {effect.unit}"
        table.add_row(
            effect.name,
            f"{effect.original:.3g}{unit}",
            f"{effect.scaled:.3g}{unit}",
            effect.consequence,
        )
    Console(highlight=False, markup=False).print(table)
