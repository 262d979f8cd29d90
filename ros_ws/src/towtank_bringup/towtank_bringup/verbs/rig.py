# SPDX-License-Identifier: Apache-2.0
"""`towtank rig`: work with rig files."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.group(name="rig")
def command() -> None:
    """Work with rig files."""


@command.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(file: Path, as_json: bool) -> None:
    """Validate the rig FILE: say what is wrong, and where."""
    raise click.ClickException("x")
