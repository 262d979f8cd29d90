# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file on a disk that may have spoilt them.

`RecordFile.at` gives the record at a place only if its parts fill it exactly, and `next_after`
finds the next one behind a damaged place.
"""

from __future__ import annotations

import errno
import os
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, BinaryIO

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
_CHUNK_HEAD = struct.Struct("<QQQII")  # first and last log time, size, CRC, length of compression
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")

_PARTS: dict[int, tuple[int | struct.Struct, ...]] = {
    Opcode.HEADER: (_U32, _U32),
    Opcode.SCHEMA: (2, _U32, _U32, _U32),
    Opcode.CHANNEL: (4, _U32, _U32, _U32),
    Opcode.CHUNK: (28, _U32, _U64),
    Opcode.MESSAGE_INDEX: (2, _U32),
    Opcode.ATTACHMENT: (16, _U32, _U32, _U64, 4),
    Opcode.METADATA: (_U32, _U32),
    Opcode.DATA_END: (4,),
}
"""What the records of a data section are made of: bytes of a fixed number, or a length and so many
bytes after it. Such a record is as long as its parts together."""

MESSAGE_BYTES = 22
"""Of a message record without its payload, behind the record's head."""

_PRIVATE = 0x80  # opcodes from here on are other programs' own

_FOUND_AGAIN = (
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT,
    Opcode.METADATA,
    Opcode.DATA_END,
)
_BLOCK = 1 << 20
_SECTOR = 512
_MAX_CHUNK_BYTES = 1 << 30
"""A chunk that claims more is damaged; it is not tried what memory there is for it."""


@dataclass(frozen=True)
class Record:
    """A record of a file: opcode, where its content begins, and its length in bytes."""

    opcode: int
    body: int
    length: int

    @property
    def start(self) -> int:
        """Where the record itself begins."""
        return self.body - RECORD_HEAD.size

    @property
    def end(self) -> int:
        """Where the next one begins."""
        return self.body + self.length


