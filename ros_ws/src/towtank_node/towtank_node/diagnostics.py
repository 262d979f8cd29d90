# SPDX-License-Identifier: Apache-2.0
"""A node's word on its own health, once a second on /diagnostics.

A node is ready when its first status says so (key `state` = `ready`), and it tells how often it
fell behind (key `overruns`): work that took longer than the node's period, or periods and inputs
that it had to leave out.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from towtank_node.endpoints import publisher
from towtank_node.timers import create_steady_timer
from towtank_node.topics import DIAGNOSTICS
from towtank_node.trial_clock import TrialClock

REPORT_PERIOD_S = 1.0


class _Cycle:
    """The time that a cycle takes; contextlib's way would cost more than the counting."""

    __slots__ = ("_began_s", "_diagnostics")

    def __init__(self, diagnostics: NodeDiagnostics) -> None:
        self._diagnostics = diagnostics

    def __enter__(self) -> None:
        self._began_s = time.monotonic()

    def __exit__(self, *error: object) -> None:
        self._diagnostics.count(time.monotonic() - self._began_s)


class NodeDiagnostics:
    """Counts a node's overruns and publishes its status.

    period_s: the node's period, s; one cycle of work must be done within it.
    details: called at each report; returns further values to publish by name.
    clock: that the statuses are stamped by; the node's own TrialClock if None.
    """

    def __init__(
        self,
        node: Any,
        period_s: float,
        details: Callable[[], dict[str, Any]] = dict,
        clock: TrialClock | None = None,
    ) -> None:
        self._node = node
        self._period_s = period_s
        self._details = details
        self._level = DiagnosticStatus.OK
        self._message = "starting"
        self._ready = False
        self._longest_s = 0.0
        self._clock = clock or TrialClock(node)
        self.cycles = 0
        self.overruns = 0
        self._publisher = publisher(node, DIAGNOSTICS)
        create_steady_timer(node, REPORT_PERIOD_S, self.report)

    def cycle(self) -> _Cycle:
        """Around one cycle of work, in a `with`: counts the periods that it overran."""
        return _Cycle(self)

    def count(self, duration: float) -> None:
        """Count a cycle of work that took so long, s."""
        self.cycles += 1
        self._longest_s = max(self._longest_s, duration)
        if duration > self._period_s:
            self.overruns += int(duration / self._period_s)

    def overrun(self, count: int = 1) -> None:
        """Count periods or inputs that the node had to leave out."""
        self.overruns += count

    def ready(self, message: str = "running") -> None:
        """From now on the node does its work; said at once."""
        self._ready, self._level, self._message = True, DiagnosticStatus.OK, message
        self.report()

    def warn(self, message: str) -> None:
        """The node goes on, but its user should know."""
        self._level, self._message = DiagnosticStatus.WARN, message
        self.report()

    def stop(self, message: str) -> None:
        """The node does not do its work any more, as it was told. A failure before that stays."""
        self._ready = False
        if self._level != DiagnosticStatus.ERROR:
            self._level, self._message = DiagnosticStatus.OK, message
        self.report()

    def fail(self, message: str) -> None:
        """The node cannot do its work; `message` names the cause and the mend."""
        self._ready, self._level, self._message = False, DiagnosticStatus.ERROR, message
        self.report()

    def report(self) -> None:
        """Publish the status now."""
        values = {
            "state": "ready" if self._ready else "not ready",
            "cycles": self.cycles,
            "overruns": self.overruns,
            "longest_cycle_ms": f"{1e3 * self._longest_s:.2f}",
            **self._details(),
        }
        status = DiagnosticStatus(
            level=self._level,
            name=self._node.get_fully_qualified_name(),
            message=self._message,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        self._clock.stamp(array.header.stamp)
        self._publisher.publish(array)
