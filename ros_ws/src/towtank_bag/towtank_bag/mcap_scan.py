# SPDX-License-Identifier: Apache-2.0
"""Walks an MCAP file record by record, holds each against its checksum, and notes where everything
is and what is damaged.

Nothing is believed that has a witness and does not agree with it. Where the messages of a chunk
begin is found by walking the chunk, whose checksum has been verified, and not read from the message
index, which has none; so a file without one, or one that was cut off, is read as a whole one is.
Behind a damaged place the walk goes on at the next record that can be believed.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Container, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from towtank_bag.layout import BagError
from towtank_bag.mcap_records import (
    MAGIC,
    MESSAGE_BYTES,
    RECORD_HEAD,
    Record,
    RecordFile,
    attachment_holds,
    chunk_compression,
    chunk_content,
    parsed,
)

KEPT_BYTES = 256 << 20
"""Of decompressed chunks in memory, a file: every topic is read out of nearly each of them."""

MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # and channel, sequence, log time, publish time
_HEAD_AND_CHANNEL = struct.Struct("<BQH")
_TAIL = struct.Struct("<9sQQI8s")  # footer: head, summary's start, its offsets' start, CRC; magic
_FOOTER_HEAD = RECORD_HEAD.pack(Opcode.FOOTER, 20)
_IN_SUMMARY = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.STATISTICS: Statistics,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.METADATA_INDEX: MetadataIndex,
}
_STRETCH_BYTES = 1 << 20  # of messages outside of chunks that are taken together
_MESSAGE_FIELDS = np.dtype(
    {
        "names": ["length", "channel", "sequence", "log_time", "publish_time"],
        "formats": ["<u8", "<u2", "<u4", "<i8", "<i8"],
        "offsets": [1, 9, 11, 15, 23],
        "itemsize": MESSAGE_HEAD.size,
    }
)


MessageKey = tuple[int, int, int]
"""Log time, publish time and sequence number: no two messages of a topic have the same."""


class NoMcapError(BagError):
    """A file that is no MCAP file, or of which not even one record is left."""


@dataclass
class Block:
    """Records of messages that stand behind one another: the content of a chunk, or a stretch of
    the file itself where there are no chunks.

    offsets: by channel, int64, where its messages begin in the block. first_ns, last_ns: smallest
    and largest log time, ns since the epoch. data: the content, if it was kept.
    """

    record: Record | None
    start: int
    length: int
    offsets: dict[int, np.ndarray] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    data: bytes | None = None

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(len(starts) for starts in self.offsets.values())


@dataclass(frozen=True)
class Damage:
    """A place of the file that was given up, in bytes from the file's start.

    names: of the attachments and metadata that were in it, as far as they are known. messages:
    whether messages may have been. from_ns, to_ns: log times of the last one before and of the
    first one behind; None where there is none.
    """

    start: int
    length: int
    names: list[str]
    messages: bool
    from_ns: int | None
    to_ns: int | None


@dataclass(frozen=True)
class AttachedFile:
    """An attachment. intact: whether its checksum says so; None without one."""

    data: bytes
    intact: bool | None


@dataclass
class Scan:
    """What an MCAP file holds.

    damage: in the order of the file. broke_off: it ends before its data section does.
    summary_lost: it ends behind that, but without a summary that can be believed. expected: number
    of messages, as the summary counted them; None without one. checked: whether checksums say that
    all messages are right. data_crc_holds: of everything before the summary;
    None where the file has no such checksum. private_records: other programs' own, passed over.
    nameless: messages left out because nothing tells which topic they are of. repeated: messages
    left out because another file has them.
    """

    path: Path
    blocks: list[Block] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    attachments: dict[str, AttachedFile] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    damage: list[Damage] = field(default_factory=list)
    broke_off: bool = False
    summary_lost: bool = False
    expected: int | None = None
    checked: bool = True
    data_crc_holds: bool | None = None
    private_records: int = 0
    nameless: int = 0
    repeated: int = 0

    @property
    def first_ns(self) -> int | None:
        """Smallest log time, ns since the epoch; None without messages."""
        return min((block.first_ns for block in self.blocks if block.count), default=None)

    @property
    def last_ns(self) -> int | None:
        """Largest log time, ns since the epoch; None without messages."""
        return max((block.last_ns for block in self.blocks if block.count), default=None)

    @property
    def count(self) -> int:
        """Number of messages that can be read."""
        return sum(block.count for block in self.blocks)

    @property
    def lost(self) -> int | None:
        """Number of messages that the file once held and that cannot be read; None if unknown."""
        if self.expected is None:
            return None
        return max(0, self.expected - self.count - self.repeated)

    def count_of(self, channel: int) -> int:
        """Number of messages of a channel that can be read."""
        return sum(len(block.offsets.get(channel, ())) for block in self.blocks)

    def keys(self) -> dict[int, set[MessageKey]]:
        """What tells the messages of each channel from one another."""
        return {
            channel: {key for data, starts in self._found({channel}) for key in _keys(data, starts)}
            for channel in self.channels
        }

    def leave_out(self, known: Mapping[int, Container[MessageKey]]) -> None:
        """Leave out the messages with these keys, by channel, and count them in `repeated`."""
        with open_file(self.path) as file:
            for block in self.blocks:
                data = self._content(file, block)
                for channel, starts in list(block.offsets.items()):
                    new = [key not in known[channel] for key in _keys(data, starts)]
                    self.repeated += new.count(False)
                    block.offsets[channel] = starts[new]

    def messages(self, channels: Container[int]) -> tuple[np.ndarray, np.ndarray, list[bytes]]:
        """Log times and publish times (int64 ns, shape (n,)) and payloads of some channels, in the
        order of the file."""
        none = np.empty(0, np.int64)
        log_times, publish_times, payloads = [none], [none], []
        for data, starts in self._found(channels):
            heads = message_heads(data, starts)
            log_times.append(heads["log_time"])
            publish_times.append(heads["publish_time"])
            begins = (starts + MESSAGE_HEAD.size).tolist()
            ends = (starts + RECORD_HEAD.size + heads["length"].astype(np.int64)).tolist()
            payloads += [data[begin:end] for begin, end in zip(begins, ends, strict=True)]
        return np.concatenate(log_times), np.concatenate(publish_times), payloads

    def _found(self, channels: Container[int]) -> Iterator[tuple[bytes, np.ndarray]]:
        """Content of each block that has messages of the channels, and where they begin in it."""
        wanted = [
            (block, [starts for channel, starts in block.offsets.items() if channel in channels])
            for block in self.blocks
        ]
        wanted = [(block, starts) for block, starts in wanted if starts]
        if not wanted:
            return
        with open_file(self.path) as file:
            for block, starts in wanted:
                together = starts[0] if len(starts) == 1 else np.sort(np.concatenate(starts))
                yield self._content(file, block), together

    def _content(self, file: BinaryIO, block: Block) -> bytes:
        data = block.data if block.data is not None else _content_again(file, block)
        if data is None:
            raise BagError(f"{self.path}: it was changed while it was read; read it again")
        return data


def message_heads(data: bytes, starts: np.ndarray) -> np.ndarray:
    """Heads of the messages that begin at `starts`: structured, shape (n,), fields length,
    channel, sequence, log_time, publish_time."""
    anywhere = len(data) - MESSAGE_HEAD.size + 1
    return np.ndarray(anywhere, _MESSAGE_FIELDS, data, strides=(1,))[starts]


def _keys(data: bytes, starts: np.ndarray) -> list[MessageKey]:
    heads = message_heads(data, starts)
    fields = ("log_time", "publish_time", "sequence")
    return list(zip(*(heads[name].tolist() for name in fields), strict=True))


@contextmanager
def open_file(path: Path) -> Iterator[BinaryIO]:
    """The file, open for reading; raises BagError where it cannot be opened or read."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        mend = "fetch what the link names" if path.is_symlink() else "make it readable"
        raise BagError(
            f"{path}: cannot be read: {error.strerror}; {mend}, or move it out of the bag"
        ) from error


