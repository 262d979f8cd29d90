# SPDX-License-Identifier: Apache-2.0
"""A bag as another program writes it; for the tests of all packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer


def rewrite(
    source: Path,
    target: Path,
    *,
    attachments: bool = True,
    wanted: Callable[[int], bool] = lambda number: True,
    schema: Callable[[Any], tuple[str, bytes]] = lambda schema: (schema.encoding, schema.data),
    extra: Callable[[Writer, dict[str, int]], None] = lambda writer, channels: None,
    **options: Any,
) -> Path:
    """The messages of a file as another program writes them; `wanted` by number, `extra`
    is given the writer and the channels by topic; options: of mcap's Writer."""
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
            if channel.topic not in channels:
                channels[channel.topic] = writer.register_channel(
                    channel.topic, "cdr", schemas[its_schema.id], channel.metadata
                )
            writer.add_message(
                channels[channel.topic],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        extra(writer, channels)
        writer.finish()
    return target


def _attachments(reader: Any) -> Iterator[tuple[str, bytes]]:
    return ((attachment.name, attachment.data) for attachment in reader.iter_attachments())
