# SPDX-License-Identifier: Apache-2.0
"""Heave ratios while the trial runs. Holds the last samples; no ROS in here.

The window ends at the latest instant for which every topic has arrived, so that later the bag
gives the same samples for it. Two things can make a difference: a sample that the network lost for
one of recorder and comparison only (the topics are best effort), and one that came in after its
window was evaluated. Against the second the window ends `SETTLING_MS` before the newest samples.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from towtank_rig import Rig

from towtank_compare.harmonic import AnalysisError
from towtank_compare.heave import NS_PER_MS, HeaveResult, HeaveSamples, analyse_window
from towtank_compare.places import pressure_port
from towtank_compare.samples import depressor_place, measured_heave, simulated_heave
from towtank_compare.series import Series

SETTLING_MS = 20
"""Stamps of one topic may run back by a little when the board's clock is fitted anew."""

SILENCE_NS = 2_000_000_000
"""A topic that is this far behind the newest one has stopped, and is waited for no longer."""

SPARE_NS = 3_000_000_000
"""Samples are kept this long beyond the window."""


@dataclass(frozen=True)
class Evaluation:
    """One source over one window: a result, or the reason why there is none."""

    source: str
    t0_ms: int
    t1_ms: int
    result: HeaveResult | None
    reason: str = ""


@dataclass
class _Buffer:
    """Last samples of one topic, each a row of floats. `newest_ns` counts bad samples too."""

    topic: str
    stamps: deque[int] = field(default_factory=deque)
    rows: deque[Sequence[float]] = field(default_factory=deque)
    newest_ns: int = 0

    def add(self, stamp_ns: int, row: Sequence[float]) -> None:
        self.newest_ns = max(self.newest_ns, stamp_ns)
        self.stamps.append(stamp_ns)
        self.rows.append(row)

    def drop_before(self, stamp_ns: int) -> None:
        while self.stamps and self.stamps[0] < stamp_ns:
            self.stamps.popleft()
            self.rows.popleft()

    def arrays(self, columns: int) -> tuple[np.ndarray, np.ndarray]:
        return (
            np.fromiter(self.stamps, np.int64, len(self.stamps)),
            np.array(self.rows, dtype=float).reshape(-1, columns),
        )


class LiveHeave:
    """Takes samples in and evaluates the last `window_s` seconds of measurement and twin."""

    def __init__(self, rig: Rig, window_s: float) -> None:
        self._rig = rig
        self._window_ms = round(window_s * 1000)
        self._crank = _Buffer("crank angle")
        self._depth = {body: _Buffer(f"measured depth of the {body}") for body in _BODIES}
        self._zero_depth = dict.fromkeys(_BODIES, 0.0)
        self._pose = {body: _Buffer(f"twin's pose of the {body}") for body in _BODIES}

    def add_crank(self, stamp_ns: int, angle: float) -> None:
        """Measured crank angle, rad."""
        self._crank.add(stamp_ns, (angle,))

    def add_depth(
        self, body: str, stamp_ns: int, depth: float, valid: bool, zero_depth: float
    ) -> None:
        """Measured depth, m; body: fish or depressor. zero_depth: where the sensor was zeroed, m
        below still water, NaN before."""
        self._zero_depth[body] = 0.0 if math.isnan(zero_depth) else zero_depth
        self._depth[body].add(stamp_ns, (depth, valid))

    def add_pose(
        self, body: str, stamp_ns: int, z: float, quaternion: tuple[float, float, float, float]
    ) -> None:
        """Twin's pose: height of the body's origin, m, and quaternion x, y, z, w, body to tank."""
        self._pose[body].add(stamp_ns, (z, *quaternion))

    def evaluate(self) -> list[Evaluation]:
        """Both sources over the last window; nothing before the samples reach back that far."""
        buffers = [self._crank, *self._depth.values(), *self._pose.values()]
        newest = max(buffer.newest_ns for buffer in buffers)
        going = [b.newest_ns for b in buffers if b.newest_ns >= newest - SILENCE_NS]
        if newest == 0 or self._crank.newest_ns < newest - SILENCE_NS:
            return []
        t1_ms = min(going) // NS_PER_MS - SETTLING_MS
        t0_ms = t1_ms - self._window_ms
        for buffer in buffers:
            buffer.drop_before(t0_ms * NS_PER_MS - SPARE_NS)
        if not self._crank.stamps or self._crank.stamps[0] > t0_ms * NS_PER_MS:
            return []
        evaluations = []
        for source, bodies in (("measured", self._depth), ("twin", self._pose)):
            silent = [b.topic for b in bodies.values() if b.newest_ns < newest - SILENCE_NS]
            if silent:
                reason = f"no samples of {' and '.join(silent)}"
                evaluations.append(Evaluation(source, t0_ms, t1_ms, None, reason))
            else:
                evaluations.append(self._evaluate(source, t0_ms, t1_ms))
        return evaluations

    def _evaluate(self, source: str, t0_ms: int, t1_ms: int) -> Evaluation:
        try:
            result = analyse_window(self._samples(source), self._rig, t0_ms, t1_ms)
        except AnalysisError as error:
            return Evaluation(source, t0_ms, t1_ms, None, str(error))
        return Evaluation(source, t0_ms, t1_ms, result)

    def _samples(self, source: str) -> HeaveSamples:
        stamps, angles = self._crank.arrays(1)
        crank = Series.of(stamps, angles[:, 0])
        if source == "measured":
            heaves = []
            for buffer in self._depth.values():
                stamps, rows = buffer.arrays(2)
                heaves.append(measured_heave(stamps, rows[:, 0], rows[:, 1]))
            zero_depths = (self._zero_depth["fish"], self._zero_depth["depressor"])
            return HeaveSamples("measured", crank, *heaves, zero_depths)
        places = (pressure_port(self._rig).position, depressor_place(self._rig))
        heaves = []
        for buffer, place in zip(self._pose.values(), places, strict=True):
            stamps, rows = buffer.arrays(5)
            heaves.append(simulated_heave(stamps, rows[:, 0], rows[:, 1:], place))
        return HeaveSamples("twin", crank, *heaves)


_BODIES = ("fish", "depressor")