def scan_file(path: Path) -> Scan:
    """Walk the file once. Raises BagError when it cannot be read or is no MCAP file."""
    with open_file(path) as file:
        return _Walk(path, RecordFile(file)).scan()


@dataclass(frozen=True)
class _Summary:
    """What stands behind the data section, if its checksum holds. names: of attachments and
    metadata, by where they begin."""

    start: int
    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    expected: int | None = None
    names: dict[int, str] = field(default_factory=dict)

    @staticmethod
    def of(start: int, data: bytes) -> _Summary:
        summary = _Summary(start)
        expected = None
        position = 0
        while position + RECORD_HEAD.size <= len(data):
            opcode, length = RECORD_HEAD.unpack_from(data, position)
            position += RECORD_HEAD.size + length
            kind = _IN_SUMMARY.get(opcode)
            record = kind and parsed(kind, data[position - length : position])
            if isinstance(record, Schema):
                summary.schemas.append(record)
            elif isinstance(record, Channel):
                summary.channels.append(record)
            elif isinstance(record, Statistics):
                expected = record.message_count
            elif isinstance(record, AttachmentIndex):
                summary.names[record.offset] = record.name
            elif isinstance(record, MetadataIndex):
                summary.names[record.offset] = f"the note '{record.name}'"
        return replace(summary, expected=expected)


