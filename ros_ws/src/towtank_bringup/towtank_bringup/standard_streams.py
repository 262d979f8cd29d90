# SPDX-License-Identifier: Apache-2.0
"""Standard output and error of the command: a failing one never breaks off what is measured.

Words of progress and warnings go to standard error; where nobody takes them any more (a `tee` that
has ended, a terminal that was closed, a full disk) they are lost, and nothing else. Results go to
standard output; where that fails, OutputError says so once.
"""

from __future__ import annotations

import codecs
import io
import os
import sys
from typing import TextIO

ASCII_FOR = {
    "±": "+/-",
    "−": "-",
    "–": "-",
    "×": "x",
    "·": "*",
    "→": "->",
    "°": "deg ",
    "²": "^2",
    "³": "^3",
    "…": "...",
    "µ": "u",
    "μ": "u",
}
"""What is written where the encoding has no such character; "?" for the others."""

_ERRORS = "towtank-plain"


class OutputError(RuntimeError):
    """Standard output takes no more; the message says why."""


class _Output(io.FileIO):
    def write(self, data: bytes) -> int:  # type: ignore[override]
        try:
            return super().write(data)
        except OSError as error:
            # What is still in the buffers must not fail a second time, when Python ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise OutputError(f"standard output: {error.strerror}") from error


class _Words(io.FileIO):
    def write(self, data: bytes) -> int:  # type: ignore[override]
        try:
            return super().write(data)
        except OSError:
            return len(data)


def guard_standard_streams() -> None:
    """Make this process's sys.stdout and sys.stderr behave as this module says."""
    codecs.register_error(_ERRORS, _plain)
    sys.stdout = _guarded(sys.stdout, _Output)
    sys.stderr = _guarded(sys.stderr, _Words)


def _guarded(stream: TextIO | None, kind: type[io.FileIO]) -> TextIO:
    if stream is None:  # closed by whoever started us
        return open(os.devnull, "w", encoding="utf-8", errors=_ERRORS)
    raw = kind(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        encoding=stream.encoding,
        errors=_ERRORS,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _plain(error: UnicodeError) -> tuple[str | bytes, int]:
    """Write what an encoding does not have in another way; bytes of file names as they are."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    character, rest = error.object[error.start], error.start + 1
    try:
        return character.encode("ascii", "surrogateescape"), rest
    except UnicodeEncodeError:
        return ASCII_FOR.get(character, "?"), rest
