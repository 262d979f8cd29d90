# SPDX-License-Identifier: GPL-3.0-or-later
"""The host's end of the real firmware: framing and the few records that these tests look into."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from cobs import cobs

IDENTIFY, CONFIGURE, START, STOP, RESET = 0x01, 0x02, 0x03, 0x04, 0x08
RESPONSE, DATA, HEALTH, BOOT = 0x80, 0x10, 0x11, 0x12
ALL_CHANNELS = 0x3F


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def request(command: int, request_id: int, arguments: bytes = b"") -> bytes:
    payload = bytes([command, request_id]) + arguments
    return cobs.encode(payload + struct.pack("<H", crc16(payload))) + b"\0"


@dataclass(frozen=True)
class Scan:
    sequence: int
    ticks: int
    valid_mask: int
    codes: tuple[int, ...]
    crank: int
    carriage: int
    flags: int


def parse_scan(payload: bytes) -> Scan:
    _, _, sequence, ticks, valid_mask, codes, crank, carriage, flags = struct.unpack(
        "<BBHIB18siiB", payload
    )
    values = tuple(int.from_bytes(codes[3 * i : 3 * i + 3], "little") for i in range(6))
    return Scan(sequence, ticks, valid_mask, values, crank, carriage, flags)


class Frames:
    """Takes bytes as they come and sorts the payloads of good frames; counts the bad ones."""

    def __init__(self) -> None:
        self._pending = b""
        self.payloads: list[bytes] = []
        self.bad = 0

    def take(self, data: bytes) -> None:
        *frames, self._pending = (self._pending + data).split(b"\0")
        for frame in filter(None, frames):
            try:
                body = cobs.decode(frame)
            except cobs.DecodeError:
                body = b""
            if len(body) > 2 and struct.unpack("<H", body[-2:])[0] == crc16(body[:-2]):
                self.payloads.append(body[:-2])
            else:
                self.bad += 1

    def of_type(self, frame_type: int) -> list[bytes]:
        return [payload for payload in self.payloads if payload[0] == frame_type]

    def scans(self) -> list[Scan]:
        return [parse_scan(payload) for payload in self.of_type(DATA)]
