# SPDX-License-Identifier: Apache-2.0
"""The board's scans that are missing between those that came in; no ROS in here."""

from __future__ import annotations

_RAN_ON_NS = 500_000_000
"""Where board and host differ by more over a gap, the board was reset in it."""


class ScanAccount:
    """Takes the scans in their order and counts the missing ones.

    In one run of the board's node its numbers tell. A node that was started again numbers from 0:
    how many scans the gap has cost then follows from the board's time, which goes on, to the scan.
    A board that was reset in the gap has no such time, and the host's has to do. How long a tick of
    the board is, the scans in a row tell.
    """

    def __init__(self) -> None:
        self.received = 0
        self._lost_in_runs = 0
        self._gaps: list[tuple[int, int]] = []  # ticks and ns between two runs
        self._period = 0  # in ticks
        self._in_a_row = [0, 0]  # ticks and ns between scans that followed each other
        self._last: tuple[int, int, int] | None = None

    @property
    def lost(self) -> int:
        """Scans that are missing between the first and the last one that were taken."""
        return self._lost_in_runs + sum(self._lost_in(*gap) for gap in self._gaps)

    def _lost_in(self, ticks: int, ns: int) -> int:
        ticks_in_a_row, ns_in_a_row = self._in_a_row
        if not self._period or not ns_in_a_row:
            return 0
        host_ticks = ns * ticks_in_a_row / ns_in_a_row
        ran_on = abs(ns - ticks * ns_in_a_row / ticks_in_a_row) < _RAN_ON_NS
        return max(0, round((ticks if ran_on else host_ticks) / self._period) - 1)

    def take(self, sequence: int, board_ticks: int, stamp_ns: int) -> None:
        """Count one more scan, by three fields of its AdcScan."""
        scan = (sequence, board_ticks, stamp_ns)
        if scan == self._last:
            return  # recorded twice
        if self._last is not None:
            before, ticks_before, ns_before = self._last
            ticks, ns = board_ticks - ticks_before, stamp_ns - ns_before
            if sequence > before:
                self._lost_in_runs += sequence - before - 1
                if sequence == before + 1:
                    self._period = ticks
                    self._in_a_row[0] += ticks
                    self._in_a_row[1] += ns
            else:
                self._gaps.append((ticks, ns))
        self.received += 1
        self._last = scan
