# SPDX-License-Identifier: Apache-2.0
"""Writes a bag: an MCAP file and metadata.yaml in one directory, as rosbag2 lays it out.

A background thread compresses and writes, fed by a bounded queue. Every `FLUSH_PERIOD_S` it
finishes the chunk and forces it to the disk: a process that is killed loses no more than that, and
neither does a power cut, but for the time that the disk takes. While a bag is being written its
directory holds the file RECORDING and no metadata.yaml; both change only at a clean end.

The directory may be renamed meanwhile; the bag is finished where it then is. One that is removed
ends the recording.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer
from ruamel.yaml import YAML
from towtank_node.topics import Topic

from towtank_bag.definitions import message_definition
from towtank_bag.held_directory import HeldDirectory, make_directory
from towtank_bag.layout import METADATA_FILE, RECORDING_MARKER, BagError
from towtank_bag.qos_profile import offered_profile

CHUNK_BYTES = 256 * 1024
FLUSH_PERIOD_S = 0.4
"""With the recorder's own tenth of a second: half a second at most, and as much again for the disk
to take it. For what it costs see README.md."""

QUEUE_MESSAGES = 50_000
"""Half a minute of a whole trial's messages: a disk may stall that long before any is lost."""


@dataclass(frozen=True)
class Attachment:
    """A file inside the bag."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True)
class RawMessage:
    """One serialised message. `topic` is its index in the writer's list of topics.

    Times are ns since the epoch: reception by the recorder, and publication.
    """

    topic: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


class BagWriter:
    """Records serialised messages into a new bag directory.

    directory: must not exist; it is created with its parents.
    topics: the channels of the bag, all registered at once.
    attachments, metadata: written first, so that a cut bag holds them too.

    Raises BagError where the directory exists or cannot be made, and from `write` and `close` once
    the disk has failed. Counters: `messages` (in finished chunks), `overflowed` (refused because
    the queue was full), `queue_high_water`, `bytes_written`.
    """

    def __init__(
        self,
        directory: str | Path,
        topics: Sequence[Topic],
        attachments: Iterable[Attachment] = (),
        metadata: Mapping[str, Mapping[str, str]] | None = None,
        queue_messages: int = QUEUE_MESSAGES,
    ) -> None:
        self._topics = list(topics)
        self._definitions = [message_definition(topic.type_name) for topic in self._topics]
        self._queue_messages = queue_messages
        self._pending: list[RawMessage] = []
        self._wake = threading.Condition()
        self._closing = False
        self._closed = False
        self._error: BagError | None = None
        self._drained = False
        self._counts = [0] * len(self._topics)
        self._flushed_messages = 0
        self._first_ns: int | None = None
        self._last_ns = 0
        self.overflowed = 0
        self.queue_high_water = 0

        self._directory, self._file = _make_bag(Path(directory))
        self._mcap = Writer(
            self._file,
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_data_crcs=True,  # the only witness of what stands outside of chunks
        )
        try:
            self._begin(attachments, metadata or {})
        except OSError as error:
            self._fail(error)
            self._close_files()
            raise self._error from error
        self._thread = threading.Thread(target=self._run, name="bag-writer", daemon=True)
        self._thread.start()

    @property
    def directory(self) -> Path:
        """Where the bag is now."""
        return self._directory.path

    @property
    def error(self) -> BagError | None:
        """Why the writing stopped, or None."""
        return self._error

    @property
    def messages(self) -> int:
        """Messages in chunks that are on the disk, which outlive this process and a power cut."""
        return self._flushed_messages

    @property
    def bytes_written(self) -> int:
        """Length of the MCAP file so far."""
        return self._file.tell()

    def write(self, messages: Sequence[RawMessage]) -> None:
        """Queue messages. What exceeds the queue is dropped and counted in `overflowed`."""
        with self._wake:
            if self._error is not None:
                raise self._error
            if self._closing:
                raise BagError(f"{self.directory}: the bag is closed")
            room = self._queue_messages - len(self._pending)
            self._pending.extend(messages[:room])
            self.overflowed += max(0, len(messages) - room)
            self.queue_high_water = max(self.queue_high_water, len(self._pending))

    def close(self) -> None:
        """Write what is queued, finish the file and mark the bag complete. Idempotent.

        Raises BagError when the disk failed; then the bag stays marked as incomplete.
        """
        with self._wake:
            self._closing = True
            self._wake.notify()
        self._thread.join()
        if self._closed:
            return
        self._closed = True
        if self._drained:
            try:
                self._finish()
            except OSError as error:
                self._fail(error)
        self._close_files()
        if self._error is not None:
            raise self._error

    def _close_files(self) -> None:
        with contextlib.suppress(OSError):  # what it might tell has been told
            self._file.close()
        self._directory.close()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _begin(
        self, attachments: Iterable[Attachment], metadata: Mapping[str, Mapping[str, str]]
    ) -> None:
        self._mcap.start(profile="ros2", library="towtank")
        now = time.time_ns()
        for attachment in attachments:
            self._mcap.add_attachment(
                now, now, attachment.name, attachment.media_type, attachment.data
            )
        for name, values in metadata.items():
            self._mcap.add_metadata(name, dict(values))
        schemas: dict[str, int] = {}
        self._channels = []
        for topic, definition in zip(self._topics, self._definitions, strict=True):
            if definition.name not in schemas:
                schemas[definition.name] = self._mcap.register_schema(
                    definition.name, "ros2msg", definition.text.encode()
                )
            self._channels.append(
                self._mcap.register_channel(
                    topic.name,
                    "cdr",
                    schemas[definition.name],
                    {
                        # JSON is YAML, in which rosbag2 reads it
                        "offered_qos_profiles": json.dumps([offered_profile(topic.qos)]),
                        "topic_type_hash": definition.type_hash,
                    },
                )
            )
        self._flush()

    def _run(self) -> None:
        try:
            while self._error is None:
                with self._wake:
                    if not self._closing:
                        self._wake.wait(FLUSH_PERIOD_S)
                    batch, self._pending = self._pending, []
                    closing = self._closing
                for message in batch:
                    self._add(message)
                self._flush()
                if closing:
                    self._drained = True
                    return
        except OSError as error:
            self._fail(error)
        except Exception as error:
            self._error = BagError(
                f"{self.directory}: the recording stopped at a fault of the writer ({error!r}) and "
                "stays marked incomplete: report it with the recorder's log"
            )
            raise

    def _add(self, message: RawMessage) -> None:
        self._mcap.add_message(
            self._channels[message.topic],
            message.log_time_ns,
            message.data,
            message.publish_time_ns,
            self._counts[message.topic],
        )
        self._counts[message.topic] += 1
        if self._first_ns is None or message.log_time_ns < self._first_ns:
            self._first_ns = message.log_time_ns
        self._last_ns = max(self._last_ns, message.log_time_ns)

    def _flush(self) -> None:
        self._mcap.flush()
        self._file.mark_whole()
        self._file.sync()
        self._flushed_messages = sum(self._counts)

    def _finish(self) -> None:
        self._mcap.finish()
        self._file.sync()
        self._file.close()
        self._directory.write(METADATA_FILE, _metadata_yaml(self._information()))
        self._directory.remove(RECORDING_MARKER)

    def _fail(self, error: OSError) -> None:
        """Keep what was written whole, and the marker, and say why."""
        with contextlib.suppress(OSError):  # a disk that fails need not be able to do this
            self._file.cut_to_whole()
        self._error = BagError(
            f"{self.directory / self._file.name}: cannot write: {error.strerror}; the recording "
            f"stopped there and stays marked incomplete: {_mend(error)}"
        )

    def _information(self) -> dict[str, Any]:
        """Content of metadata.yaml, version 9."""
        start = {"nanoseconds_since_epoch": self._first_ns or 0}
        duration = {"nanoseconds": self._last_ns - (self._first_ns or 0)}
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": self.messages,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type_name,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": [offered_profile(topic.qos)],
                        "type_description_hash": definition.type_hash,
                    },
                    "message_count": count,
                }
                for topic, definition, count in zip(
                    self._topics, self._definitions, self._counts, strict=True
                )
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self._file.name],
            "files": [
                {
                    "path": self._file.name,
                    "starting_time": start,
                    "duration": duration,
                    "message_count": self.messages,
                }
            ],
            "custom_data": None,
            "ros_distro": "jazzy",
        }


class _UnbufferedFile:
    """A new file that hands each write to the kernel whole, and can be cut back to the last point
    at which its content was whole. A buffer of Python's own would go on trying to write after the
    disk has filled."""

    def __init__(self, name: str, directory: HeldDirectory) -> None:
        self.name = name
        self._descriptor = directory.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL)
        self._position = 0
        self._whole = 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        while rest:
            count = os.write(self._descriptor, rest)
            self._position += count
            rest = rest[count:]
        return len(data)

    def tell(self) -> int:
        return self._position

    def flush(self) -> None:
        """Nothing is held back."""

    def sync(self) -> None:
        """Force what is written to the disk. FileNotFoundError where the file has been removed:
        what is written into it then is lost."""
        os.fdatasync(self._descriptor)
        if os.fstat(self._descriptor).st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, "somebody has removed it")

    def mark_whole(self) -> None:
        self._whole = self._position

    def cut_to_whole(self) -> None:
        os.ftruncate(self._descriptor, self._whole)

    def close(self) -> None:
        """Let it go; OSError where the disk tells only now that it has not written."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


def _make_bag(directory: Path) -> tuple[HeldDirectory, _UnbufferedFile]:
    """The new directory with its marker, and the MCAP file in it."""
    try:
        held = make_directory(directory)
        held.write(
            RECORDING_MARKER,
            "This bag is being recorded, or its recording broke off. What it holds can be read.\n",
        )
        file = _UnbufferedFile(f"{directory.name}_0.mcap", held)
        held.sync()
    except FileExistsError as error:
        raise BagError(
            f"{directory}: exists already and is not overwritten; give another directory"
        ) from error
    except OSError as error:
        raise BagError(
            f"{directory}: cannot make the bag: {error.strerror}; give a directory on a disk that "
            f"can be written and has space"
        ) from error
    return held, file


def _mend(error: OSError) -> str:
    """What the user can do about it."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return "free space and record again"
    if error.errno == errno.ENOENT:
        return "leave the directory alone and record again"
    return "copy what is there, look at the disk, and record again on another one"


def _metadata_yaml(information: dict[str, Any]) -> str:
    yaml = YAML(typ="safe")
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda data: True  # rosbag2's reader knows no anchors
    text = StringIO()
    yaml.dump({"rosbag2_bagfile_information": information}, text)
    return text.getvalue()
