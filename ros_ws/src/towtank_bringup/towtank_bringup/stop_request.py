# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, kill and a terminal that goes away: noticed at safe points only, or at once as Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any


class Stopped(KeyboardInterrupt):
    """Somebody wants to stop. `status`: the exit status that shells know, 128 and the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.status = 128 + number


_Handler = Callable[[int, FrameType | None], None]


class StopRequest:
    """While it is entered, SIGINT, SIGTERM and SIGHUP are only noted; `check` raises Stopped.

    An exception straight out of a signal handler would break off calls into rclpy in the middle.
    SIGHUP stays ignored where it was, as `nohup` does.
    """

    def __init__(self) -> None:
        self._requested: int | None = None
        self._handled = _handled(self._note, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __enter__(self) -> StopRequest:
        self._handled.__enter__()
        return self

    def __exit__(self, *exception: Any) -> None:
        self._handled.__exit__(*exception)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._requested is None:
            self._requested = number

    def check(self) -> None:
        """Raise Stopped if the user wants to stop."""
        if self._requested is not None:
            raise Stopped(self._requested)


@contextlib.contextmanager
def stopping_at_once() -> Iterator[None]:
    """Meanwhile SIGTERM and SIGHUP raise Stopped as Ctrl-C raises KeyboardInterrupt, so that what
    was begun is put away. The first one counts: a terminal that goes sends several."""

    def stop(number: int, frame: FrameType | None) -> None:
        for each in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(each, signal.SIG_IGN)
        raise Stopped(number)

    with _handled(stop, signal.SIGTERM, signal.SIGHUP):
        yield


@contextlib.contextmanager
def _handled(handler: _Handler, *numbers: signal.Signals) -> Iterator[None]:
    """Signals go to the handler meanwhile; SIGHUP does not where it is ignored."""
    taken = [n for n in numbers if n != signal.SIGHUP or signal.getsignal(n) != signal.SIG_IGN]
    previous = {number: signal.signal(number, handler) for number in taken}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)
