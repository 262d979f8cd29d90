# SPDX-License-Identifier: Apache-2.0
"""A step with a dense Jacobian, as in the thesis that this project started from, beside ours.

171 unknowns: the Wu & Chwang tow in 56 segments. Timed are a whole step of sim_core, its
factorisation and solution in 3×3 blocks, and LAPACK's dense factorisation and solution (dgesv) of
the same matrix. The step with a dense Jacobian is ours with the one in place of the other; filling
the dense matrix is not counted.
"""

from __future__ import annotations

import numpy as np
from measuring import Outcome, Row, cpu_time, say
from scipy.linalg import lapack
from two_part_tow import wu_chwang

import sim_core as sc
from sim_core import _core

SEGMENTS = (35, 3, 18)
STEP = 0.005  # s


def measure() -> Outcome:
    say("a dense Newton iteration")
    tow = wu_chwang(SEGMENTS)
    model = tow.model()
    motion = tow.motion(tow.period)
    start = sc.steady_tow(model, position=motion(0.0).position, velocity=(tow.speed, 0, 0))
    simulator = sc.Simulator(model, start, max_step=STEP)
    simulator.step(2.0 * tow.period, motion)

    # Trapezoidal rule; the numbers in the matrix do not matter to the cost
    rates = (1.0, 2.0 / STEP, 4.0 / STEP**2)
    state = simulator.state
    matrix = np.asfortranarray(_core._jacobian(state, rates))
    right = -_core._residual(state)
    many = 1000
    both = cpu_time(lambda: _core._linear_systems(state, rates, many, True), 7)
    blocks = (both - cpu_time(lambda: _core._linear_systems(state, rates, many, False), 7)) / many
    dense = cpu_time(lambda: [lapack.dgesv(matrix, right) for _ in range(100)], 7) / 100

    steps = 200
    before = simulator.newton_iterations, simulator.steps
    ours = cpu_time(lambda: simulator.step(simulator.time + steps * STEP, motion), 7) / steps
    iterations = (simulator.newton_iterations - before[0]) / (simulator.steps - before[1])
    theirs = ours + iterations * (dense - blocks)
    ratio = theirs / ours
    return Outcome(
        "vs_dense_170",
        ratio,
        [
            Row(
                f"dense Newton, {len(right)} unknowns: a step",
                f"{1e6 * ours:.1f} µs",
                f"{1e6 * theirs:.0f} µs",
                f"{ratio:.1f}",
            ),
            Row(
                f"  factor and solve, {iterations:.2f} times a step",
                f"{1e6 * blocks:.1f} µs",
                f"{1e6 * dense:.0f} µs",
                f"{dense / blocks:.0f}",
            ),
        ],
    )
