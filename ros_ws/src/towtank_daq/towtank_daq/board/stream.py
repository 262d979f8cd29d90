# SPDX-License-Identifier: Apache-2.0
"""The numbers of a run's scans, over all that may interrupt its stream, and their account."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from towtank_daq.clock import BoardClock, unwrap
from towtank_daq.framing import FrameCounters
from towtank_daq.protocol_records import DataFrame, StartResponse


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan in host terms."""

    sequence: int
    """Number since start(), unwrapped; a gap is so many lost scans."""
    ticks: int
    """Board time of the sampling tick, unwrapped."""
    stamp_ns: int
    """Estimated host time of the sampling tick, ns of CLOCK_MONOTONIC."""
    codes: tuple[int, ...]
    configured_mask: int
    """Bit i: channel i is configured to be converted in every scan."""
    valid_mask: int
    """Bit i: channel i has a good conversion in this one."""
    flags: int
    crank: int
    carriage: int
    """Encoder counts at the tick, unwrapped."""
    count_epoch: int
    """Counts of different epochs have no known relation: the board was reset in between."""

    @property
    def complete(self) -> bool:
        """Whether all channels that are configured have a good conversion."""
        return self.valid_mask == self.configured_mask


@dataclass(slots=True)
class Statistics:
    """What has happened since start()."""

    scans_received: int = 0
    scans_lost: int = 0
    scans_bad: int = 0
    """Received, but with at least one channel that is configured not valid."""
    restarts: int = 0
    reconnections: int = 0
    line_repairs: int = 0
    """How often another program had changed the line's settings."""
    sync_failures: int = 0
    unknown_frames: int = 0
    frames: FrameCounters = field(default_factory=FrameCounters)

    @property
    def scans_scheduled(self) -> int:
        return self.scans_received + self.scans_lost


class Stream:
    """Numbers the scans of a run. A stream that is started anew within it goes on with the numbers
    that its scans would have had, by the time that has passed."""

    def __init__(self) -> None:
        self.running = False
        """Whether the board streams, as far as it has said: between its answer to a start and the
        next stop."""
        self.configured_mask = 0
        self._first_tick = 0
        self._period_ticks = 1
        self._base = 0  # number of the board's scan 0
        self._last = -1  # number of the last scan
        self._last_stamp_ns: int | None = None  # of the scan of that number, come or not

    def begin_run(self) -> None:
        """Scans count from 0 again."""
        self._base, self._last, self._last_stamp_ns = 0, -1, None

    def started(self, answer: StartResponse, clock: BoardClock) -> None:
        """The board has begun to stream."""
        self._first_tick, self._period_ticks = answer.first_tick, answer.period_ticks
        if self._last_stamp_ns is None:
            self._last_stamp_ns = clock.host_ns(self._first_tick - self._period_ticks)
        passed = self._periods_since_last(clock.host_ns(self._first_tick), clock)
        self._base = self._last + max(1, round(passed))
        self.running = True

    def scan(self, frame: DataFrame, received_ns: int, clock: BoardClock) -> tuple[int, int, int]:
        """Number and ticks of a scan, unwrapped, and how many are missing before it.

        Raises ValueError for a number that is not after the last one's.
        """
        ticks = unwrap(frame.ticks, 32, clock.ticks(received_ns))
        # The tick tells the number; the 16-bit sequence then only has to confirm the nearest
        near = round((ticks - self._first_tick) / self._period_ticks)
        number = self._base + unwrap(frame.sequence, 16, near)
        if number <= self._last:
            raise ValueError(f"scan {number} after {self._last}")
        missing = number - self._last - 1
        self._last, self._last_stamp_ns = number, clock.host_ns(ticks)
        return number, ticks, missing

    def due_by_count(self, scans_scheduled: int) -> int:
        """Scans that did not come, by how many the board says that it has made; ends the stream."""
        return self._end(self._base + scans_scheduled - 1 - self._last)

    def due_by_time(self, host_ns: int, clock: BoardClock) -> int:
        """The same of a board that knows nothing of them: those of the time up to a host's; ends
        the stream."""
        return self._end(math.floor(self._periods_since_last(host_ns, clock)))

    def _end(self, due: int) -> int:
        self.running = False
        lost = max(0, due)
        self._last += lost
        return lost

    def _periods_since_last(self, host_ns: int, clock: BoardClock) -> float:
        """How many of the board's own periods lie between the last scan and a host time; 0 in a run
        without any stream."""
        if self._last_stamp_ns is None:
            return 0.0
        begun_ns = clock.host_ns(self._first_tick)
        period_ns = clock.host_ns(self._first_tick + self._period_ticks) - begun_ns
        return (host_ns - self._last_stamp_ns) / period_ns
