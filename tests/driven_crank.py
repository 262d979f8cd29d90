# SPDX-License-Identifier: Apache-2.0
"""A virtual board without a clock, with a motor on its crank, and its driver."""

from __future__ import annotations

import math
import sys
from pathlib import Path

from towtank_daq.board import AdcBoard, DriveState
from towtank_daq.description import installed_description, load_description
from towtank_daq.protocol import Protocol

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "firmware" / "vboard"))

from vboard import VirtualBoard  # noqa: E402
from virtual_line import COUNTS, MS, VirtualLine  # noqa: E402

ELF = ROOT / "build" / "firmware" / "towtank_board.elf"
PROTOCOL = Protocol(load_description(installed_description()))
AT_REST = [(volts, 0.0) for volts in (0.012, 0.020, 1.65, 1.65, 2.31, 10.0)]
RPM = 2 * math.pi / 60
REPEAT_S = 0.25


class Rig:
    """A board with a motor, its driver, and a hand on the switch."""

    def __init__(self, board: VirtualBoard, carriage_rate: float = 0.0) -> None:
        self.board = board
        self.scans: list = []
        self.states: list[DriveState] = []
        self.warnings: list[str] = []
        self.line = VirtualLine(board, AT_REST, (0.0, carriage_rate))
        self.driver = AdcBoard(
            self.line,
            PROTOCOL,
            self.scans.append,
            self.warnings.append,
            self.line.monotonic_ns,
            on_drive=self.states.append,
        )
        self.driver.connect()

    def run(self, rpm: float, seconds: float, counts: int = COUNTS) -> None:
        """Keep the crank at a speed, as a host does: it asks again and again."""
        end_ns = self.board.now_ns + round(1e9 * seconds)
        while self.board.now_ns < end_ns:
            self.driver.drive("run", rpm, counts)
            self.wait(min(REPEAT_S, (end_ns - self.board.now_ns) / 1e9))

    def wait(self, seconds: float) -> None:
        """Let time pass without a word to the drive."""
        end_ns = self.board.now_ns + round(1e9 * seconds)
        while self.board.now_ns < end_ns:
            self.driver.poll((end_ns - self.board.now_ns) / 1e9)

    def off_within(self, seconds: float) -> float:
        """When the motor has lost its power, s from now; fails if it has not by then."""
        start_ns = self.board.now_ns
        while self.board.counters()["motor_duty"] > 0.0:
            assert self.board.now_ns < start_ns + 1e9 * seconds, "the motor still has power"
            self.line.run(self.board.now_ns + MS // 2)
        return (self.board.now_ns - start_ns) / 1e9

    @property
    def state(self) -> tuple[str, str]:
        self.wait(0.02)
        last = self.states[-1]
        return last.state, last.trip
