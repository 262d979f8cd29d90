# SPDX-License-Identifier: Apache-2.0
"""Bags of text as disks spoil them and as other programs write them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer
from text_bag import RIG, TOPIC, text_message, wait_until
from towtank_bag.mcap_records import Record, RecordFile
from towtank_bag.writer import Attachment, BagWriter

PER_CHUNK = 100


def write_bag(
    directory: Path, chunks: int, attachments: tuple[Attachment, ...] = (RIG,), **metadata: str
) -> Path:
    """A bag of text messages 0, 1, 2, …, each the digits of its number; returns its file."""
    with BagWriter(directory, [TOPIC], attachments, {"towtank": metadata}) as writer:
        for chunk in range(chunks):
            numbers = range(PER_CHUNK * chunk, PER_CHUNK * (chunk + 1))
            writer.write([text_message(i, b"%d" % i) for i in numbers])
            wait_until(lambda: writer.messages == PER_CHUNK * (chunk + 1))  # noqa: B023
    return directory / f"{directory.name}_0.mcap"


def copy_bag(file: Path, parent: Path) -> Path:
    """A copy of a bag in another folder; returns the copy of its file."""
    return shutil.copytree(file.parent, parent / file.parent.name) / file.name


def records(path: Path) -> list[Record]:
    """The records of an undamaged file's data section."""
    with path.open("rb") as file:
        whole = RecordFile(file)
        found, position = [], 8
        while (record := whole.at(position)) is not None:
            found.append(record)
            position = record.end
    return found


def overwrite(path: Path, start: int, data: bytes) -> None:
    """Put other bytes in a place of a file."""
    whole = bytearray(path.read_bytes())
    whole[start : start + len(data)] = data
    path.write_bytes(whole)


def rewrite(
    source: Path,
    target: Path,
    *,
    attachments: bool = True,
    wanted: Callable[[int], bool] = lambda number: True,
    schema: Callable[[Any], tuple[str, bytes]] = lambda schema: (schema.encoding, schema.data),
    extra: Callable[[Writer], None] = lambda writer: None,
    **options: Any,
) -> Path:
    """The messages of a file as another program writes them; `wanted` by number, options: of
    mcap's Writer."""
    target.parent.mkdir(exist_ok=True)
    with source.open("rb") as file, target.open("wb") as out:
        reader = make_reader(file)
        writer = Writer(out, **options)
        writer.start(profile="ros2", library="other")
        for name, data in _attachments(reader) if attachments else ():
            writer.add_attachment(1, 1, name, "", data)
        schemas, channels = {}, {}
        for number, (its_schema, channel, message) in enumerate(reader.iter_messages()):
            if not wanted(number):
                continue
            if its_schema.id not in schemas:
                schemas[its_schema.id] = writer.register_schema(
                    its_schema.name, *schema(its_schema)
                )
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, "cdr", schemas[its_schema.id], channel.metadata
                )
            writer.add_message(
                channels[channel.id],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        extra(writer)
        writer.finish()
    return target


def _attachments(reader: Any) -> Iterator[tuple[str, bytes]]:
    return ((attachment.name, attachment.data) for attachment in reader.iter_attachments())
