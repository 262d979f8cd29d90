# SPDX-License-Identifier: Apache-2.0
"""An executor that is cheap for streams of messages.

Before each callback rclpy's executors gather everything that a node could be woken by (a dozen
parameter services, timers, guards) and make a wait set of it, all in Python: 0.3 ms and more a
message, several times what the message itself costs. Here the wait set holds the subscriptions
alone, and all messages that have come are taken at once. Timers are served when they are due, and
everything else at least every HOUSEKEEPING_PERIOD_S, by rclpy's own executor.

The middleware's timed wait ends at a time of the system's clock: where that clock is set back, a
wait of a tenth of a second lasts an hour unless a message ends it. An alarm on the steady clock
does so.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from towtank_node.senders import Stream

HOUSEKEEPING_PERIOD_S = 0.1
"""Services and parameters wait at most this long."""

_NS = 1_000_000_000


class StreamExecutor(SingleThreadedExecutor):
    """Single-threaded; for nodes whose work is streams. Callbacks must be plain functions."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self._housekeeping_at = 0.0
        self._alarm = _Alarm(self.context)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """As rclpy's; the alarm ends too."""
        self._alarm.end()
        return super().shutdown(timeout_sec)

    def spin_once(self, timeout_sec: float = HOUSEKEEPING_PERIOD_S) -> None:
        """Serve what comes within `timeout_sec` (s, at most HOUSEKEEPING_PERIOD_S is waited)."""
        now = time.monotonic()
        due_ns = self._nearest_timer_ns()
        if now >= self._housekeeping_at or due_ns <= 0:
            self._housekeeping_at = now + HOUSEKEEPING_PERIOD_S
            super().spin_once(timeout_sec=0)
            for stream in self._streams():
                stream.deliver()  # what was held back until its sender was known
            return
        housekeeping_ns = int((self._housekeeping_at - now) * _NS)
        self._serve_subscriptions(min(int(timeout_sec * _NS), due_ns, housekeeping_ns))

    def _nearest_timer_ns(self) -> int:
        """Time until the next timer is due, ns; negative when it is late."""
        return min(
            (
                timer.time_until_next_call()
                for node in self.get_nodes()
                for timer in node.timers
                if not timer.is_canceled()
            ),
            default=_NS,
        )

    def _serve_subscriptions(self, timeout_ns: int) -> None:
        waiting = [
            subscription
            for node in self.get_nodes()
            for subscription in node.subscriptions
            if isinstance(subscription.callback_group, Stream) or self.can_execute(subscription)
        ]
        if not waiting:  # rcl refuses to wait for nothing
            time.sleep(timeout_ns / _NS)
            return
        with self.context.handle:
            wait_set = _rclpy.WaitSet(len(waiting), 1, 0, 0, 0, 0, self.context.handle)
        wait_set.clear_entities()
        for subscription in waiting:
            wait_set.add_subscription(subscription.handle)
        with self._alarm.within(timeout_ns / _NS) as guard:
            wait_set.add_guard_condition(guard.handle)
            wait_set.wait(timeout_ns)
        ready = wait_set.get_ready_entities("subscription")
        for subscription in waiting:
            if subscription.handle.pointer in ready:
                self._take_all(subscription)

    def _streams(self) -> list[Stream]:
        return [
            subscription.callback_group
            for node in self.get_nodes()
            for subscription in node.subscriptions
            if isinstance(subscription.callback_group, Stream)
        ]

    def _take_all(self, subscription: Any) -> None:
        if isinstance(subscription.callback_group, Stream):
            subscription.callback_group.deliver()
            return
        with subscription.handle:
            while taken := subscription.handle.take_message(
                subscription.msg_type, subscription.raw
            ):
                subscription.callback(taken[0])


class _Alarm:
    """Ends waits that last longer than they should; its thread begins with the first wait."""

    def __init__(self, context: rclpy.Context) -> None:
        self._guard = GuardCondition(None, None, context=context)
        self._due = math.inf  # on the steady clock, s
        self._ended = False
        self._thread: threading.Thread | None = None

    @contextmanager
    def within(self, timeout_s: float) -> Iterator[GuardCondition]:
        """Around a wait of `timeout_s`: triggers the guard condition when it should have ended."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="alarm", daemon=True)
            self._thread.start()
        self._due = time.monotonic() + timeout_s
        try:
            yield self._guard
        finally:
            self._due = math.inf

    def end(self) -> None:
        """End the thread."""
        self._ended = True
        if self._thread is not None:
            self._thread.join()
        self._guard.destroy()

    def _watch(self) -> None:
        while not self._ended:
            time.sleep(HOUSEKEEPING_PERIOD_S)
            if time.monotonic() > self._due:
                self._guard.trigger()
