# SPDX-License-Identifier: Apache-2.0
"""How a step's cost grows with the number of segments, and what one of 40 costs, in waves too."""

from __future__ import annotations

from measuring import Outcome, Row, cpu_time, say, tow_of

import sim_core as sc

GROWTH_TO_REACH = 4.4
STEP_TO_REACH = 60.0  # µs
TRAINS = 200
WAVES_TO_REACH = 8.0  # times calm water
MAX_STEP = 0.005  # s


def simulator_of(
    segments: int, newton_tolerance: float, waves: sc.Sea | None = None
) -> tuple[sc.Simulator, sc.Motion]:
    tow = tow_of(segments)
    motion = tow.motion(tow.period)
    model = tow.model(waves=waves)
    start = sc.steady_tow(model, position=motion(0.0).position, velocity=(tow.speed, 0, 0))
    simulator = sc.Simulator(
        model, start, max_step=MAX_STEP, newton_tolerance=newton_tolerance, max_iterations=20
    )
    simulator.step(2.0 * tow.period, motion)
    return simulator, motion


def step_cost(
    segments: int, newton_tolerance: float = 1e-8, waves: sc.Sea | None = None
) -> tuple[float, float]:
    """CPU time of a step (s) and of a Newton iteration's share of it: (per step, iterations)."""
    simulator, motion = simulator_of(segments, newton_tolerance, waves)
    steps = max(20, 20000 // segments)
    before = simulator.newton_iterations, simulator.steps
    cost = cpu_time(lambda: simulator.step(simulator.time + steps * MAX_STEP, motion), 9) / steps
    iterations = (simulator.newton_iterations - before[0]) / (simulator.steps - before[1])
    return cost, iterations


def measure_growth() -> Outcome:
    say("growth from 320 to 1280 segments")
    small, small_iterations = step_cost(320)
    large, large_iterations = step_cost(1280)
    ratio = large / small
    return Outcome(
        "growth_1280_320",
        ratio,
        [
            Row(
                "step of 1280 segments beside one of 320",
                f"{1e6 * large:.0f} µs",
                f"{1e6 * small:.0f} µs",
                f"{ratio:.2f}",
                f"≤ {GROWTH_TO_REACH}",
                ratio <= GROWTH_TO_REACH,
            ),
            Row("  Newton iterations a step", f"{large_iterations:.2f}", f"{small_iterations:.2f}"),
        ],
    )


def measure_step() -> Outcome:
    say("a step of 40 segments")
    cost, iterations = step_cost(40, newton_tolerance=1e-13)  # as many iterations as rounding lets
    # Of what a step costs beside its iterations this counts too much, never too little.
    two_iterations = 1e6 * cost * max(1.0, 2.0 / iterations)
    return Outcome(
        "step_us_40",
        two_iterations,
        [
            Row(
                "step of 40 segments with fish, 2 Newton iterations",
                f"{two_iterations:.1f} µs",
                to_reach=f"≤ {STEP_TO_REACH:.0f} µs",
                good=two_iterations <= STEP_TO_REACH,
            )
        ],
    )


def measure_waves() -> Outcome:
    say(f"a step in {TRAINS} wave trains")
    calm, _ = step_cost(40)
    sea = sc.jonswap_sea(
        significant_height=0.3, peak_period=2.0, components=TRAINS, depth=5.0, ramp_time=2.0
    )
    waves, _ = step_cost(40, waves=sea)
    ratio = waves / calm
    return Outcome(
        "step_in_waves",
        ratio,
        [
            Row(
                f"step of 40 segments in {TRAINS} wave trains beside calm water",
                f"{1e6 * waves:.0f} µs",
                f"{1e6 * calm:.1f} µs",
                f"{ratio:.1f}",
                f"≤ {WAVES_TO_REACH:.0f}",
                ratio <= WAVES_TO_REACH,
            )
        ],
    )
