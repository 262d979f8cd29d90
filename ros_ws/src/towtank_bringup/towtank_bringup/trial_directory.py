# SPDX-License-Identifier: Apache-2.0
"""The directory that a trial leaves, and the mark it carries until the trial is whole."""

from __future__ import annotations

from pathlib import Path

_RUNNING = "IN_PROGRESS"
_BROKEN = "INCOMPLETE"


class TrialDirectoryError(RuntimeError):
    """The directory cannot be made; the message says why."""


class TrialDirectory:
    """bag/, logs/, result.json and report.html of one trial.

    While the trial runs the directory holds a file IN_PROGRESS; if it does not end well, that
    file is renamed INCOMPLETE. A directory with neither is a whole trial.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.bag = path / "bag"
        self.logs = path / "logs"
        self.result = path / "result.json"
        self.report = path / "report.html"

    def create(self) -> None:
        """Make the directory. TrialDirectoryError if there is one: data are never overwritten."""
        try:
            self.path.mkdir(parents=True)
            (self.path / _RUNNING).write_text(
                "This trial is running, or ended without a word. The bag in it is readable.\n"
            )
        except FileExistsError as error:
            raise TrialDirectoryError(f"output directory {self.path} exists") from error
        except OSError as error:
            raise TrialDirectoryError(f"cannot write {self.path}: {error.strerror}") from error

    def complete(self) -> None:
        """The trial is whole: take the mark away."""
        (self.path / _RUNNING).unlink()

    def incomplete(self) -> None:
        """The trial is not whole. Renaming needs no room: it works on a full disk too."""
        (self.path / _RUNNING).rename(self.path / _BROKEN)

    def abandon(self) -> None:
        """Nobody leads the trial any more: it is not whole unless it has been said to be."""
        if (self.path / _RUNNING).exists():
            self.incomplete()
