# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and kill, noticed at safe points only."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any


class StopRequest:
    """While it is entered, SIGINT and SIGTERM are only noted; `check` raises KeyboardInterrupt.

    An exception straight out of a signal handler would break off calls into rclpy in the middle.
    """

    def __init__(self) -> None:
        self._requested = False
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._requested = True

    def check(self) -> None:
        """Raise KeyboardInterrupt if the user wants to stop."""
        if self._requested:
            raise KeyboardInterrupt
