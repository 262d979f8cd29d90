# SPDX-License-Identifier: Apache-2.0
"""Where the ROS clock stands against CLOCK_MONOTONIC.

Stamps made from one offset are as evenly spaced as the monotonic clock, whatever the system's
time does meanwhile.
"""

from __future__ import annotations

import time
from collections.abc import Callable

_READINGS = 20


def monotonic_to_ros_offset(ros_now: Callable[[], int]) -> int:
    """Return ROS time minus monotonic time, ns.

    ros_now: reads the ROS clock in ns. Of some readings, each between two of the monotonic clock,
    the one with the closest pair counts: it was disturbed least.
    """

    def reading() -> tuple[int, int]:
        before = time.monotonic_ns()
        ros = ros_now()
        after = time.monotonic_ns()
        return after - before, ros - (before + after) // 2

    return min(reading() for _ in range(_READINGS))[1]
