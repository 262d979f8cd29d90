# SPDX-License-Identifier: Apache-2.0
"""What the number of segments costs a simulated heave ratio, and what it takes of the processor:
`towtank bench segments`.

The plant alone, without sensors, over the same log with more and more segments. The error falls
with the square of their number; it is that against the limit to which the last two runs point.
"""

from __future__ import annotations

import json
import time

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
PERIODS = 10
SEGMENTS = (10, 20, 40, 80, 160)


def ratio_of(rig: Rig, segments: int) -> tuple[float, float]:
    """Heave ratio of a settled log of ten crank periods, and the share of a core that it takes."""
    period = 2 * np.pi / rig.run.crank_rate.value
    before = REST_S + rig.run.ramp_time.value + rig.run.settling_time.value
    log = (PERIODS + 0.01) * period
    begun = time.process_time()
    history = simulate_plant(
        rig, trial_commands(rig, rest=REST_S, steady=60.0), before + log, segments=segments
    )
    cost = (time.process_time() - begun) / history.time[-1]
    samples = plant_samples(rig, history)
    return analyse_window(
        samples, rig, round(1e3 * before), round(1e3 * (before + log))
    ).ratio, cost


@click.command()
@click.option("--rig", "names", multiple=True, default=("nit_calicut_2012", "wu_chwang_2001"))
@click.option("--json", "as_json", is_flag=True)
def main(names: tuple[str, ...], as_json: bool) -> None:
    """Print the table of each rig."""
    found = {}
    for name in names:
        rig = load_rig(rig_path(name))
        values = [ratio_of(rig, segments) for segments in SEGMENTS]
        (coarse, _), (fine, _) = values[-2:]
        limit = fine + (fine - coarse) / 3  # of second order in the length of a segment
        found[name] = [
            {"segments": segments, "heave_ratio": ratio, "error": ratio / limit - 1, "core": cost}
            for segments, (ratio, cost) in zip(SEGMENTS, values, strict=True)
        ]
    if as_json:
        click.echo(json.dumps(found))
        return
    for name, rows in found.items():
        shown = Table("segments", "heave ratio", "error", "share of a core", title=name)
        for row in rows:
            shown.add_row(
                str(row["segments"]),
                f"{row['heave_ratio']:.5f}",
                f"{row['error']:+.2%}",
                f"{row['core']:.2%}",
            )
        Console().print(shown)


if __name__ == "__main__":
    main()
