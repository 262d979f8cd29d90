# SPDX-License-Identifier: Apache-2.0
"""Which files of a directory are the bag's, and in what order they were recorded."""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from towtank_bag.layout import METADATA_FILE, BagError

_OTHER_FORMS = {
    ".db3": "a bag in SQLite; convert it: rosbags-convert --src {0} --dst {0}_mcap "
    "--dst-storage mcap",
    ".mcap.zstd": "a bag whose files are compressed; expand them: zstd -d {0}/*.zstd",
}


@dataclass(frozen=True)
class BagFiles:
    """The MCAP files of a bag.

    listed: whether metadata.yaml gives their order. missing: names that metadata.yaml gives and
    that are not there. message_count: as metadata.yaml counted, None where it does not say.
    type_hashes: by topic, from metadata.yaml. notes: what was passed over, for the user.
    """

    paths: list[Path]
    listed: bool
    missing: list[str]
    message_count: int | None
    type_hashes: dict[str, str]
    notes: list[str]


def bag_files(directory: Path) -> BagFiles:
    """The files of a bag directory; raises BagError where there are none or they cannot be read.

    What metadata.yaml does not list is not of the bag. Files that metadata.yaml does not put in
    order come in that of their names; the reader knows better when it has seen inside.
    """
    try:
        names = sorted(name for name in os.listdir(directory) if not name.startswith("."))
        present = [directory / name for name in names if name.endswith(".mcap")]
        folders = [path for path in present if path.is_dir()]
        sizes = {path: path.stat().st_size for path in present if path.exists()}
        text = _content(directory / METADATA_FILE)
    except OSError as error:
        raise BagError(
            f"{error.filename or directory}: cannot be read: {error.strerror}; make it readable"
        ) from error
    present = [path for path in present if path not in folders]
    if not present:
        raise BagError(f"{directory}: {_why_none(directory, names, folders)}")
    notes = [f"{path.name} is a folder and was passed over" for path in folders]
    information = {} if text is None else _information(text)
    if information is None:
        notes.append(f"{METADATA_FILE} is damaged and was not used")
        information = {}
    if str(information.get("compression_mode", "")).upper() == "MESSAGE":
        raise BagError(
            f"{directory}: its messages are compressed one by one, which is not read; expand them "
            "with ros2 bag convert"
        )
    listed = _listed_names(information)
    if information and not listed:
        notes.append(f"{METADATA_FILE} is damaged: it lists no file")
    missing = [name for name in listed if name not in {path.name for path in present}]
    if listed and not missing:
        notes += [
            f"{path.name} is not of the bag by its {METADATA_FILE} and was passed over"
            for path in present
            if path.name not in listed
        ]
        present = [directory / name for name in listed]
    empty = [path for path in present if sizes.get(path) == 0]
    if len(empty) == len(present):
        raise BagError(
            f"{empty[0]}: the file is empty: nothing was recorded, or nothing reached the disk"
        )
    notes += [f"{path.name} is empty and was passed over" for path in empty]
    return BagFiles(
        [path for path in present if path not in empty],
        bool(listed) and not missing,
        missing,
        _count(information),
        _type_hashes(information),
        notes,
    )


def _why_none(directory: Path, names: list[str], folders: list[Path]) -> str:
    if folders:
        return f"holds no .mcap file, but a folder {folders[0].name}; give that if it is the bag"
    for ending, form in _OTHER_FORMS.items():
        if any(name.endswith(ending) for name in names):
            return f"holds no .mcap file, but {form.format(directory)}"
    if "bag" in names:
        return f"holds no .mcap file, but a trial's bag; give {directory / 'bag'}"
    return "holds no .mcap file; give the bag's own directory"


def _content(path: Path) -> bytes | None:
    """Content of a file, empty where the disk cannot give it; None where there is no such file."""
    try:
        return path.read_bytes() if path.is_file() else None
    except OSError as error:
        if error.errno != errno.EIO:
            raise
        return b""


def _information(text: bytes) -> dict[str, Any] | None:
    """Content of metadata.yaml; None where it cannot be understood."""
    try:
        content = YAML(typ="safe").load(text.decode())
    except (YAMLError, ValueError, RecursionError):
        return None
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    return information if isinstance(information, dict) else None


def _listed_names(information: dict[str, Any]) -> list[str]:
    paths = information.get("relative_file_paths")
    names = [PurePosixPath(str(path)).name for path in paths] if isinstance(paths, list) else []
    return list(dict.fromkeys(names))


def _count(information: dict[str, Any]) -> int | None:
    count = information.get("message_count")
    return count if isinstance(count, int) else None


def _type_hashes(information: dict[str, Any]) -> dict[str, str]:
    hashes = {}
    entries = information.get("topics_with_message_count")
    for entry in entries if isinstance(entries, list) else ():
        topic = entry.get("topic_metadata") if isinstance(entry, dict) else None
        if isinstance(topic, dict):
            hashes[str(topic.get("name"))] = str(topic.get("type_description_hash", ""))
    return hashes