class _Walk:
    """One walk through a file."""

    def __init__(self, path: Path, file: RecordFile) -> None:
        self._file = file
        self._scan = Scan(path)
        self._summary: _Summary | None = None
        self._summary_unchecked = False
        self._damage: list[tuple[Damage, int]] = []  # and the number of blocks before
        self._unverified: list[Block] = []
        self._unknown_compressions: set[str] = set()
        self._kept = 0

    def scan(self) -> Scan:
        self._summary, self._summary_unchecked = _read_summary(self._file)
        if self._summary is not None:
            self._file.end = self._summary.start
        data_end = self._walk()
        scan = self._scan
        if self._summary is not None:
            for schema in self._summary.schemas:
                scan.schemas.setdefault(schema.id, schema)
            for channel in self._summary.channels:
                scan.channels.setdefault(channel.id, channel)
            scan.expected = self._summary.expected
        elif data_end is None:
            scan.broke_off = True
        else:
            scan.summary_lost = not self._summary_unchecked
        if data_end is not None:
            self._hold_against_crc(data_end)
        self._judge_unverified()
        self._place_damage()
        for block in scan.blocks:
            for channel in [c for c in block.offsets if c not in scan.channels]:
                scan.nameless += len(block.offsets.pop(channel))
        if self._unknown_compressions and not scan.count:
            names = ", ".join(sorted(self._unknown_compressions))
            raise BagError(
                f"{scan.path}: its chunks are compressed with {names}, which is not read; compress "
                "them with zstd or lz4 (mcap compress)"
            )
        return scan

    def _walk(self) -> Record | None:
        """Take every record; returns the end of the data section, None where it is not there."""
        position = len(MAGIC)
        if self._file.read(0, position) != MAGIC:
            position = self._give_up(0)
            if position == self._file.end:
                raise NoMcapError(
                    f"{self._scan.path}: not an MCAP file, or cut off before anything was "
                    "recorded; move it out of the bag"
                )
        while position < self._file.end:
            record = self._file.at(position)
            if record is None:
                position = self._give_up(position)
            elif record.opcode == Opcode.DATA_END:
                return record
            elif record.opcode in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
                position = self._take_plain(record)
            else:
                self._take(record)
                position = record.end
        return None

    def _give_up(self, position: int) -> int:
        """Leave out everything from here to the next record that can be believed."""
        found = self._file.next_after(position, plain=self._plain)
        end = self._file.end if found is None else found.start
        if found is not None or self._summary is not None:  # else the recording broke off here
            self._note(position, end)
        return end

    def _note(self, start: int, end: int, name: str | None = None) -> None:
        """Damage; name: of the attachment that alone is concerned."""
        if name is not None:
            names = [name]
        else:
            known = self._summary.names if self._summary is not None else {}
            names = [n for place, n in known.items() if start <= place < end]
        damage = Damage(start, end - start, names, name is None, None, None)
        self._damage.append((damage, len(self._scan.blocks)))

    @property
    def _plain(self) -> bool:
        """Whether messages of this file stand outside of chunks."""
        return any(block.record is None for block in self._scan.blocks)

    def _take(self, record: Record) -> None:
        scan = self._scan
        if record.opcode == Opcode.CHUNK:
            self._take_chunk(record)
        elif record.opcode == Opcode.ATTACHMENT:
            body = self._file.content(record)
            attachment = parsed(Attachment, body)
            intact = attachment_holds(body)
            name = attachment.name if attachment is not None else "an attachment"
            if attachment is not None and (intact is not False or name not in scan.attachments):
                scan.attachments[name] = AttachedFile(attachment.data, intact)
            if attachment is None or intact is False:
                self._note(record.start, record.end, name)
        elif record.opcode == Opcode.METADATA:
            metadata = parsed(Metadata, self._file.content(record))
            if metadata is None:
                self._note(record.start, record.end, "a note")
            else:
                scan.metadata[metadata.name] = metadata.metadata
        elif record.opcode not in (Opcode.HEADER, Opcode.MESSAGE_INDEX):
            scan.private_records += 1

    def _take_chunk(self, record: Record) -> None:
        body = self._file.content(record)
        content = chunk_content(body)
        block = None
        if content is not None:
            block = Block(record, record.body, record.length)
            if self._fill(block, content.data) != len(content.data):
                block = None
        if block is None:
            if (compression := chunk_compression(body)) not in ("", "zstd", "lz4"):
                self._unknown_compressions.add(compression)
            self._note(record.start, record.end)
            return
        if not content.verified:
            self._unverified.append(block)
        self._scan.blocks.append(block)

    def _take_plain(self, record: Record) -> int:
        """Take messages that stand in the file itself. Returns where they end."""
        if any(block.record is not None for block in self._scan.blocks):
            return self._give_up(record.start)  # beside chunks it is another record, damaged
        length = max(record.end - record.start, _STRETCH_BYTES)
        data = self._file.read(record.start, min(length, self._file.end - record.start))
        block = Block(None, record.start, 0)
        block.length = self._fill(block, data)
        if not block.length:
            return self._give_up(record.start)
        if block.count:
            self._scan.blocks.append(block)
            self._unverified.append(block)
        return record.start + block.length

    def _fill(self, block: Block, data: bytes) -> int:
        """Note the messages, channels and schemas in the data. Returns where that ends: behind the
        last of them that is whole."""
        offsets, others, end = _walk_messages(data)
        for opcode, start, stop in others:
            kind = Schema if opcode == Opcode.SCHEMA else Channel
            found = parsed(kind, data[start:stop])
            if found is None:
                return 0
            known = self._scan.schemas if opcode == Opcode.SCHEMA else self._scan.channels
            known[found.id] = found
        block.offsets = {channel: np.array(starts) for channel, starts in offsets.items()}
        if block.offsets:
            heads = message_heads(data, np.concatenate(list(block.offsets.values())))
            block.first_ns = int(heads["log_time"].min())
            block.last_ns = int(heads["log_time"].max())
        if block.record is not None and self._kept + len(data) <= KEPT_BYTES:
            self._kept += len(data)
            block.data = data
        return end

    def _hold_against_crc(self, data_end: Record) -> None:
        crc = int.from_bytes(self._file.content(data_end), "little")
        if crc:
            self._scan.data_crc_holds = self._file.crc(0, data_end.start) == crc

    def _judge_unverified(self) -> None:
        """Where other chunks or attachments have checksums, one without is damaged."""
        scan = self._scan
        if scan.data_crc_holds:
            return
        checksums = len(self._unverified) < len(scan.blocks)
        if checksums or any(file.intact for file in scan.attachments.values()):
            for name, file in scan.attachments.items():
                if file.intact is None:
                    scan.attachments[name] = replace(file, intact=False)
                    self._note(0, 0, name)
        if self._unverified and not checksums:
            scan.checked = False
        for block in self._unverified if checksums else ():
            damage = Damage(block.start, block.length, [], True, None, None)
            self._damage.append((damage, scan.blocks.index(block)))
            block.offsets = {}

    def _place_damage(self) -> None:
        """When in the recording each damage is."""
        blocks = self._scan.blocks
        for damage, before in sorted(self._damage, key=lambda noted: noted[0].start):
            earlier = max((b.last_ns for b in blocks[:before] if b.offsets), default=None)
            later = min((b.first_ns for b in blocks[before:] if b.offsets), default=None)
            self._scan.damage.append(replace(damage, from_ns=earlier, to_ns=later))


