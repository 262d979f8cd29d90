# SPDX-License-Identifier: Apache-2.0
"""The board's scans that are missing between those that came in; no ROS in here."""

from __future__ import annotations

_NS_PER_TICK = 500
"""Of AdcScan's board_ticks."""

_RAN_ON_TICKS = 1_000_000
"""Half a second: where board and host differ by more over a gap, the board was reset in it."""


class ScanAccount:
    """Takes the scans in their order and counts the missing ones.

    In one run of the board's node its numbers tell. A node that was started again numbers from 0:
    how many scans the gap has cost then follows from the board's time, which goes on, to the scan.
    A board that was reset in the gap has no such time, and the host's has to do.
    """

    def __init__(self) -> None:
        self.received = 0
        self._lost_in_runs = 0
        self._gaps: list[float] = []  # between the last scan of a run and the first of the next
        self._period = 0  # all in ticks
        self._last: tuple[int, int, int] | None = None

    @property
    def lost(self) -> int:
        """Scans that are missing between the first and the last one that were taken."""
        if not self._period:
            return self._lost_in_runs
        return self._lost_in_runs + sum(max(0, round(gap / self._period) - 1) for gap in self._gaps)

    def take(self, sequence: int, board_ticks: int, stamp_ns: int) -> None:
        """Count one more scan, by three fields of its AdcScan."""
        scan = (sequence, board_ticks, stamp_ns)
        if scan == self._last:
            return  # recorded twice
        if self._last is not None:
            before, ticks_before, ns_before = self._last
            ticks = board_ticks - ticks_before
            if sequence > before:
                self._lost_in_runs += sequence - before - 1
                if sequence == before + 1:
                    self._period = ticks
            else:
                host_ticks = (stamp_ns - ns_before) / _NS_PER_TICK
                ran_on = abs(ticks - host_ticks) < _RAN_ON_TICKS
                self._gaps.append(ticks if ran_on else host_ticks)
        self.received += 1
        self._last = scan
