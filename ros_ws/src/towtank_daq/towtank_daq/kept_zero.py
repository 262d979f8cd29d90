# SPDX-License-Identifier: Apache-2.0
"""Where a sensor was zeroed, kept in a file for a process that is started again in the trial.

The process of acquisition may die under way. What its successor cannot ask the board for is where
the sensors were zeroed: without it a depth, an angle or a position would jump behind the gap.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any


class KeptZero:
    """The file of one sensor; `folder` '': nothing is kept. The folder is made when needed."""

    def __init__(self, folder: str, name: str) -> None:
        self._path = Path(folder) / name if folder else None

    def read(self) -> dict[str, Any] | None:
        """What was kept last; None if nothing was. OSError where it cannot be read."""
        if self._path is None:
            return None
        try:
            kept: dict[str, Any] = json.loads(self._path.read_text())
            return kept
        except FileNotFoundError:
            return None

    def write(self, values: dict[str, Any]) -> None:
        """Keep these in place of what was kept; OSError where that fails.

        It is there whole or not at all, whenever the process ends. It need not outlive the
        computer: nothing waits for the disk.
        """
        if self._path is None:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        new = self._path.with_suffix(".new")
        new.write_text(json.dumps(values))
        os.replace(new, self._path)
