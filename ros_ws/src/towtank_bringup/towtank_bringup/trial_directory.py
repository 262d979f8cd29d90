# SPDX-License-Identifier: Apache-2.0
"""The directory that a trial leaves, and the mark it carries until the trial is whole."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from towtank_bag.held_directory import HeldDirectory, make_directory

_RUNNING = "IN_PROGRESS"
_BROKEN = "INCOMPLETE"


class TrialDirectoryError(RuntimeError):
    """The directory cannot be made or is gone; the message says why."""


class TrialDirectory:
    """bag/, logs/, result.json and report.html of one trial.

    While the trial runs the directory holds a file IN_PROGRESS; if it does not end well, that
    file is renamed INCOMPLETE. A directory with neither is a whole trial. It may be renamed while
    the trial runs: all paths are those where it is now.
    """

    def __init__(self, path: Path) -> None:
        self._given = path
        self._held: HeldDirectory | None = None

    @property
    def path(self) -> Path:
        return self._hold().path if self._held or self._given.is_dir() else self._given

    @property
    def bag(self) -> Path:
        return self.path / "bag"

    @property
    def logs(self) -> Path:
        return self.path / "logs"

    @property
    def result(self) -> Path:
        return self.path / "result.json"

    @property
    def report(self) -> Path:
        return self.path / "report.html"

    @property
    def renamed(self) -> bool:
        """Whether it is not where it was made."""
        return self.path != self._given

    def create(self) -> None:
        """Make the directory. TrialDirectoryError if there is one: data are never overwritten."""
        try:
            self._held = make_directory(self._given)
            self._held.write(
                _RUNNING,
                "This trial is running, or ended without a word. The bag in it is readable.\n",
            )
        except FileExistsError as error:
            raise TrialDirectoryError(f"output directory {self._given} exists") from error
        except OSError as error:
            raise TrialDirectoryError(f"cannot write {self._given}: {error.strerror}") from error

    def check(self) -> None:
        """TrialDirectoryError if somebody has removed it."""
        if self._hold().removed:
            raise TrialDirectoryError(
                f"{self._given}: somebody has removed the trial's directory: leave it alone and "
                "start again"
            )

    def complete(self) -> None:
        """The trial is whole, and stays so after a power cut: take the mark away."""
        held = self._hold()
        for path in (self.result, self.report):
            if held.has(path.name):
                held.sync_file(path.name)
        held.remove(_RUNNING)

    def incomplete(self) -> str:
        """The trial is not whole. Renaming needs no room: it works on a full disk too. On a disk
        that has failed it does not, and the mark is left as near as it can be. Returns in words
        what has been done."""
        try:
            self._hold().rename(_RUNNING, _BROKEN)
            return "trial marked incomplete"
        except OSError as error:
            failed = f"its directory cannot be marked incomplete: {error.strerror}"
            for folder in (self._given.parent, Path.cwd(), Path(tempfile.gettempdir())):
                mark = folder / f"{self._given.name}.{_BROKEN}"
                with contextlib.suppress(OSError), open(mark, "w", opener=_for_good) as file:
                    file.write(f"The trial in {self._given} is not whole.\n")
                    return (
                        f"its directory cannot be marked incomplete: {error.strerror}; see {mark}"
                    )
            return failed

    def abandon(self) -> None:
        """Nobody leads the trial any more: it is not whole unless it has been said to be."""
        if self._hold().has(_RUNNING):
            self.incomplete()

    def _hold(self) -> HeldDirectory:
        """The directory, which another process may have made."""
        if self._held is None:
            self._held = HeldDirectory(self._given)
        return self._held


def _for_good(path: str, flags: int) -> int:
    """Opens a file so that what is written is on the disk, or the disk says that it is not."""
    return os.open(path, flags | os.O_SYNC, 0o644)
