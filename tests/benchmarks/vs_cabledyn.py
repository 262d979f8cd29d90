# SPDX-License-Identifier: Apache-2.0
"""CPU time per simulated second beside CableDyn's, both with steps of 5 ms.

The same tow with the fish as a point mass, from rest: run-up within 8 s, the crank with it. Both
are measured over one-second spans while the crank turns, and the best counts. CableDyn's tension
rings at this step (see the table), which costs it Newton iterations; the best span rings least.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from cabledyn_peer import CableDynTow
from measuring import Outcome, Row, cpu_time, say, stepping_cost, tow_of
from two_part_tow import TwoPartTow

import sim_core as sc

TO_REACH = {40: 6.0, 320: 6.0}
STEP = 0.005  # s
START = 4.0  # s, of the measurements
SPAN = 1.0  # s
SPANS = 4
RUN_UP = 8.0  # s


def here(tow: TwoPartTow) -> tuple[float, float, float]:
    """CPU s per simulated s, Newton iterations a step, half the range of the top tension (N)."""
    motion = tow.motion(RUN_UP, RUN_UP)
    model = tow.model(fish_as_point=True)
    start = sc.steady_tow(model, position=motion(0.0).position)
    simulator = sc.Simulator(model, start, max_step=STEP)
    simulator.step(START, motion)
    cost = stepping_cost(simulator, motion, SPAN, SPANS)
    iterations = simulator.newton_iterations / simulator.steps
    run = sc.run(model, motion, t_end=START + SPANS * SPAN, state=start, max_step=STEP)
    measured = run.lines["primary"].start_tension[run.time > START]
    return cost, iterations, 0.5 * float(np.ptp(measured))


def peer(tow: TwoPartTow) -> tuple[float, float, float]:
    """The same with CableDyn."""
    motion = tow.motion(RUN_UP, RUN_UP)
    tensions = []
    with tempfile.TemporaryDirectory() as directory:
        other = CableDynTow(tow, motion, STEP, Path(directory))
        other.step_to(START)

        def span() -> None:
            end = other.time + SPAN
            while other.time < end - 0.5 * STEP:
                other.step_to(other.time + 4 * STEP)
                tensions.append(other.top_tension())

        cost = cpu_time(span, SPANS) / SPAN
        iterations = other.iterations / other.steps
        other.close()
    return cost, iterations, 0.5 * float(np.ptp(tensions))


def measure() -> Outcome:
    rows = []
    ratios = {}
    for segments, to_reach in TO_REACH.items():
        say(f"CableDyn in {segments} segments")
        tow = tow_of(segments)
        cost, iterations, tension = here(tow)
        peer_cost, peer_iterations, peer_tension = peer(tow)
        ratios[str(segments)] = ratio = peer_cost / cost
        rows += [
            Row(
                f"CableDyn, {segments} segments: CPU s per s",
                f"{cost:.4f}",
                f"{peer_cost:.3f}",
                f"{ratio:.1f}",
                f"≥ {to_reach:.0f}",
                ratio >= to_reach,
            ),
            Row(
                "  Newton iterations a step; tension range",
                f"{iterations:.1f}; ±{tension:.1f} N",
                f"{peer_iterations:.1f}; ±{peer_tension:.1f} N",
            ),
        ]
    return Outcome("vs_cabledyn", ratios, rows)
