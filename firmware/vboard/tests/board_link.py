# SPDX-License-Identifier: GPL-3.0-or-later
"""The host's end of the real firmware: framing and the records that these tests look into."""

from __future__ import annotations

import struct
from typing import Any

from cobs import cobs
from vboard import records

IDENTIFY, START, STOP = (r.frame_type for r in (records.IDENTIFY, records.START, records.STOP))
RESET, SYNC = records.RESET.frame_type, records.SYNC.frame_type
RESPONSE = records.RESPONSE_BIT
DATA, BOOT = records.DataFrame.TYPE, records.BootFrame.TYPE
ALL_CHANNELS = (1 << len(records.CHANNELS)) - 1


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

    def health(self) -> Any:
        """The last health frame's record."""
        return records.HealthFrame.unpack(self.of_type(records.HealthFrame.TYPE)[-1][1:])

    def scans(self) -> list[Any]:
        """The data frames' records."""
        return [records.DataFrame.unpack(payload[1:]) for payload in self.of_type(DATA)]
