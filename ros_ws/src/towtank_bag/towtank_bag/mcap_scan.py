# SPDX-License-Identifier: Apache-2.0
"""Walks an MCAP file record by record and notes where everything is.

The summary at the end of the file is not used, so that a file that was cut off is read exactly as
a complete one, up to the cut.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import defaultdict
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema

from towtank_bag.layout import BagError

_MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # and channel, sequence, log time, publish time
_CHANNEL_ID = struct.Struct("<H")


@dataclass
class ChunkPlace:
    """A chunk record in the file; offsets: by channel, where its messages start in the
    decompressed chunk."""

    offset: int
    length: int
    offsets: dict[int, np.ndarray] = field(default_factory=dict)


@dataclass
class Scan:
    """What an MCAP file holds. `end_seen` is False where it was cut off."""

    path: Path
    chunks: list[ChunkPlace] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    end_seen: bool = False
    damaged_chunks: int = 0

    def channel_messages(self, channel: int) -> tuple[np.ndarray, np.ndarray, list[bytes]]:
        """Log times and publish times (int64 ns, shape (n,)) and payloads of one channel, in the
        order of the file. A damaged chunk is left out and counted."""
        log_times, publish_times, payloads = [], [], []
        with self.path.open("rb") as file:
            for place in self.chunks:
                if channel not in place.offsets:
                    continue
                data = _chunk_data(file, place)
                if data is None:
                    self.damaged_chunks += 1
                    continue
                for start in place.offsets[channel].tolist():
                    _, length, _, _, log_time, publish_time = _MESSAGE_HEAD.unpack_from(data, start)
                    log_times.append(log_time)
                    publish_times.append(publish_time)
                    payloads.append(
                        data[start + _MESSAGE_HEAD.size : start + _RECORD_HEAD.size + length]
                    )
        return np.array(log_times, np.int64), np.array(publish_times, np.int64), payloads


def scan_file(path: Path) -> Scan:
    """Walk the file once. Raises BagError when it is no MCAP file or not written in chunks."""
    scan = Scan(path)
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise BagError(f"{path}: not an MCAP file, or cut off before anything was recorded")
        size = os.fstat(file.fileno()).st_size
        while True:
            head = file.read(_RECORD_HEAD.size)
            if len(head) < _RECORD_HEAD.size:
                break
            opcode, length = _RECORD_HEAD.unpack(head)
            body = file.tell()
            if opcode == 0 or body + length > size:
                break
            if opcode == Opcode.DATA_END:
                file.seek(size - len(_MAGIC))
                scan.end_seen = file.read() == _MAGIC
                break
            if opcode == Opcode.MESSAGE:
                raise BagError(f"{path}: messages outside chunks are not read; convert the bag")
            if opcode == Opcode.CHUNK:
                scan.chunks.append(ChunkPlace(body, length))
            elif opcode == Opcode.MESSAGE_INDEX:
                channel, offsets = _message_index(file.read(length))
                scan.chunks[-1].offsets[channel] = offsets
            elif opcode == Opcode.ATTACHMENT:
                attachment = Attachment.read(ReadDataStream(BytesIO(file.read(length))))
                scan.attachments[attachment.name] = attachment.data
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(ReadDataStream(BytesIO(file.read(length))))
                scan.metadata[metadata.name] = metadata.metadata
            file.seek(body + length)
        _complete_from_chunks(scan, file)
    return scan


def _complete_from_chunks(scan: Scan, file: BinaryIO) -> None:
    """Schemas and channels stand inside the chunks; so do messages whose index was cut off."""
    for number, place in enumerate(scan.chunks):
        index_cut_off = not scan.end_seen and number == len(scan.chunks) - 1
        if place.offsets and place.offsets.keys() <= scan.channels.keys() and not index_cut_off:
            continue
        data = _chunk_data(file, place)
        if data is None:
            scan.damaged_chunks += 1
            place.offsets.clear()
            continue
        _walk_chunk(scan, place, data)


def _walk_chunk(scan: Scan, place: ChunkPlace, data: bytes) -> None:
    offsets = defaultdict(list)
    position = 0
    while position < len(data):
        opcode, length = _RECORD_HEAD.unpack_from(data, position)
        body = position + _RECORD_HEAD.size
        if opcode == Opcode.MESSAGE:
            offsets[_CHANNEL_ID.unpack_from(data, body)[0]].append(position)
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(BytesIO(data[body : body + length])))
            scan.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(data[body : body + length])))
            scan.channels[channel.id] = channel
        position = body + length
    place.offsets = {channel: np.array(starts) for channel, starts in offsets.items()}


def _message_index(body: bytes) -> tuple[int, np.ndarray]:
    """Channel, and starts of its messages in the chunk before."""
    entries = np.frombuffer(body, "<u8", offset=_CHANNEL_ID.size + 4)  # u32: bytes of the array
    return _CHANNEL_ID.unpack_from(body)[0], entries[1::2]


def _chunk_data(file: BinaryIO, place: ChunkPlace) -> bytes | None:
    """Decompressed content of a chunk, or None when it is damaged."""
    file.seek(place.offset)
    chunk = Chunk.read(ReadDataStream(BytesIO(file.read(place.length))))
    if chunk.compression == "zstd":
        try:
            data = zstandard.decompress(chunk.data, chunk.uncompressed_size)
        except zstandard.ZstdError:
            return None
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise BagError(f"chunks compressed with {chunk.compression} are not read; convert the bag")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        return None
    return data
