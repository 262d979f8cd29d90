# SPDX-License-Identifier: Apache-2.0
"""What the slow swing that a start leaves costs a log, by the time it is given to die down:
`towtank bench settling`.

The plant alone, without sensors: whatever the heave ratio of a log differs by from that of a late,
long one is what the swing has leaked past the drift terms of the analysis. A log may begin at any
angle of the crank; the table has the worst of eight.
"""

from __future__ import annotations

import json

import click
import numpy as np
from rich.console import Console
from rich.table import Table
from towtank_bringup.rigs import rig_path
from towtank_bringup.simulated_heave import plant_samples
from towtank_compare.heave import analyse_window
from towtank_rig import Rig, load_rig
from towtank_sim.drive import trial_commands
from towtank_sim.offline import simulate_plant

REST_S = 3.0
STEADY_S = 130.0
REFERENCE_S = (80.0, 120.0)
SETTLINGS_S = (0.0, 2.0, 5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0)
PERIODS = (3, 5, 8, 10, 20)
PHASES = 8


def leaks(rig: Rig) -> tuple[float, dict[float, list[float]]]:
    """The settled heave ratio, and how far that of a log is from it at worst, by settling time (s)
    and for each of PERIODS."""
    ramp, period = rig.run.ramp_time.value, 2 * np.pi / rig.run.crank_rate.value
    commands = trial_commands(rig, rest=REST_S, steady=STEADY_S)
    history = simulate_plant(rig, commands, REST_S + ramp + STEADY_S)
    samples = plant_samples(rig, history)

    def ratio(start_s: float, end_s: float) -> float:
        steady_s = REST_S + ramp
        window = (round(1e3 * (steady_s + at)) for at in (start_s, end_s))
        return analyse_window(samples, rig, *window).ratio

    settled = ratio(*REFERENCE_S)
    table = {
        settling: [
            max(
                (
                    ratio(start, start + (periods + 0.01) * period) - settled
                    for start in settling + period * np.arange(PHASES) / PHASES
                ),
                key=abs,
            )
            for periods in PERIODS
        ]
        for settling in SETTLINGS_S
    }
    return settled, table


@click.command()
@click.option("--rig", "names", multiple=True, default=("nit_calicut_2012", "wu_chwang_2001"))
@click.option("--json", "as_json", is_flag=True)
def main(names: tuple[str, ...], as_json: bool) -> None:
    """Print the table of each rig."""
    found = {name: leaks(load_rig(rig_path(name))) for name in names}
    if as_json:
        click.echo(
            json.dumps(
                {
                    name: {"settled": settled, "periods": PERIODS, "error_by_settling_s": table}
                    for name, (settled, table) in found.items()
                }
            )
        )
        return
    for name, (settled, table) in found.items():
        shown = Table(
            "settling",
            *(f"{periods} periods" for periods in PERIODS),
            title=f"{name}: error of the heave ratio {settled:.4f}, by settling and log",
        )
        for settling, errors in table.items():
            shown.add_row(f"{settling:g} s", *(f"{error:+.4f}" for error in errors))
        Console().print(shown)


if __name__ == "__main__":
    main()
