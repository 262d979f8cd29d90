# SPDX-License-Identifier: Apache-2.0
"""Bringing together messages that belong to one instant."""

from __future__ import annotations

from typing import Any

_LONGEST_WAIT = 50  # instants: half a second at 100 Hz, as deep as the topics' own queues


class StampMatcher:
    """Collects one message of each topic per stamp.

    Topics come in any order, each with its stamps rising. When a set is complete, all older
    incomplete ones are given up: a topic delivers in order, so their missing messages are lost.
    """

    def __init__(self, topics: int) -> None:
        self._topics = topics
        self._pending: dict[int, list[Any]] = {}
        self.lost = 0

    def add(self, topic: int, stamp: int, message: Any) -> list[Any] | None:
        """Take a message; return all messages of its stamp, by topic, once they are complete."""
        messages = self._pending.setdefault(stamp, [None] * self._topics)
        messages[topic] = message
        if any(other is None for other in messages):
            if len(self._pending) > _LONGEST_WAIT:
                self._give_up(min(self._pending))
            return None
        del self._pending[stamp]
        for older in [pending for pending in self._pending if pending < stamp]:
            self._give_up(older)
        return messages

    def _give_up(self, stamp: int) -> None:
        del self._pending[stamp]
        self.lost += 1
