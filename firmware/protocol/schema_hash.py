# SPDX-License-Identifier: Apache-2.0
"""Load `board.yaml` and give its schema hash: the number by which board and host know each other.

Used by the header generator of the firmware and by the host driver, so that both compute the same
number from the same file. The hash is that of the file's meaning: `u24[channels]` is `u24[6]` for a
board of six channels.
"""

from __future__ import annotations

import hashlib
import json
import re
from functools import reduce
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

_COUNT_OF = re.compile(r"(\w+)\[([a-z_.]+)\]")


def load_board(path: Path | str) -> dict[str, Any]:
    """The parsed description of the board (plain dicts, lists, numbers, strings).

    An array with as many elements as a list of the file has, as in `u24[channels]` or
    `u24[self_test.accelerometer]`, has that number here.
    """
    board = YAML(typ="safe", pure=True).load(Path(path).read_text(encoding="utf-8"))
    counted: dict[str, Any] = _counted(board, board)
    return counted


def _counted(item: Any, board: dict[str, Any]) -> Any:
    """`item` of the board's file, with numbers in place of the lists that arrays name."""
    if isinstance(item, dict):
        return {key: _counted(value, board) for key, value in item.items()}
    if isinstance(item, list):
        return [_counted(value, board) for value in item]
    array = _COUNT_OF.fullmatch(item) if isinstance(item, str) else None
    if array is None:
        return item
    return f"{array[1]}[{len(reduce(lambda part, key: part[key], array[2].split('.'), board))}]"


def schema_hash(board: dict[str, Any]) -> int:
    """First four bytes, little-endian, of the SHA-256 of the canonical JSON of `board`."""
    canonical = json.dumps(board, sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(canonical.encode()).digest()[:4], "little")
