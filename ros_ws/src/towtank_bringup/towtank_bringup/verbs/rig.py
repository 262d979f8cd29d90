# SPDX-License-Identifier: Apache-2.0
"""`towtank rig`: work with rig files."""

from __future__ import annotations

import datetime
import json
import sys

import click
from towtank_rig import RigError, load_rig
from towtank_rig.check import calibration_warnings, check_rig

from towtank_bringup.rigs import rig_path


@click.group(name="rig")
def command() -> None:
    """Work with rig files."""


@command.command()
@click.argument("file")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(file: str, as_json: bool) -> None:
    """Validate the rig FILE (a path, or the name of a rig that comes with towtank).

    Says what is wrong and where, one line a fault; implausible but possible values are warnings,
    and so are calibrations that are missing or out of date.
    """
    try:
        path = rig_path(file)
        findings = check_rig(path)
        if not any(isinstance(finding, RigError) for finding in findings):
            findings += calibration_warnings(load_rig(path), datetime.date.today())
    except RigError as error:
        findings = [error]
    errors = [str(finding) for finding in findings if isinstance(finding, RigError)]
    warnings = [finding for finding in findings if isinstance(finding, str)]
    if as_json:
        click.echo(json.dumps({"rig": file, "errors": errors, "warnings": warnings}, indent=2))
    else:
        for warning in warnings:
            click.echo(f"warning: {warning}")
        for error in errors:
            click.echo(f"towtank: error: {error}", err=True)
        if not errors:
            click.echo(f"{file}: a valid rig")
    if errors:
        sys.exit(1)
