# SPDX-License-Identifier: Apache-2.0
"""Bags of text, and how disks spoil them."""

from __future__ import annotations

import shutil
from pathlib import Path

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
