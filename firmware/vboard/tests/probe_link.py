# SPDX-License-Identifier: GPL-3.0-or-later
"""The host's end of the probe firmware (probe.c), and the AD7124's transactions through it."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from vboard import BenchFrame, VirtualBoard

MILLISECOND = 1_000_000
SECOND = 1_000_000_000

# AD7124-8 registers: address, bytes
STATUS = (0x00, 1)
ADC_CONTROL = (0x01, 2)
DATA = (0x02, 3)
ID = (0x05, 1)
ERROR = (0x06, 3)
ERROR_EN = (0x07, 3)

CONTROL_CONTINUOUS = 1 << 10 | 1 << 8 | 2 << 6  # status behind data, internal reference, full power
SINC3_FS6 = 2 << 21 | 6
INTERNAL_REFERENCE = 2 << 3
BIPOLAR = 1 << 11
AVSS = 17
MASTER_CLOCK_HZ = 614400
SETTLED_S = (3 * 32 * 6 + 95) / MASTER_CLOCK_HZ

ACCELEROMETER = (4, AVSS, INTERNAL_REFERENCE)  # AINP, AINM, CONFIG

QUIET_VOLTS = (0.0, 0.0, 1.65, 1.65, 2.31, 10.0)


def channel(index: int) -> tuple[int, int]:
    return 0x09 + index, 2


def config(index: int) -> tuple[int, int]:
    return 0x19 + index, 2


def filter_(index: int) -> tuple[int, int]:
    return 0x21 + index, 3


def crc8(data: bytes) -> int:
    """CRC-8, polynomial 0x07, from 0: by long division, unlike the model's byte-wise loop."""
    remainder = int.from_bytes(data) << 8
    for bit in range(remainder.bit_length() - 1, 7, -1):
        if remainder >> bit & 1:
            remainder ^= 0x107 << (bit - 8)
    return remainder


@dataclass(frozen=True)
class Conversion:
    ticks: int | None  # of the board, when RDY̅ fell; None if it did not
    code: int
    status: int
    crc_good: bool


class Probe:
    def __init__(self, board: VirtualBoard) -> None:
        self.board = board
        self.crc = False
        board.run_until(2 * MILLISECOND)
        self.boot = board.read()

    def push(
        self,
        time_ns: int,
        volts: tuple[float, ...] = QUIET_VOLTS,
        crank: float = 0.0,
        carriage: float = 0.0,
    ) -> None:
        result = self.board.push_bench(BenchFrame(time_ns, volts, crank, carriage))
        assert result == 0, result.name

    def ask(self, request: bytes, answer_size: int, limit_ns: int = SECOND) -> bytes:
        """Sends a request and runs the board until the whole answer has come."""
        self.board.write(request)
        answer = b""
        start = self.board.now_ns
        while len(answer) < answer_size:
            assert self.board.now_ns - start < limit_ns, (request, answer)
            self.board.run_until(self.board.now_ns + 100_000)
            answer += self.board.read()
        assert len(answer) == answer_size, (request, answer)
        return answer

    def tell(self, request: bytes) -> None:
        """Sends a request that has no answer and lets the board obey."""
        self.board.write(request)
        self.board.run_until(self.board.now_ns + MILLISECOND)

    def ticks(self) -> int:
        return struct.unpack("<I", self.ask(b"k", 4))[0]

    def last_crank_edge(self) -> int:
        return struct.unpack("<I", self.ask(b"z", 4))[0]

    def counts(self) -> tuple[int, int, int]:
        """Crank and carriage counts, illegal steps."""
        return struct.unpack("<iiH", self.ask(b"n", 10))

    # ------------------------------------------------------------------------- AD7124

    def spi(self, data: bytes) -> bytes:
        return self.ask(b"s" + bytes([len(data)]) + data, len(data))

    def read(self, register: tuple[int, int]) -> int:
        address, size = register
        command = 0x40 | address
        answer = self.spi(bytes([command, *bytes(size + self.crc)]))
        if self.crc:
            assert crc8(bytes([command]) + answer[1:]) == 0
        return int.from_bytes(answer[1 : 1 + size])

    def write(self, register: tuple[int, int], value: int) -> None:
        address, size = register
        data = bytes([address]) + value.to_bytes(size)
        self.spi(data + (bytes([crc8(data)]) if self.crc else b""))

    def turn_crc_on(self) -> None:
        self.write(ERROR_EN, 0x000044)
        self.crc = True

    def set_up_scan(self, *inputs: tuple[int, int, int]) -> None:
        """Enables one channel per (AINP, AINM, CONFIG); sinc3, FS = 6; CRC on. SYNC is left low."""
        self.board.run_until(self.board.now_ns + 5 * MILLISECOND)  # the ADC's power-on
        self.tell(b"y\x00")
        self.turn_crc_on()
        for index, (positive, negative, setup) in enumerate(inputs):
            self.write(config(index), setup)
            self.write(filter_(index), SINC3_FS6)
            self.write(channel(index), 0x8000 | index << 12 | positive << 5 | negative)
        self.write(ADC_CONTROL, CONTROL_CONTINUOUS)

    def convert(self, count: int) -> tuple[int, list[Conversion]]:
        """Pulses SYNC and reads conversions: the tick at which SYNC rose, and the results."""
        answer = self.ask(b"t" + bytes([count]), 4 + 9 * count, limit_ns=20 * SECOND)
        start = struct.unpack_from("<I", answer)[0]
        conversions = []
        for i in range(count):
            ticks, data = struct.unpack_from("<I5s", answer, 4 + 9 * i)
            conversions.append(
                Conversion(
                    ticks=None if ticks == 0xFFFFFFFF else ticks,
                    code=int.from_bytes(data[:3]),
                    status=data[3],
                    crc_good=crc8(b"\x42" + data) == 0,
                )
            )
        return start, conversions
