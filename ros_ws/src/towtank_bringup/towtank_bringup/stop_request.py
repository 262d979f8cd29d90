# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, kill and a terminal that goes away, noticed at safe points only."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any


class Stopped(KeyboardInterrupt):
    """Somebody wants to stop. `status`: the exit status that shells know, 128 and the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.status = 128 + number


class StopRequest:
    """While it is entered, SIGINT, SIGTERM and SIGHUP are only noted; `check` raises Stopped.

    An exception straight out of a signal handler would break off calls into rclpy in the middle.
    SIGHUP stays ignored where it was, as `nohup` does.
    """

    def __init__(self) -> None:
        self._requested: int | None = None
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            self._previous[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._requested is None:
            self._requested = number

    def check(self) -> None:
        """Raise Stopped if the user wants to stop."""
        if self._requested is not None:
            raise Stopped(self._requested)
