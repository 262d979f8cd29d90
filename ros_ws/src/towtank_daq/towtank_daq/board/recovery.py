# SPDX-License-Identifier: Apache-2.0
"""Whether the stream of a run goes on, what keeps it from that, and how long that may last.

A run is in one state at a time:

    IDLE       no run
    STREAMING  scans are due
    DOWN       the board is there, but its stream must be started again
    LINE_GONE  the line is to be opened again
    REOPENED   it is, and the board has not been heard on it yet

DOWN has a reason. A line that goes while the stream is down keeps it: once the board is heard
again, it is started again; else it is looked at whether it has run on.
"""

from __future__ import annotations

import enum
from collections.abc import Callable

from towtank_daq.board.errors import BoardError, NoAnswer, Silence


class State(enum.Enum):
    """Of a run."""

    IDLE = "idle"
    STREAMING = "streaming"
    DOWN = "down"
    LINE_GONE = "line gone"
    REOPENED = "line opened again"


class Recovery:
    """The state of a run, and its patience: `patience_s` for line and board to come back, and as
    long for a board that is started again to bring a scan."""

    def __init__(
        self, patience_s: float, on_warning: Callable[[str], None], monotonic_ns: Callable[[], int]
    ) -> None:
        self.patience_ns = round(1e9 * patience_s)
        self._on_warning = on_warning
        self._now_ns = monotonic_ns
        self.state = State.IDLE
        self.why = ""
        """Why the stream must be started again, if it must."""
        self.resets_line = False
        """Whether a line that is gone is opened again with a pulse of DTR."""
        self._in_run = False
        self._lost_ns: int | None = None  # since when the run waits for line or board
        self._barren_ns: int | None = None  # since when it is started again without any scan

    # -- a run's beginning and end

    def begin_run(self) -> None:
        """start(): from here on scans are wanted."""
        self._in_run = True
        self._settle()

    def end_run(self) -> str:
        """No scans are wanted any more. Why there were none at the end, if so."""
        self._in_run = False
        why, self.why = self.why, ""
        self.state = State.IDLE
        return why

    def about_to_start(self) -> None:
        """The board is ready to: what ended its stream before is over."""
        self.why = ""

    def started(self) -> None:
        """The stream is on."""
        self.state, self.why = State.STREAMING, ""

    @property
    def in_run(self) -> bool:
        """Whether scans are wanted."""
        return self._in_run

    def _settle(self) -> None:
        self.state, self.why = State.IDLE, ""
        self._lost_ns = self._barren_ns = None

    # -- what happens

    def scan_came(self) -> None:
        """All is well."""
        self._lost_ns = self._barren_ns = None

    def stream_ended(self, why: str) -> None:
        """The board does not stream any more."""
        self.why = why
        if self.state in (State.IDLE, State.STREAMING):
            self.state = State.DOWN

    def failed(self, error: NoAnswer | OSError) -> None:
        """Note that line or board are gone; raises the error when that has lasted too long."""
        now_ns = self._now_ns()
        if isinstance(error, OSError | Silence):
            self.state = State.LINE_GONE
            self.resets_line = isinstance(error, Silence)
        else:
            self.stream_ended(str(error))
        if self._lost_ns is None:
            self._lost_ns = now_ns
            if self.patience_ns > 0:
                self._on_warning(f"{error}; waiting for it {self.patience_ns / 1e9:g} s")
        if now_ns - self._lost_ns >= self.patience_ns:
            self._lost_ns = None
            raise error

    def reopened(self) -> None:
        """The line is there again."""
        self.state = State.REOPENED

    def rejoined(self, ran_on: bool) -> None:
        """The board is heard on the line that was opened again."""
        if not self._in_run:
            self._settle()
            return
        self.state = State.STREAMING
        if self.why or not ran_on:
            self.stream_ended(self.why or "the line was gone")

    # -- patience

    @property
    def is_waiting(self) -> bool:
        """Whether the run waits for line or board."""
        return self._lost_ns is not None

    @property
    def is_impatient(self) -> bool:
        """Whether it has waited long enough."""
        return self._lost_ns is not None and self._now_ns() - self._lost_ns >= self.patience_ns

    def until_ns(self, end_ns: int) -> int:
        """How long may be waited for the line, at most to `end_ns`."""
        return end_ns if self._lost_ns is None else min(end_ns, self._lost_ns + self.patience_ns)

    def about_to_restart(self) -> None:
        """Tell of it. Raises BoardError for a board that is started again and again in vain."""
        if not self.is_waiting:  # else that has been said
            self._on_warning(
                f"{self.why}: starting it again; the gap counts as lost scans, and after a reset "
                "of the board crank and carriage must be zeroed again"
            )
        if self._barren_ns is not None and self._now_ns() - self._barren_ns >= self.patience_ns:
            raise BoardError(
                f"{self.why}, and no scan has come since it was started again: look at what else "
                "it tells of, or replace it"
            )

    def restarted(self) -> None:
        """The stream is on again; a scan is still to come."""
        if self._barren_ns is None:
            self._barren_ns = self._now_ns()
