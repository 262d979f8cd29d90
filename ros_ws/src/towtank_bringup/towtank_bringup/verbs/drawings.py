# SPDX-License-Identifier: Apache-2.0
"""`towtank drawings`: the drawings of a rig, as SVG."""

from __future__ import annotations

from pathlib import Path

import click
from towtank_rig import RigError, load_rig
from towtank_workshop.drawings import draw
from towtank_workshop.sheet import DrawingError

from towtank_bringup.rigs import rig_path


@click.command(name="drawings")
@click.argument("rig")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for the sheets (drawings_RIG here)."
)
def command(rig: str, out: Path | None) -> None:
    """Draw RIG (a path, or the name of a rig that comes with towtank): SVG sheets in A3."""
    try:
        loaded = load_rig(rig_path(rig))
        sheets = draw(loaded)
        folder = out or Path(f"drawings_{loaded.name}")
        folder.mkdir(parents=True, exist_ok=True)
        for name, sheet in sheets.items():
            path = folder / f"{name}.svg"
            path.write_text(sheet.svg(), encoding="utf-8")
            click.echo(str(path))
    except (RigError, DrawingError, OSError) as error:
        raise click.ClickException(str(error)) from error
