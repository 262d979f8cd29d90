# SPDX-License-Identifier: Apache-2.0
"""Reads bags: whole ones, damaged ones as far as their checksums hold, and those of others.

Needs no ROS: message definitions come out of the bag itself.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Schema

from towtank_bag.bag_files import BagFiles, bag_files
from towtank_bag.bag_state import BagState, LostStretch, state_of
from towtank_bag.layout import BagError
from towtank_bag.mcap_scan import AttachedFile, MessageKey, NoMcapError, Scan, scan_file
from towtank_bag.message_reader import MessageForm, MessageReader

__all__ = ["Bag", "BagError", "LostStretch", "RawTopic", "TopicInfo", "open_bag"]


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a bag; type_name is `package/msg/Name`, empty where the bag does not tell."""

    name: str
    type_name: str
    count: int
    type_hash: str


@dataclass(frozen=True)
class RawTopic:
    """All messages of one topic as they were recorded, in the order of recording.

    log_time_ns, publish_time_ns: int64, shape (n,), ns since the epoch; payloads: CDR.
    """

    log_time_ns: np.ndarray
    publish_time_ns: np.ndarray
    payloads: list[bytes]


class Bag:
    """A bag directory, open for reading. Made by `open_bag`.

    topics: by name. attachments: by name, those that are intact or have no checksum.
    attached_files: all of them. metadata: of the recorder, by record name.
    """

    def __init__(self, directory: Path, scans: Sequence[Scan], state: BagState) -> None:
        self.directory = directory
        self._scans = scans
        self._state = state
        self.attached_files = _attached_files(scans)
        self.attachments = {
            name: file.data
            for name, file in self.attached_files.items()
            if file.intact is not False
        }
        self.metadata = {name: values for s in scans for name, values in s.metadata.items()}
        self._channels: dict[str, list[tuple[Scan, Channel]]] = defaultdict(list)
        for scan in scans:
            for channel in scan.channels.values():
                self._channels[channel.topic].append((scan, channel))
        self._readers: dict[str, MessageReader] = {}
        self.topics = {topic: self._topic_info(topic) for topic in self._channels}

    @property
    def complete(self) -> bool:
        """Whether the recording ended cleanly and nothing of it is damaged."""
        return self.problem is None

    @property
    def problem(self) -> str | None:
        """What is damaged or missing and what of the recording is lost by it, in one line; None
        for a whole bag."""
        return self._state.problem

    @property
    def notes(self) -> list[str]:
        """What else a user should know: files passed over, contents without a checksum."""
        return self._state.notes

    @property
    def lost(self) -> list[LostStretch]:
        """Stretches of the recording in which messages are lost, or may be."""
        return self._state.lost

    def raw(self, topic: str) -> RawTopic:
        """All messages of a topic, still serialised; none for a topic that is not in the bag."""
        channels: dict[int, set[int]] = defaultdict(set)
        for scan, channel in self._channels.get(topic, ()):
            channels[id(scan)].add(channel.id)
        parts = [s.messages(channels[id(s)]) for s in self._scans if id(s) in channels]
        if not parts:
            return RawTopic(np.empty(0, np.int64), np.empty(0, np.int64), [])
        log_times, publish_times = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        payloads = [payload for part in parts for payload in part[2]]
        if any(scan.repeated for scan in self._scans):  # what one copy lacks is in another
            order = np.argsort(log_times, kind="stable")
            log_times, publish_times = log_times[order], publish_times[order]
            payloads = [payloads[i] for i in order.tolist()]
        return RawTopic(log_times, publish_times, payloads)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """(log time in ns, decoded message) of a topic; fields are attributes as in ROS. None for a
        topic that is not in the bag."""
        raw = self.raw(topic)
        for log_time, payload in zip(raw.log_time_ns.tolist(), raw.payloads, strict=True):
            yield log_time, self._reader(topic).decode(payload)

    def has_field(self, topic: str, field: str) -> bool:
        """Whether the messages of a topic have a field; an older recording may lack it."""
        return self._has_messages(topic) and field in self._reader(topic).fields

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
        reader = self._reader(topic)
        stamped = "header" in reader.fields
        stamp_fields = ["header.stamp.sec", "header.stamp.nanosec"] if stamped else []
        columns = reader.columns(raw.payloads, [*fields, *stamp_fields])
        series = {name: columns[name] for name in fields}
        series["log_time_ns"] = raw.log_time_ns
        if stamped:
            seconds, nanoseconds = (columns[name].astype(np.int64) for name in stamp_fields)
            series["stamp_ns"] = seconds * 1_000_000_000 + nanoseconds
        return series

    def _topic_info(self, topic: str) -> TopicInfo:
        parts = self._channels[topic]
        scan, channel = parts[0]
        schema = scan.schemas.get(channel.schema_id)
        return TopicInfo(
            topic,
            schema.name if schema is not None else "",
            sum(scan.count_of(channel.id) for scan, channel in parts),
            channel.metadata.get("topic_type_hash", "") or self._state.type_hashes.get(topic, ""),
        )

    def _has_messages(self, topic: str) -> bool:
        return topic in self.topics and self.topics[topic].count > 0

    def _reader(self, topic: str) -> MessageReader:
        if topic not in self._readers:
            forms = {self._form(scan, channel) for scan, channel in self._channels[topic]}
            if len(forms) > 1:
                raise BagError(
                    f"{self.directory}: {topic}: there are messages of different types or "
                    "definitions on it; leave out the files that are of another recording"
                )
            self._readers[topic] = MessageReader(forms.pop())
        return self._readers[topic]

    def _form(self, scan: Scan, channel: Channel) -> MessageForm:
        schema = scan.schemas.get(channel.schema_id) or Schema(b"", "", 0, "")
        info = self.topics[channel.topic]
        return MessageForm(
            f"{self.directory}: {channel.topic}",
            schema.name or info.type_name,
            channel.message_encoding,
            schema.data,
            schema.encoding,
            info.type_hash,
        )


