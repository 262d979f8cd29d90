# SPDX-License-Identifier: Apache-2.0
"""CPU time per simulated second beside MoorDyn's, at equal accuracy.

Both start from the same steady tow, the crank speeds up within one period, and both are measured
over the third: amplitude of the depressor's heave, and half the range of the top tension. The
converged values are ours in 320 segments at 1 ms. MoorDyn steps with RK4 at 0.8 of its largest
stable time step, which is found here; sim_core steps 10 ms.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from measuring import Outcome, Row, cpu_time, say, stepping_cost, tow_of
from moordyn_peer import MoorDynTow, largest_stable_step
from two_part_tow import Heave, TwoPartTow, simulated_heave, steady_start

import sim_core as sc

TO_REACH = {40: 20.0, 80: 40.0, 320: 200.0}
OUR_STEP = 0.01  # s
PERIODS = 3  # the last one counts
ACCURACY = 0.01


def error(heave: Heave, converged: Heave) -> float:
    """The larger of those of the depressor's heave and of the tension amplitude."""
    return max(
        abs(heave.depressor / converged.depressor - 1.0),
        abs(heave.tension_amplitude / converged.tension_amplitude - 1.0),
    )


def ours(tow: TwoPartTow, max_step: float) -> Heave:
    output_step = min(0.01, max_step)
    t_end = PERIODS * tow.period
    return simulated_heave(tow, t_end, 1, max_step=max_step, output_step=output_step)


def our_cost(tow: TwoPartTow, max_step: float) -> float:
    """CPU s per simulated s."""
    start = steady_start(tow)
    simulator = sc.Simulator(start.model, start, max_step=max_step)
    motion = tow.motion(tow.period)
    simulator.step(PERIODS * tow.period, motion)
    return stepping_cost(simulator, motion, tow.period)


def moordyn(tow: TwoPartTow, time_step: float, directory: Path) -> tuple[Heave, float]:
    """The same with MoorDyn, and its CPU s per simulated s (the best of spans of 0.2 s)."""
    motion = tow.motion(tow.period)
    peer = MoorDynTow(tow, time_step, directory)
    heave = peer.heave(motion, PERIODS * tow.period, tow.period, 1)
    span = peer.track(motion, peer.time + 0.2)  # outside the measured time
    cost = cpu_time(lambda: peer.follow(span), 5)
    peer.close()
    return heave, cost / (len(span) * peer.coupling_step)


def measure() -> Outcome:
    say("converged values of the Wu & Chwang tow")
    converged = ours(tow_of(320), 0.001)
    rows = [
        Row(
            "converged: depressor, tension range",
            f"{1e3 * converged.depressor:.2f} mm ±{converged.tension_amplitude:.2f} N",
        )
    ]
    ratios = {}
    for segments, to_reach in TO_REACH.items():
        tow = tow_of(segments)
        with tempfile.TemporaryDirectory() as directory:
            say(f"MoorDyn in {segments} segments")
            largest = largest_stable_step(tow, Path(directory))
            time_step = 0.8 * largest
            peer, peer_cost = moordyn(tow, time_step, Path(directory))
        here, cost = ours(tow, OUR_STEP), our_cost(tow, OUR_STEP)
        ratios[str(segments)] = ratio = peer_cost / cost
        accurate = max(error(here, converged), error(peer, converged)) < ACCURACY
        rows += [
            Row(
                f"MoorDyn, {segments} segments: CPU s per s",
                f"{cost:.4f}",
                f"{peer_cost:.3f}",
                f"{ratio:.0f}",
                f"≥ {to_reach:.0f}",
                ratio >= to_reach and accurate,
            ),
            Row(
                "  time step; error of the worse of both values",
                f"{1e3 * OUR_STEP:.0f} ms; {100 * error(here, converged):.2f} %",
                f"{1e6 * time_step:.1f} µs; {100 * error(peer, converged):.2f} %",
                "",
                "≤ 1 %",
                accurate,
            ),
        ]
    return Outcome("vs_moordyn", ratios, rows)
