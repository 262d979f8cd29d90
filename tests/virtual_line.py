# SPDX-License-Identifier: Apache-2.0
"""The driver's line to a virtual board without a clock; its sensors drift, its shafts turn."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from towtank_daq.serial_port import SerialPortError
from vboard import BenchFrame, VirtualBoard

MS = 1_000_000
SECOND = 1_000_000_000
COUNTS = 4096  # of a shaft's revolution
_QUANTUM_NS = 100_000  # how finely the line is looked at


class VirtualLine:
    """A driver's transport and clock; reading lets the board's time pass. It can be unplugged.

    ramps: of the terminals, by channel: V at the start, V/s. revolutions_per_s: of crank and
    carriage.
    """

    def __init__(
        self,
        board: VirtualBoard,
        ramps: Sequence[tuple[float, float]],
        revolutions_per_s: tuple[float, float],
    ) -> None:
        self.board = board
        self._ramps = ramps
        self.plugged_ns = 0
        self.crank_jitter = 0.0  # rad, to and fro with every bench frame
        self.crank_rate, self.carriage_rate = (2 * math.pi * r for r in revolutions_per_s)  # rad/s
        self._crank = self._carriage = 0.0
        self._fed_ns = 0
        self._event_ns, self._event = 0, None

    def monotonic_ns(self) -> int:
        return self.board.now_ns

    def unplug(self, seconds: float) -> None:
        """The port vanishes and comes back."""
        self.plugged_ns = self.board.now_ns + round(1e9 * seconds)

    def write(self, data: bytes) -> None:
        self._check()
        self.board.write(data)

    def read(self, timeout_s: float) -> bytes:
        self._check()
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        while True:
            data = self.board.read()
            if data or self.board.now_ns >= end_ns:
                return data
            self.run(min(end_ns, self.board.now_ns + _QUANTUM_NS))

    def reopen(self, timeout_s: float) -> None:
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        self.run(min(end_ns, max(self.plugged_ns, self.board.now_ns)))
        self.board.read()  # what was sent into an unplugged cable
        self._check()

    def after(self, seconds: float, event: Callable[[], None]) -> None:
        """Something happens to the board, whatever the driver is doing then."""
        self._event_ns, self._event = self.board.now_ns + round(1e9 * seconds), event

    def run(self, until_ns: int) -> None:
        """Let time pass."""
        if self._event is not None and until_ns >= self._event_ns:
            event, self._event = self._event, None
            self.run(self._event_ns)
            event()
        while self._fed_ns < until_ns + 20 * MS:
            self._fed_ns += 5 * MS
            time_s = self._fed_ns / SECOND
            self._crank += self.crank_rate * 5e-3
            self._carriage += self.carriage_rate * 5e-3
            self.crank_jitter = -self.crank_jitter
            self.board.push_bench(
                BenchFrame(
                    self._fed_ns,
                    tuple(start + slope * time_s for start, slope in self._ramps),
                    self._crank + self.crank_jitter,
                    self._carriage,
                )
            )
        self.board.run_until(until_ns)

    def _check(self) -> None:
        if self.board.now_ns < self.plugged_ns:
            raise SerialPortError("port board is gone: plug the board in and configure again")
