# SPDX-License-Identifier: Apache-2.0
"""The thread that sits on a board's line while it streams."""

from __future__ import annotations

import contextlib
import threading
import traceback
from collections.abc import Callable

from towtank_daq.board import AdcBoard, BoardError
from towtank_daq.crank_drive import CrankDrive

FAILURES = (BoardError, OSError)
"""How a board or its line fails; anything else is a mistake of the program."""

_POLL_S = 0.05  # how soon it is seen that the thread shall end, or what the drive is asked for


class BoardThread:
    """The only user of the driver as long as it runs: takes the scans in, and serves the drive.

    on_fault: told, from the thread, of a mistake of the program, as text for a log. on_failed:
    called, from the thread, with one line when it has ended by itself, the crank stopped.
    """

    def __init__(
        self,
        drive: CrankDrive,
        on_fault: Callable[[str], None],
        on_failed: Callable[[str], None],
    ) -> None:
        self._drive = drive
        self._on_fault = on_fault
        self._on_failed = on_failed
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def serves(self) -> bool:
        """Whether it has the driver: from start() to join(), also where it has failed since."""
        return self._thread is not None

    def start(self, board: AdcBoard) -> None:
        """Serve a board that streams."""
        self._ending.clear()
        self._thread = threading.Thread(
            target=self._serve, args=(board,), name="serial", daemon=True
        )
        self._thread.start()

    def join(self) -> None:
        """End it, if it runs, and give the driver back."""
        if self._thread is not None:
            self._ending.set()
            self._thread.join()
            self._thread = None

    def _serve(self, board: AdcBoard) -> None:
        try:
            while not self._ending.is_set():
                board.poll(_POLL_S)
                self._drive.serve(board)
        except Exception as error:  # noqa: BLE001 - nobody else would serve the crank
            failure = str(error)
            if not isinstance(error, FAILURES):
                self._on_fault(traceback.format_exc())
                failure = f"fault in the board's node, see its log: {error!r}"
            with contextlib.suppress(Exception):  # the fault again; the stop is sent before that
                self._drive.release(board)
            self._on_failed(failure)
