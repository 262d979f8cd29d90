# SPDX-License-Identifier: Apache-2.0
"""Regular work of a node at a rate at which timers alone are too dear.

For each timer callback rclpy gathers everything that a node could be woken by, in Python: 0.3 ms
and more, as much as the plant does in a cycle. So the timer fires once for several cycles, between
which its callback sleeps. All stays in one thread; other timers and services wait at most 50 ms.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.node import Node
from towtank_node.timers import create_steady_timer

_CYCLES_PER_CALL = 5


class Cycles:
    """Calls `work` every `period_s` seconds of the steady clock, while the node spins."""

    def __init__(self, node: Node, period_s: float, work: Callable[[], None]) -> None:
        self._period_s = period_s
        self._work = work
        create_steady_timer(node, _CYCLES_PER_CALL * period_s, self._call)

    def _call(self) -> None:
        start = time.monotonic()
        for cycle in range(_CYCLES_PER_CALL):
            time.sleep(max(0.0, start + cycle * self._period_s - time.monotonic()))
            self._work()