def open_bag(path: str | Path) -> Bag:
    """Open a bag directory and verify all that has a checksum in it.

    Raises BagError when it holds nothing that can be read.
    """
    directory = Path(path)
    try:
        if not directory.is_dir():
            what = "is a file" if directory.exists() else "no such bag"
            raise BagError(f"{directory}: {what}; give the directory that holds the .mcap file")
    except OSError as error:
        raise BagError(f"{directory}: cannot be read: {error.strerror}; check the path") from error
    files = bag_files(directory)
    scans, unreadable = _scan_all(files)
    if not files.listed:
        scans.sort(key=lambda scan: (scan.first_ns or 0, scan.path.name))
    for number, scan in enumerate(scans):
        _leave_out_repetitions(scan, scans[:number])
    return Bag(directory, scans, state_of(directory, files, scans, unreadable))


def _scan_all(files: BagFiles) -> tuple[list[Scan], list[Path]]:
    """Every file, and those that are no MCAP; raises BagError if all are."""
    scans, refused = [], {}
    for path in files.paths:
        try:
            scans.append(scan_file(path))
        except NoMcapError as error:
            refused[path] = error
    if not scans:
        raise next(iter(refused.values()))
    return scans, list(refused)


def _attached_files(scans: Sequence[Scan]) -> dict[str, AttachedFile]:
    """The attachments of all files; of one that several have, the first that is not damaged."""
    attached: dict[str, AttachedFile] = {}
    for scan in scans:
        for name, file in scan.attachments.items():
            if name not in attached or (attached[name].intact is False and file.intact):
                attached[name] = file
    return attached


def _leave_out_repetitions(scan: Scan, earlier: Sequence[Scan]) -> None:
    """Let messages count once that an earlier file holds too: copies lie beside their originals."""
    begin_ns, end_ns = scan.first_ns, scan.last_ns
    overlapping = [
        other
        for other in earlier
        if None not in (begin_ns, other.first_ns)
        and other.first_ns <= end_ns
        and other.last_ns >= begin_ns
    ]
    if not overlapping:
        return
    known: dict[str, set[MessageKey]] = defaultdict(set)
    for other in overlapping:
        for channel, keys in other.keys().items():
            known[other.channels[channel].topic].update(keys)
    scan.leave_out({id: known[channel.topic] for id, channel in scan.channels.items()})
