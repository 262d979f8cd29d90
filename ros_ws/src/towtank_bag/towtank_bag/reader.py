# SPDX-License-Identifier: Apache-2.0
"""Reads bags: complete ones, and those whose recording broke off, as far as they go.

Needs no ROS: message definitions come out of the bag itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from towtank_bag.cdr import LayoutError, layout_of
from towtank_bag.layout import (
    METADATA_FILE,
    RECORDING_MARKER,
    RIG_ATTACHMENT,
    BagError,
)
from towtank_bag.mcap_scan import Scan, scan_file


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a bag; type_name is `package/msg/Name`."""

    name: str
    type_name: str
    count: int
    type_hash: str


@dataclass(frozen=True)
class RawTopic:
    """All messages of one topic as they were recorded, in the order of the file.

    log_time_ns, publish_time_ns: int64, shape (n,), ns since the epoch; payloads: CDR.
    """

    log_time_ns: np.ndarray
    publish_time_ns: np.ndarray
    payloads: list[bytes]


class Bag:
    """A bag directory, open for reading. Made by `open_bag`.

    topics: by name. complete: False when the recording broke off or chunks are damaged; `problem`
    then says what is known. attachments: by name. metadata: of the recorder, by record name.
    """

    def __init__(self, directory: Path, scans: Sequence[Scan], problem: str | None) -> None:
        self.directory = directory
        self._scans = scans
        self._problem = problem
        self.attachments = {name: data for s in scans for name, data in s.attachments.items()}
        self.metadata = {name: values for s in scans for name, values in s.metadata.items()}
        self._channels: dict[str, list[tuple[Scan, int]]] = {}
        self._schema_texts: dict[str, str] = {}
        self.topics: dict[str, TopicInfo] = {}
        for scan in scans:
            for channel in scan.channels.values():
                schema = scan.schemas[channel.schema_id]
                self._schema_texts[schema.name] = schema.data.decode()
                self._channels.setdefault(channel.topic, []).append((scan, channel.id))
                before = self.topics.get(channel.topic)
                count = sum(len(chunk.offsets.get(channel.id, ())) for chunk in scan.chunks)
                self.topics[channel.topic] = TopicInfo(
                    channel.topic,
                    schema.name,
                    count + (before.count if before else 0),
                    channel.metadata.get("topic_type_hash", ""),
                )
        self._typestore = get_typestore(Stores.EMPTY)
        self._registered: set[str] = set()

    @property
    def complete(self) -> bool:
        """Whether the recording ended cleanly and everything read so far was undamaged."""
        return self.problem is None

    @property
    def problem(self) -> str | None:
        """What is wrong with the bag, or None."""
        damaged = sum(scan.damaged_chunks for scan in self._scans)
        if damaged:
            return f"{self.directory}: {damaged} damaged chunks are left out"
        return self._problem

    @property
    def rig_text(self) -> str:
        """The rig file that the bag was recorded with; raises BagError where there is none."""
        try:
            return self.attachments[RIG_ATTACHMENT].decode()
        except KeyError:
            raise BagError(
                f"{self.directory}: the bag holds no rig file; record with towtank"
            ) from None

    def raw(self, topic: str) -> RawTopic:
        """All messages of a topic, still serialised; none for a topic that is not in the bag."""
        parts = [scan.channel_messages(channel) for scan, channel in self._channels.get(topic, [])]
        if not parts:
            return RawTopic(np.empty(0, np.int64), np.empty(0, np.int64), [])
        return RawTopic(
            np.concatenate([part[0] for part in parts]),
            np.concatenate([part[1] for part in parts]),
            [payload for part in parts for payload in part[2]],
        )

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """(log time in ns, decoded message) of a topic; fields are attributes as in ROS."""
        raw = self.raw(topic)
        for log_time, payload in zip(raw.log_time_ns.tolist(), raw.payloads, strict=True):
            yield log_time, self._decode(topic, payload)

    def has_field(self, topic: str, field: str) -> bool:
        """Whether the messages of a topic have a field; an older recording may lack it."""
        if topic not in self.topics:
            return False
        type_name = self.topics[topic].type_name
        self._register(type_name)
        return any(name == field for name, _ in self._typestore.fielddefs[type_name][1])

    def series(self, topic: str, fields: Sequence[str]) -> dict[str, np.ndarray]:
        """Fields of all messages of a topic as arrays, by dotted path (`pose.pose.position.z`).

        Each array has shape (n,), or (n, k) for an array field. With them come `log_time_ns` and,
        for messages with a header, `stamp_ns`: int64, ns since the epoch. A topic that is not in
        the bag gives arrays of length 0. Raises BagError for a field that the message lacks.
        """
        raw = self.raw(topic)
        if not raw.payloads:
            return {name: np.empty(0) for name in fields} | {
                "log_time_ns": raw.log_time_ns,
                "stamp_ns": np.empty(0, np.int64),
            }
        type_name = self.topics[topic].type_name
        self._register(type_name)
        stamped = any(name == "header" for name, _ in self._typestore.fielddefs[type_name][1])
        stamp_fields = ["header.stamp.sec", "header.stamp.nanosec"] if stamped else []
        columns = self._columns(topic, raw.payloads, [*fields, *stamp_fields])
        series = {name: columns[name] for name in fields}
        series["log_time_ns"] = raw.log_time_ns
        if stamped:
            seconds, nanoseconds = (columns[name].astype(np.int64) for name in stamp_fields)
            series["stamp_ns"] = seconds * 1_000_000_000 + nanoseconds
        return series

    def _columns(
        self, topic: str, payloads: list[bytes], fields: Sequence[str]
    ) -> dict[str, np.ndarray]:
        type_name = self.topics[topic].type_name
        try:
            table = layout_of(payloads[0], type_name, self._typestore.fielddefs).table(payloads)
            return {name: table.column(name) for name in fields}
        except LayoutError:
            messages = [self._decode(topic, payload) for payload in payloads]
        except KeyError as error:
            raise BagError(f"{topic}: {type_name} has no field {error}") from error
        try:
            return {name: _stack([_attribute(m, name) for m in messages]) for name in fields}
        except AttributeError as error:
            raise BagError(f"{topic}: {type_name} has no field '{error.name}'") from error

    def _decode(self, topic: str, payload: bytes) -> Any:
        type_name = self.topics[topic].type_name
        self._register(type_name)
        definition = self._typestore.get_msgdef(type_name)
        # Not Typestore.deserialize_cdr: it refuses the bytes that Fast CDR leaves behind a message
        # that ends in an empty sequence of doubles, as a JointState without efforts does.
        little_endian = payload[1] == 1
        decode = definition.deserialize_cdr_le if little_endian else definition.deserialize_cdr_be
        message, _ = decode(payload[4:], 0, definition.cls, self._typestore)
        return message

    def _register(self, type_name: str) -> None:
        if type_name not in self._registered:
            self._typestore.register(get_types_from_msg(self._schema_texts[type_name], type_name))
            self._registered.add(type_name)


def open_bag(path: str | Path) -> Bag:
    """Open a bag directory. Raises BagError when it holds nothing that can be read."""
    directory = Path(path)
    if not directory.is_dir():
        raise BagError(f"{directory}: no such bag; give the directory that holds the .mcap file")
    files = sorted(directory.glob("*.mcap"))
    if not files:
        raise BagError(f"{directory}: holds no .mcap file; give the bag's own directory")
    scans = [scan_file(file) for file in files]
    problem = None
    if (directory / RECORDING_MARKER).exists() or not all(scan.end_seen for scan in scans):
        problem = f"{directory}: the recording broke off; the bag is read as far as it goes"
    elif not (directory / METADATA_FILE).exists():
        problem = f"{directory}: {METADATA_FILE} is missing; the recording did not end cleanly"
    return Bag(directory, scans, problem)


def _attribute(message: Any, path: str) -> Any:
    for name in path.replace("]", "").replace("[", ".").split("."):
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    return message


def _stack(values: list[Any]) -> np.ndarray:
    """One array of all values; of objects where arrays differ in length."""
    if isinstance(values[0], (int, float, bool)):
        return np.array(values)
    return np.fromiter(values, dtype=object, count=len(values))
