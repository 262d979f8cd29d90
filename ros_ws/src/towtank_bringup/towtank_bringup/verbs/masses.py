# SPDX-License-Identifier: Apache-2.0
"""`towtank masses`: what the parts of a rig weigh, what its cables bear, and its ballast."""

from __future__ import annotations

import click
from towtank_lab.errors import ProcedureError
from towtank_rig import RigError, load_rig
from towtank_workshop.masses import markdown

from towtank_bringup.rigs import rig_path


@click.command(name="masses")
@click.argument("rig")
@click.option(
    "--factor",
    type=click.FloatRange(1.0, 20.0),
    default=5.0,
    help="Of safety, breaking load over peak load of a cable (5).",
)
def command(rig: str, factor: float) -> None:
    """Print masses, cable loads, trim and ballast of RIG (Markdown)."""
    try:
        click.echo(markdown(load_rig(rig_path(rig)), factor), nl=False)
    except (RigError, ProcedureError) as error:
        raise click.ClickException(str(error)) from error
