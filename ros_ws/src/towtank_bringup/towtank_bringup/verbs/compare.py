# SPDX-License-Identifier: Apache-2.0
"""`towtank compare`: heave ratios of a recorded bag."""

from __future__ import annotations

import json
from pathlib import Path

import click
from towtank_bag.reader import BagError
from towtank_compare.compare import CompareError, compare_bag
from towtank_rig import RigError

from towtank_bringup.result_table import print_result
from towtank_bringup.rigs import rig_path


@click.command(name="compare")
@click.argument("bag", type=click.Path(path_type=Path))
@click.option(
    "--window",
    nargs=2,
    type=float,
    help="Only this window: begin and end, s since the epoch (as in result.json, `live`).",
)
@click.option("--rig", help="Rig file, or name of one, where that in the bag is lost or damaged.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(bag: Path, window: tuple[float, float] | None, rig: str | None, as_json: bool) -> None:
    """Compute the heave ratios of BAG, measured and simulated, with their uncertainty."""
    try:
        result = compare_bag(bag, window, None if rig is None else rig_path(rig))
    except (BagError, CompareError, RigError) as error:
        raise click.ClickException(str(error)) from error
    if as_json:
        click.echo(json.dumps(result, indent=2))
    else:
        print_result(result)
