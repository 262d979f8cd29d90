# SPDX-License-Identifier: Apache-2.0
"""A parameter study on two cores beside the same study on one: how near to twice as fast.

By the clock, from the start of the worker processes to the finished report: it asks for two cores
that do nothing else.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from measuring import Outcome, Row, say
from towtank_study.execution import local_pool
from towtank_study.loading import read_document
from towtank_study.running import plan_study, run_study

TO_REACH = 0.9
RIG = Path(__file__).parents[2] / "hardware" / "rigs" / "wu_chwang_2001.yaml"
STUDY = f"""
name: efficiency
description: how near two cores come to twice the speed of one
rig: {RIG}
parameters:
  - {{path: lines.secondary.length, range: [1.0, 2.0]}}
design: {{kind: latin_hypercube, samples: 128, seed: 1}}
simulation: {{settling_time: 60 s, periods: 10}}
"""


def measure() -> Outcome:
    workers = min(2, len(os.sched_getaffinity(0)))

    def seconds(count: int) -> float:
        say(f"a parameter study with {count} worker{'s' * (count > 1)}")
        with tempfile.TemporaryDirectory() as directory:
            file = Path(directory) / "study.yaml"
            file.write_text(STUDY)
            planned = plan_study(read_document(file), Path)
            start = time.perf_counter()
            with local_pool(count) as pool:
                run_study(planned, Path(directory) / "out", pool, count)
                return time.perf_counter() - start

    one, both = seconds(1), seconds(workers)
    efficiency = one / (workers * both)
    row = Row(
        f"parameter study of 128 tows on {workers} cores, by the clock",
        f"{both:.1f} s",
        f"{one:.1f} s",
        f"{one / both:.2f}",
        f"≥ {TO_REACH * workers:.2g}",
        efficiency >= TO_REACH,
    )
    return Outcome("sweep_efficiency", efficiency, [row])
