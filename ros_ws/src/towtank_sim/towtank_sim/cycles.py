# SPDX-License-Identifier: Apache-2.0
"""Regular work of a node at a rate that rclpy's executor alone is too dear for.

Before each callback the executor gathers everything that a node could be woken by, in Python: about
0.3 ms, more than these nodes do in a cycle. So it is woken once for several cycles, between which
the callback sleeps, and subscriptions are read in the cycles instead of waking it per message.
Everything stays in one thread; timers and services wait at most for one wake, 50 ms.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile

_CYCLES_PER_WAKE = 5


class Cycles:
    """Calls `work` every `period_s` seconds of the steady clock, from the node's executor."""

    def __init__(self, node: Node, period_s: float, work: Callable[[], None]) -> None:
        self._period_s = period_s
        self._work = work
        self._timer = node.create_timer(
            _CYCLES_PER_WAKE * period_s,
            self._wake,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    def _wake(self) -> None:
        start = time.monotonic()
        for cycle in range(_CYCLES_PER_WAKE):
            time.sleep(max(0.0, start + cycle * self._period_s - time.monotonic()))
            self._work()


class _NeverExecuted(CallbackGroup):
    """Its members wake no executor."""

    def can_execute(self, entity: Any) -> bool:
        return False

    def beginning_execution(self, entity: Any) -> bool:
        return False

    def ending_execution(self, entity: Any) -> None:
        pass


class PolledSubscription:
    """A subscription whose messages wait in its queue until they are asked for.

    raw: messages come as the serialised bytes.
    """

    def __init__(
        self, node: Node, kind: type, topic: str, qos: QoSProfile, *, raw: bool = False
    ) -> None:
        self._subscription = node.create_subscription(
            kind, topic, _ignore, qos, callback_group=_NeverExecuted(), raw=raw
        )

    def take_all(self) -> Iterator[Any]:
        """Yield the messages that have come, oldest first."""
        subscription = self._subscription
        with subscription.handle:
            while (
                taken := subscription.handle.take_message(subscription.msg_type, subscription.raw)
            ) is not None:
                yield taken[0]


def _ignore(message: Any) -> None:
    """The callback that a subscription must have and that no executor calls."""
