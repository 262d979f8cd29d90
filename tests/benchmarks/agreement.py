# SPDX-License-Identifier: Apache-2.0
"""Ten random two-part tows in MoorDyn and in sim_core: `towtank bench agreement`.

Both start from the same steady tow and are compared over the last periods of the same motion.
MoorDyn's results are kept with the tests of sim_core, which compare with them without MoorDyn.
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
import tempfile
from pathlib import Path

import click
import moordyn_peer
import numpy as np
from measuring import say
from rich.console import Console
from rich.table import Table
from two_part_tow import DENSITY, Cable, Cylinder, Heave, Sphere, TwoPartTow, simulated_heave

SYSTEMS = 10
SEED = 2012
FILE = Path(__file__).parents[2] / "sim_core" / "tests" / "moordyn_heave.json"
LEAD_IN = 60.0  # s, for the fish's slow swing to die out
PERIODS = 5
SEGMENT = 0.25  # m, about
OUR_STEP = 0.005  # s
TO_REACH = 0.02


def random_tow(rng: np.random.Generator) -> TwoPartTow:
    """Immersed, and heavy enough not to go slack; synthetic ropes to steel-like cables."""

    def cable(shortest: float, longest: float) -> Cable:
        length = rng.uniform(shortest, longest)
        diameter = rng.uniform(0.005, 0.012)
        water = DENSITY * math.pi / 4.0 * diameter**2
        return Cable(
            length=length,
            mass_per_length=rng.uniform(1.3, 2.5) * water,
            diameter=diameter,
            stiffness=rng.uniform(20e3, 200e3),
            segments=math.ceil(length / SEGMENT),
            normal_drag=rng.uniform(1.0, 1.5),
            tangential_drag=rng.uniform(0.005, 0.03),
        )

    return TwoPartTow(
        primary=cable(2.0, 6.0),
        depressor_cable=cable(0.3, 0.8),
        secondary=cable(1.0, 3.0),
        depressor=Sphere(mass=rng.uniform(4.0, 12.0), diameter=rng.uniform(0.08, 0.13)),
        fish=Cylinder(
            length=rng.uniform(0.8, 1.6),
            diameter=rng.uniform(0.08, 0.13),
            axial_drag=rng.uniform(0.6, 1.5),
            cross_flow_drag=rng.uniform(0.9, 1.3),
        ),
        speed=rng.uniform(0.8, 2.0),
        heave=rng.uniform(0.04, 0.1),
        period=rng.uniform(1.5, 3.0),
    )


def duration(tow: TwoPartTow) -> float:
    return (math.ceil(LEAD_IN / tow.period) + PERIODS) * tow.period


def with_moordyn(tow: TwoPartTow) -> tuple[Heave, float]:
    """MoorDyn's heave, and the time step that it took, s."""
    with tempfile.TemporaryDirectory() as directory:
        time_step = 0.8 * moordyn_peer.largest_stable_step(tow, Path(directory))
        peer = moordyn_peer.MoorDynTow(tow, time_step, Path(directory))
        heave = peer.heave(tow.motion(tow.period), duration(tow), tow.period, PERIODS)
        peer.close()
    return heave, time_step


@click.command()
@click.option("--write", is_flag=True)
def main(write: bool) -> None:
    rng = np.random.default_rng(SEED)
    table = Table(title="sim_core beside MoorDyn, per cent", title_justify="left")
    names = [field.name for field in dataclasses.fields(Heave)]
    for heading in ("system", *(name.replace("_", " ") for name in names)):
        table.add_column(heading, justify="right")
    systems = []
    worst = 0.0
    for number in range(1, SYSTEMS + 1):
        say(f"system {number} of {SYSTEMS}")
        tow = random_tow(rng)
        peer, time_step = with_moordyn(tow)
        here = simulated_heave(tow, duration(tow), PERIODS, max_step=OUR_STEP)
        systems.append(
            {
                "tow": dataclasses.asdict(tow),
                "duration": duration(tow),
                "time_step": time_step,
                "heave": dataclasses.asdict(peer),
            }
        )
        errors = [getattr(here, name) / getattr(peer, name) - 1.0 for name in names]
        worst = max(worst, *map(abs, errors))
        table.add_row(str(number), *(f"{100 * error:+.2f}" for error in errors))
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    if write:
        content = {
            "made_by": "towtank bench agreement --write",
            "program": "MoorDyn 2.7.2 (PyPI moordyn), RK4",
            "seed": SEED,
            "periods": PERIODS,
            "systems": systems,
        }
        FILE.write_text(json.dumps(content, indent=1) + "\n")
    if worst > TO_REACH:
        sys.exit(f"the largest difference is {100 * worst:.1f} %")


if __name__ == "__main__":
    main()
