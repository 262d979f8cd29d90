# SPDX-License-Identifier: Apache-2.0
"""CPU time of a fresh interpreter until the first step of a tow is done."""

from __future__ import annotations

import subprocess
import sys

from measuring import Outcome, Row, say

TO_REACH = 0.3  # s

PROGRAM = """
import time
import sim_core as sc

b = sc.ModelBuilder(sc.Water())
b.add_prescribed_point("tow_point")
b.add_free_point("depressor", mass=6.2, volume=0.697e-3)
cable = sc.LineProperties(length=3, diameter=0.01, mass_per_length=0.2, axial_stiffness=6e5)
b.add_line("cable", "tow_point", "depressor", cable, segments=20)
model = b.build()
simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, -1), velocity=(1, 0, 0)))
simulator.step(0.005, sc.SteadyTow(position=(0, 0, -1), velocity=(1, 0, 0)))
print(time.process_time())
"""


def measure() -> Outcome:
    say("import and first step")

    def once() -> float:
        run = subprocess.run(
            [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
        )
        return float(run.stdout)

    took = min(once() for _ in range(5))
    row = Row(
        "fresh interpreter: import, steady tow, first step",
        f"{took:.2f} s",
        to_reach=f"≤ {TO_REACH} s",
        good=took <= TO_REACH,
    )
    return Outcome("import_s", took, [row])
