# SPDX-License-Identifier: Apache-2.0
"""Load `board.yaml` and give its schema hash: the number by which board and host know each other.

Used by the header generator of the firmware and by the host driver, so that both compute the same
number from the same file.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML


def load_board(path: Path | str) -> dict[str, Any]:
    """The parsed description of the board (plain dicts, lists, numbers, strings)."""
    return YAML(typ="safe", pure=True).load(Path(path).read_text(encoding="utf-8"))


def schema_hash(board: dict[str, Any]) -> int:
    """First four bytes, little-endian, of the SHA-256 of the canonical JSON of `board`."""
    canonical = json.dumps(board, sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(canonical.encode()).digest()[:4], "little")
