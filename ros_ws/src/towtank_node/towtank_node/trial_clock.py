# SPDX-License-Identifier: Apache-2.0
"""The clock that all nodes of a trial stamp by."""

from __future__ import annotations

import time
from typing import Any

from towtank_node.parameters import Parameter, read_parameters
from towtank_node.stamps import ros_minus_monotonic_ns, set_stamp

CLOCK_OFFSET = Parameter(
    "clock_offset_ns",
    int,
    "how far the system's clock was ahead of the monotonic one when the trial began, ns; "
    "0: when the node did",
    default=0,
)


class TrialClock:
    """The system's time as it was when the trial began, counted on by the monotonic clock.

    A step of the system's clock in the trial parts no stamps, not even those of a node that was
    started behind it. With `use_sim_time` it is the clock that is replayed.

    offset_ns: ahead of the monotonic clock, ns. given: whether the trial has said so.
    """

    def __init__(self, node: Any) -> None:
        if not node.has_parameter(CLOCK_OFFSET.name):
            read_parameters(node, [CLOCK_OFFSET])
        self._clock = node.get_clock()
        offset_ns = node.get_parameter(CLOCK_OFFSET.name).value
        self.given = offset_ns != 0
        self.offset_ns = offset_ns or self.measured_offset_ns()

    def now_ns(self) -> int:
        """Now, ns since the epoch."""
        if self._clock.ros_time_is_active:
            return self._clock.now().nanoseconds
        return time.monotonic_ns() + self.offset_ns

    def stamp(self, stamp: Any) -> None:
        """Write now into a stamp."""
        set_stamp(stamp, self.now_ns())

    def measured_offset_ns(self) -> int:
        """How far the node's clock is ahead of the monotonic one now, ns."""
        return ros_minus_monotonic_ns(lambda: self._clock.now().nanoseconds)