class RecordFile:
    """An open MCAP file as places in it; `end`: up to where records are looked for."""

    def __init__(self, file: BinaryIO) -> None:
        self._descriptor = file.fileno()
        self.size = os.fstat(self._descriptor).st_size
        self.end = self.size

    def read(self, start: int, length: int) -> bytes:
        """Bytes from a place on, as far as the file goes; zeros for what the disk cannot give."""
        length = max(0, min(length, self.size - start))
        try:
            return os.pread(self._descriptor, length, start)
        except OSError as error:
            if error.errno != errno.EIO:
                raise
        pieces = range(start, start + length, _SECTOR)
        return b"".join(self._sector(at, min(_SECTOR, start + length - at)) for at in pieces)

    def _sector(self, start: int, length: int) -> bytes:
        try:
            return os.pread(self._descriptor, length, start)
        except OSError:
            return bytes(length)

    def content(self, record: Record) -> bytes:
        """All bytes of a record behind its head."""
        return self.read(record.body, record.length)

    def at(self, position: int) -> Record | None:
        """The record that begins here; None where nothing does that could be one."""
        head = self.read(position, RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size:
            return None
        opcode, length = RECORD_HEAD.unpack(head)
        record = Record(opcode, position + RECORD_HEAD.size, length)
        if record.end > self.end:
            return None
        if opcode == Opcode.MESSAGE:
            whole = length >= MESSAGE_BYTES
        elif opcode >= _PRIVATE:
            whole = True
        else:
            whole = opcode in _PARTS and self._parts_fill(record)
        return record if whole else None

    def next_after(self, position: int, plain: bool) -> Record | None:
        """The first record behind a damaged place that can be believed: what has a checksum agrees
        with it, and behind the rest begins another record, or the file ends.

        plain: look for messages too, in a file that has no chunks.
        """
        sought = (Opcode.MESSAGE, *_FOUND_AGAIN) if plain else _FOUND_AGAIN
        for start in self._candidates(position + 1, sought):
            record = self.at(start)
            if record is not None and self._believable(record):
                return record
        return None

    def crc(self, start: int, end: int) -> int:
        """CRC-32 of the bytes from start to end."""
        crc = 0
        for position in range(start, end, _BLOCK):
            crc = zlib.crc32(self.read(position, min(_BLOCK, end - position)), crc)
        return crc

    def _parts_fill(self, record: Record) -> bool:
        position = record.body
        for part in _PARTS[record.opcode]:
            if isinstance(part, int):
                position += part
            else:
                if position + part.size > record.end:
                    return False
                (length,) = part.unpack(self.read(position, part.size))
                position += part.size + length
        return position == record.end

    def _candidates(self, position: int, opcodes: Sequence[int]) -> Iterator[int]:
        """Places with one of the opcodes and a length below 2⁴⁰."""
        sought = np.zeros(256, bool)
        sought[[int(opcode) for opcode in opcodes]] = True
        head = RECORD_HEAD.size
        while position + head <= self.end:
            block = np.frombuffer(self.read(position, _BLOCK + head - 1), np.uint8)
            starts = len(block) - head + 1
            if starts <= 0:
                return
            likely = sought[block[:starts]]
            for byte in range(6, head):
                likely &= block[byte : byte + starts] == 0
            for start in np.flatnonzero(likely).tolist():
                yield position + start
            position += starts

    def _believable(self, record: Record) -> bool:
        if record.opcode == Opcode.CHUNK:
            return chunk_content(self.content(record)) is not None
        if record.opcode == Opcode.ATTACHMENT and attachment_holds(self.content(record)):
            return True
        if record.end == self.end:
            return True
        following = self.at(record.end)
        if record.opcode != Opcode.MESSAGE or following is None:
            return following is not None
        # Any bytes may look like a message; hardly three times in a row
        return following.end == self.end or self.at(following.end) is not None


def parsed(kind: Any, body: bytes) -> Any:
    """A record of a class of `mcap.records`; None where the bytes make none."""
    stream = ReadDataStream(BytesIO(body))
    try:
        record = kind.read(stream)
    except (McapError, UnicodeDecodeError, struct.error):
        return None
    return record if stream.count == len(body) else None


def attachment_holds(body: bytes) -> bool | None:
    """Whether an attachment agrees with its checksum; None where it has none."""
    (crc,) = _U32.unpack_from(body, len(body) - _U32.size)
    return None if crc == 0 else zlib.crc32(body[: -_U32.size]) == crc


@dataclass(frozen=True)
class ChunkContent:
    """The records of a chunk, decompressed. verified: whether a checksum says that they are right;
    a wrong one gives no content."""

    data: bytes
    verified: bool


def chunk_compression(body: bytes) -> str:
    """How a chunk says that it is compressed; empty where it is not."""
    length = _CHUNK_HEAD.unpack_from(body)[4]
    return body[_CHUNK_HEAD.size : _CHUNK_HEAD.size + length].decode(errors="replace")


def chunk_content(body: bytes) -> ChunkContent | None:
    """The content of a chunk record whose parts fill it; None where it is damaged or its
    compression is not known here."""
    _, _, size, crc, name_length = _CHUNK_HEAD.unpack_from(body)
    stored = memoryview(body)[_CHUNK_HEAD.size + name_length + _U64.size :]
    if size > _MAX_CHUNK_BYTES:
        return None
    try:
        data = _decompressed(stored, chunk_compression(body), size)
    except (zstandard.ZstdError, RuntimeError, EOFError, ValueError, MemoryError):
        return None
    if data is None or len(data) != size:
        return None
    actual = zlib.crc32(data)
    if crc not in (0, actual):
        return None
    return ChunkContent(data, verified=crc == actual)


def _decompressed(stored: memoryview, compression: str, size: int) -> bytes | None:
    if compression == "":
        return bytes(stored)
    if compression == "zstd":
        if zstandard.frame_content_size(stored) not in (size, -1):  # -1: it does not say
            return None
        return zstandard.decompress(stored, size)
    if compression == "lz4":
        return bytes(lz4.frame.decompress(stored))
    return None
