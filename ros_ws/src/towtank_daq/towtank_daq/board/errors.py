# SPDX-License-Identifier: Apache-2.0
"""How the driver fails: each is one line with cause and remedy."""

from __future__ import annotations

from towtank_daq.board.advice import REFUSAL_ADVICE


class BoardError(Exception):
    """The board does not do what it should."""


class NoAnswer(BoardError):
    """Nothing comes from the board; that may change."""


class Silence(NoAnswer):
    """No good frame for too long."""


class Refused(BoardError):
    """The board refuses a command; `status`: board.yaml's name for the reason."""

    def __init__(self, command: str, status: str) -> None:
        advice = REFUSAL_ADVICE.get(status)
        super().__init__(
            f"the board refuses '{command}': {status.replace('_', ' ')}"
            + (f": {advice}" if advice else "")
        )
        self.status = status