def _walk_messages(
    data: bytes,
) -> tuple[dict[int, list[int]], list[tuple[int, int, int]], int]:
    """Where messages begin, by channel; opcode, start and end of the content of schemas and
    channels; and where that ends: behind the last whole record of these kinds."""
    offsets: dict[int, list[int]] = defaultdict(list)
    others = []
    size, position = len(data), 0
    unpack, head_size = _HEAD_AND_CHANNEL.unpack_from, RECORD_HEAD.size
    while position + _HEAD_AND_CHANNEL.size <= size:
        opcode, length, channel = unpack(data, position)
        end = position + head_size + length
        if end > size:
            break
        if opcode == Opcode.MESSAGE and length >= MESSAGE_BYTES:
            offsets[channel].append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            others.append((opcode, position + head_size, end))
        else:
            break
        position = end
    return offsets, others, position


def _read_summary(file: RecordFile) -> tuple[_Summary | None, bool]:
    """The summary, None where there is none that can be believed; and whether there is one for
    which nobody vouches, because it carries no checksum."""
    tail = file.read(file.size - _TAIL.size, _TAIL.size) if file.size >= _TAIL.size else b""
    if not tail.startswith(_FOOTER_HEAD) or not tail.endswith(MAGIC):
        return None, False
    _, start, _, crc, _ = _TAIL.unpack(tail)
    start = start or file.size - _TAIL.size
    if crc == 0 or start > file.size - _TAIL.size:
        return None, crc == 0
    data = file.read(start, file.size - len(MAGIC) - 4 - start)  # up to the checksum itself
    if zlib.crc32(data) != crc:
        return None, False
    return _Summary.of(start, data), False


def _content_again(file: BinaryIO, block: Block) -> bytes | None:
    """The content of a block that was not kept; None where it is not what it was."""
    body = RecordFile(file).read(block.start, block.length)
    if len(body) < block.length:
        return None
    if block.record is None:
        return body
    content = chunk_content(body)
    return None if content is None else content.data
