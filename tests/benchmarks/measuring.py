# SPDX-License-Identifier: Apache-2.0
"""What all comparisons share: the tow in so many segments, CPU time, and the form of an outcome."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from two_part_tow import TwoPartTow, wu_chwang

import sim_core as sc


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    what: str
    here: str
    peer: str = ""
    ratio: str = ""
    to_reach: str = ""
    good: bool | None = None  #: whether it is reached; None where nothing is asked for


@dataclass(frozen=True)
class Outcome:
    """What a comparison found: its value in the JSON object, and its lines of the table."""

    key: str
    value: float | dict[str, float]
    rows: list[Row] = field(default_factory=list)


def tow_of(segments: int) -> TwoPartTow:
    """The Wu & Chwang tow in a multiple of 40 segments of nearly equal length."""
    part, rest = divmod(segments, 40)
    if rest:
        raise ValueError("segments must be a multiple of 40")
    return wu_chwang((25 * part, 2 * part, 13 * part))


def cpu_time(work: Callable[[], object], repeats: int) -> float:
    """The least CPU time of `work`, s: other load on the machine can only add to it."""
    least = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        work()
        least = min(least, time.process_time() - start)
    return least


def stepping_cost(
    simulator: sc.Simulator, motion: sc.Motion, span: float, repeats: int = 7
) -> float:
    """CPU s per simulated s, from the best of several spans one after the other."""

    def step() -> None:
        simulator.step(simulator.time + span, motion)

    return cpu_time(step, repeats) / span


def say(words: str) -> None:
    print(f"towtank: {words} ...", file=sys.stderr, flush=True)
