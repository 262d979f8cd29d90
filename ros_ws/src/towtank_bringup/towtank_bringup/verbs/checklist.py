# SPDX-License-Identifier: Apache-2.0
"""`towtank checklist`: what a rig's board and sensors must read when they are brought up."""

from __future__ import annotations

import dataclasses
import json

import click
from towtank_daq.description import installed_description, load_description
from towtank_rig import RigError, load_rig
from towtank_workshop.checklist import check_list, markdown

from towtank_bringup.rigs import rig_path


@click.command(name="checklist")
@click.argument("rig")
@click.option(
    "--depth",
    "depths",
    type=click.FloatRange(0.0, 1000.0),
    multiple=True,
    help="Of the immersions, m; give it once for each (five, as deep as tank and sensors allow).",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(rig: str, depths: tuple[float, ...], as_json: bool) -> None:
    """Print the check list of RIG's bring-up (Markdown): expected readings and their limits."""
    try:
        loaded = load_rig(rig_path(rig))
    except RigError as error:
        raise click.ClickException(str(error)) from error
    steps = check_list(loaded, load_description(installed_description()), depths or None)
    if as_json:
        click.echo(json.dumps([dataclasses.asdict(step) for step in steps], indent=2))
    else:
        click.echo(markdown(loaded, steps), nl=False)
