# SPDX-License-Identifier: Apache-2.0
"""What the host wants of the crank's drive, and how it keeps the board told.

Requests come from any thread; the one thread that uses the driver serves them between its scans.
The board is told four times a second to keep on, so that it stops the crank by itself when this
program dies; the word for that starts no crank. What could have changed behind the host's back, a
reset of the board, a line that was gone, a trip, ends the wish for a speed: the crank never starts
by itself. A trip that a reset of the board made it forget must be cleared all the same, and a board
with which the crank was driven is told of its encoder again, so that it tells of a crank that turns
on without it.
"""

from __future__ import annotations

import contextlib
import math
import queue
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from towtank_daq.board import TRIP_ADVICE, AdcBoard, BoardError, DriveState, NoAnswer

RPM = 2.0 * math.pi / 60.0
"""One revolution per minute, rad/s."""
_REPEAT_S = 0.25


@dataclass(frozen=True)
class _Request:
    action: str
    rate: float
    done: Future[None] = field(default_factory=Future)


class CrankDrive:
    """The drive of one board.

    counts_per_revolution: of the crank's encoder, negative where its count falls while the crank
    turns forward. on_dropped: called, by the serving thread, with a line that says why the crank is
    no longer driven.
    """

    def __init__(
        self,
        counts_per_revolution: int,
        on_dropped: Callable[[str], None],
        monotonic_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._counts = counts_per_revolution
        self._on_dropped = on_dropped
        self._now_s = monotonic_s
        self._requests: queue.SimpleQueue[_Request] = queue.SimpleQueue()
        self._wanted = False
        self._asked_s = -math.inf
        self._interruptions: tuple[int, int] | None = None  # when the board was told of the encoder
        self._told: DriveState | None = None
        self.trip = "none"
        """That the board has told and nobody has cleared, by its name in board.yaml."""

    def ask(self, action: str, rate: float = 0.0) -> Future[None]:
        """Ask for an action of board.yaml's `drive_action`; `rate` in rad/s is for `run`.

        The future is done once the board has agreed, or holds the BoardError or OSError.
        """
        request = _Request(action, rate)
        self._requests.put(request)
        return request.done

    def take_back(self, asked: Future[None]) -> None:
        """Take a `run` back; one that is on its way to the board already is followed by a stop."""
        if not asked.cancel():
            self.ask("stop")

    def serve(self, board: AdcBoard) -> None:
        """Tell the board what is due. To be called often, by the thread that uses the driver."""
        self._note_trip(board)
        self._note_interruption(board)
        while True:
            try:
                request = self._requests.get_nowait()
            except queue.Empty:
                break
            self._carry_out(request, board)
        if self._wanted and self._now_s() - self._asked_s >= _REPEAT_S:
            try:
                board.drive("keep")
                self._asked_s = self._now_s()
            except (BoardError, OSError) as error:
                self._drop(str(error))

    def refuse(self, why: str) -> None:
        """Answer all that wait with BoardError, and forget the crank: there is no board to ask."""
        self._wanted = False
        while True:
            try:
                request = self._requests.get_nowait()
            except queue.Empty:
                return
            if request.done.set_running_or_notify_cancel():
                request.done.set_exception(BoardError(why))

    def release(self, board: AdcBoard) -> None:
        """Stop a crank that this host drives, softly: the driver is about to be given up.

        To be called before refuse(), which forgets the crank: it would run on until the board trips
        for want of a word.
        """
        if not self._wanted:
            return
        self._wanted = False
        try:
            board.drive("stop")
        except (BoardError, OSError) as error:
            self._drop(str(error))

    def _carry_out(self, request: _Request, board: AdcBoard) -> None:
        if not request.done.set_running_or_notify_cancel():
            return
        try:
            if request.action == "run":
                self._run(board, request.rate / RPM)
            else:
                self._wanted = False
                board.drive(request.action)
                if request.action == "clear_trip":
                    self.trip, self._told = "none", board.drive_state  # which still has it
        except (BoardError, OSError) as error:
            if request.action == "run" and isinstance(error, (NoAnswer, OSError)):
                self._stop_what_may_have_started(board)
            request.done.set_exception(error)
        except Exception as error:
            # A fault of the program, which its thread tells. What the answer was nobody knows.
            request.done.set_exception(error)
            if request.action == "run":
                self._stop_what_may_have_started(board)
            raise
        else:
            request.done.set_result(None)

    def _stop_what_may_have_started(self, board: AdcBoard) -> None:
        """After a `run` without an answer: it may have come, and only the answer was lost."""
        self._wanted = False
        with contextlib.suppress(BoardError, OSError):  # the board stops for want of a word, too
            board.drive("stop")

    def _note_trip(self, board: AdcBoard) -> None:
        """Note a trip when it is told, not again from the same word once it is cleared."""
        state = board.drive_state
        if state is not None and state is not self._told and state.trip != "none":
            self.trip = state.trip
        self._told = state

    def _run(self, board: AdcBoard, rpm: float) -> None:
        state = board.drive_state
        if self.trip != "none" and (state is None or state.trip == "none"):
            raise BoardError(
                f"the board was reset, and has forgotten its trip "
                f"({self.trip.replace('_', ' ')}): {TRIP_ADVICE.get(self.trip, 'clear the trip')}"
            )
        board.drive("run", rpm, self._counts)
        self._wanted = True
        self._asked_s = self._now_s()
        self._interruptions = _interruptions(board)

    def _note_interruption(self, board: AdcBoard) -> None:
        if self._interruptions not in (None, _interruptions(board)):
            if self._wanted:
                self._drop("the board or its line was gone: set the crank's speed again")
            if self._now_s() - self._asked_s >= _REPEAT_S:
                self._watch_again(board)
        elif self._wanted and board.drive_state is not None and board.drive_state.trip != "none":
            self._drop(f"the drive has tripped ({board.drive_state.trip.replace('_', ' ')})")

    def _watch_again(self, board: AdcBoard) -> None:
        interruptions = _interruptions(board)
        self._asked_s = self._now_s()
        try:
            board.drive("watch", counts_per_revolution=self._counts)
        except (BoardError, OSError):
            return  # asked again soon; what is wrong with the board is told by its driver
        self._interruptions = interruptions

    def _drop(self, why: str) -> None:
        self._wanted = False
        self._on_dropped(f"the crank is no longer driven: {why}")


def _interruptions(board: AdcBoard) -> tuple[int, int]:
    return board.statistics.restarts, board.statistics.reconnections
