# SPDX-License-Identifier: Apache-2.0
"""The driver's lines to a virtual board without a clock; its sensors drift, its shafts turn."""

from __future__ import annotations

import contextlib
import math
import os
import pty
from collections.abc import Callable, Sequence

from towtank_daq.board import Transport
from towtank_daq.serial_port import SerialPort, SerialPortError
from vboard import BenchFrame, ResetCause, VirtualBoard

MS = 1_000_000
SECOND = 1_000_000_000
COUNTS = 4096  # of a shaft's revolution
_QUANTUM_NS = 100_000  # how finely the line is looked at


class VirtualLine(Transport):
    """A driver's transport and clock; reading lets the board's time pass. It can be unplugged.

    dtr_resets: whether a pulse of DTR resets the board, as a Mega's USB does.
    ramps: of the terminals, by channel: V at the start, V/s. revolutions_per_s: of crank and
    carriage.
    """

    def __init__(
        self,
        board: VirtualBoard,
        ramps: Sequence[tuple[float, float]],
        revolutions_per_s: tuple[float, float],
        dtr_resets: bool = False,
    ) -> None:
        self.board = board
        self._dtr_resets = dtr_resets
        self._ramps = ramps
        self.plugged_ns = 0
        self.written_ns: list[int] = []  # when the driver has written
        self.crank_jitter = 0.0  # rad, to and fro with every bench frame
        self.wander = 0.0  # V, amplitude at 0.3 Hz on the first channel, as folded hum appears
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
        self.written_ns.append(self.board.now_ns)
        self.board.write(data)

    def read(self, timeout_s: float) -> bytes:
        self._check()
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        while True:
            data = self.board.read()
            if data or self.board.now_ns >= end_ns:
                return data
            self.run(min(end_ns, self.board.now_ns + _QUANTUM_NS))

    def reopen(self, timeout_s: float, reset: bool) -> None:
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        self.run(min(end_ns, max(self.plugged_ns, self.board.now_ns)))
        self._check()
        if reset and self._dtr_resets:
            self.board.reset(ResetCause.EXTERNAL)
        self.board.read()  # what was sent into an unplugged cable, or a closed port

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
            volts = [start + slope * time_s for start, slope in self._ramps]
            volts[0] += self.wander * math.sin(2 * math.pi * 0.3 * time_s)
            self.board.push_bench(
                BenchFrame(
                    self._fed_ns,
                    tuple(volts),
                    self._crank + self.crank_jitter,
                    self._carriage,
                )
            )
        self.board.run_until(until_ns)

    def _check(self) -> None:
        if self.board.now_ns < self.plugged_ns:
            raise SerialPortError("port board is gone: plug the board in and configure again")


class TerminalLine(VirtualLine):
    """The same through a pseudo terminal and the driver's serial port, where others can interfere.

    other: what another program has of the port when it has opened it. steal: bytes of the board
    that it takes at a time, every steal_ns.
    """

    def __init__(self, board: VirtualBoard, baud: int, *args: object, **kwargs: object) -> None:
        super().__init__(board, *args, **kwargs)
        self._board_side, self.other = pty.openpty()
        os.set_blocking(self._board_side, False)
        os.set_blocking(self.other, False)
        self.path = os.ttyname(self.other)
        self.port = SerialPort(self.path, baud)
        self.steal, self.steal_ns = 0, 50 * MS
        self._stolen_ns = 0

    def close(self) -> None:
        self.port.close()
        os.close(self._board_side)
        os.close(self.other)

    def write(self, data: bytes) -> None:
        self.port.write(data)
        with contextlib.suppress(BlockingIOError):
            super().write(os.read(self._board_side, 4096))

    def read(self, timeout_s: float) -> bytes:
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        while True:
            data = self.port.read(0.0)
            if data or self.board.now_ns >= end_ns:
                return data
            self.run(min(end_ns, self.board.now_ns + _QUANTUM_NS))
            sent = self.board.read()
            if sent:
                os.write(self._board_side, sent)
            if sent and self.steal and self.board.now_ns >= self._stolen_ns + self.steal_ns:
                self._stolen_ns = self.board.now_ns
                with contextlib.suppress(BlockingIOError):
                    os.read(self.other, self.steal)

    def reopen(self, timeout_s: float, reset: bool) -> None:
        super().reopen(timeout_s, reset)
        self.port.reopen(timeout_s, reset)

    def look_after(self) -> str:
        return self.port.look_after()

    def suspects(self) -> str:
        return self.port.suspects()
