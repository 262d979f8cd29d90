# SPDX-License-Identifier: Apache-2.0
"""Message definitions and type hashes, from the share folders of the interface packages."""

from __future__ import annotations

import json
import os
import re
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

_SEPARATOR = "=" * 80
_PRIMITIVES = frozenset(
    ["bool", "byte", "char", "string", "wstring", "float32", "float64"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)
# A field or constant: a type, perhaps bounded (string<=8) or an array, then a name.
_FIELD = re.compile(r"^\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*")


class DefinitionError(ValueError):
    """The definition of a message type was not found."""


@dataclass(frozen=True)
class MessageDefinition:
    """One message type as a bag embeds it.

    name: `package/msg/Name`.
    text: the .msg text followed by those of all types that it uses (encoding `ros2msg`).
    type_hash: RIHS01 hash (REP-2011).
    """

    name: str
    text: str
    type_hash: str


@lru_cache
def message_definition(name: str) -> MessageDefinition:
    """Definition of the message type `package/msg/Name`; raises DefinitionError."""
    texts: dict[str, str] = {}
    pending = [name]
    while pending:
        current = pending.pop(0)
        if current not in texts:
            texts[current] = _interface_file(current, ".msg").read_text(encoding="utf-8")
            pending += _used_types(texts[current], package=current.split("/")[0])
    parts = [texts.pop(name).rstrip("\n") + "\n"]
    for used, text in texts.items():
        package, _, short = used.split("/")
        parts.append(f"{_SEPARATOR}\nMSG: {package}/{short}\n{text.rstrip()}\n")
    return MessageDefinition(name, "".join(parts), _type_hash(name))


def _used_types(text: str, package: str) -> list[str]:
    """Full names of the message types that a definition names in its fields."""
    used = []
    for line in text.splitlines():
        field = _FIELD.match(line.split("#")[0])
        if field is None or field["type"] in _PRIMITIVES:
            continue
        parts = field["type"].split("/")
        if parts == ["Header"]:
            parts = ["std_msgs", "Header"]
        used.append(f"{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}")
    return used


def _type_hash(name: str) -> str:
    description = json.loads(_interface_file(name, ".json").read_text(encoding="utf-8"))
    for entry in description["type_hashes"]:
        if entry["type_name"] == name:
            return str(entry["hash_string"])
    raise DefinitionError(f"{name}: its .json holds no type hash; rebuild the interface package")


def _interface_file(name: str, suffix: str) -> Path:
    try:
        package, kind, short = name.split("/")
    except ValueError:
        raise DefinitionError(
            f"'{name}' is no message type: write it as package/msg/Name"
        ) from None
    for prefix in _prefixes():
        path = prefix / "share" / package / kind / f"{short}{suffix}"
        if path.is_file():
            return path
    raise DefinitionError(
        f"{name}: no definition found; install or build {package} and source its local_setup"
    )


def _prefixes() -> list[Path]:
    """Where packages are installed: the ament prefixes, then the Python environment, into which
    pip puts the share folders of the standard interface packages."""
    prefixes = [Path(p) for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    return [*prefixes, Path(sys.prefix)]
