# SPDX-License-Identifier: Apache-2.0
"""One line of progress on standard error: rewritten in a terminal, sparse in a log."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_LOG_PERIOD_S = 5.0


class ProgressLine:
    """Call it with one line of text. `close` leaves the last line standing; every warning stands,
    whatever follows it."""

    def __init__(self, stream: TextIO = sys.stderr) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._stage = ""
        self._printed_at = float("-inf")

    def __call__(self, line: str) -> None:
        warning = line.startswith("warning: ")
        if self._terminal:
            self._stream.write(f"\r\033[K{line}" + ("\n" if warning else ""))
            self._stream.flush()
            return
        if warning:
            print(line, file=self._stream, flush=True)
            return
        # Lines of one stage begin with the same word and differ in numbers only.
        stage = line.split(" ", 1)[0]
        if stage != self._stage or time.monotonic() - self._printed_at >= _LOG_PERIOD_S:
            self._stage, self._printed_at = stage, time.monotonic()
            print(line, file=self._stream, flush=True)

    def close(self) -> None:
        if self._terminal:
            self._stream.write("\n")
            self._stream.flush()
