# SPDX-License-Identifier: Apache-2.0
"""Frames on the serial line: COBS(payload, CRC-16/CCITT-FALSE little-endian) and a zero byte.

COBS takes every zero out of a frame, so that a zero on the line can only be a frame's end. A
reader that has lost its place is back in step at the next zero, whatever came before it.
"""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import dataclass

from cobs import cobs

_CRC_SEED = 0xFFFF
_CRC_BYTES = 2
_END = b"\0"


def encode_frame(payload: bytes) -> bytes:
    """The bytes on the line for one payload, with the closing zero."""
    crc = crc_hqx(payload, _CRC_SEED).to_bytes(_CRC_BYTES, "little")
    coded: bytes = cobs.encode(payload + crc)
    return coded + _END


def encoded_size(payload_size: int) -> int:
    """Bytes on the line for a payload of `payload_size` bytes (below 253: one COBS block)."""
    return payload_size + _CRC_BYTES + 2  # COBS code byte and closing zero


@dataclass(slots=True)
class FrameCounters:
    """What the reader has seen so far."""

    frames: int = 0
    bad_cobs: int = 0
    bad_crc: int = 0
    bad_length: int = 0
    """Frames that are longer than any of the protocol, or too short to hold a payload."""

    @property
    def bad(self) -> int:
        return self.bad_cobs + self.bad_crc + self.bad_length


class FrameReader:
    """Takes the line's bytes as they come and gives the payloads of good frames.

    Never holds more than one frame of the greatest size: the rest of a longer run of bytes without
    a zero is dropped as it comes, and counted once.
    """

    def __init__(self, max_payload_size: int) -> None:
        # COBS adds one byte to each block of 254
        coded = max_payload_size + _CRC_BYTES
        self._max_size = coded + coded // 254 + 1
        self._pending = bytearray()
        self._too_long = False
        self.counters = FrameCounters()

    def feed(self, data: bytes) -> list[bytes]:
        """The payloads that `data` completes, in order."""
        payloads = []
        *endings, rest = data.split(_END)
        for ending in endings:
            self._append(ending)
            if self._too_long:
                self.counters.bad_length += 1
            elif self._pending:  # two zeros in a row hold no frame
                payload = self._decode(self._pending)
                if payload is not None:
                    self.counters.frames += 1
                    payloads.append(payload)
            self._pending.clear()
            self._too_long = False
        self._append(rest)
        return payloads

    def reset(self) -> None:
        """Forget an unfinished frame, as after the line was opened again."""
        self._pending.clear()
        self._too_long = False

    def _append(self, data: bytes) -> None:
        if len(self._pending) + len(data) > self._max_size:
            self._too_long = True
            self._pending.clear()
        if not self._too_long:
            self._pending += data

    def _decode(self, coded: bytearray) -> bytes | None:
        try:
            content: bytes = cobs.decode(bytes(coded))
        except cobs.DecodeError:
            self.counters.bad_cobs += 1
            return None
        if len(content) <= _CRC_BYTES:
            self.counters.bad_length += 1
            return None
        # Over payload and CRC (high byte first) the CRC would be zero; ours is low byte first
        payload, crc = content[:-_CRC_BYTES], content[-_CRC_BYTES:]
        if crc_hqx(payload, _CRC_SEED) != int.from_bytes(crc, "little"):
            self.counters.bad_crc += 1
            return None
        return payload
