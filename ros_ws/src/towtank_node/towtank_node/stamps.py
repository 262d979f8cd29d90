# SPDX-License-Identifier: Apache-2.0
"""ROS stamps as nanoseconds, and the ROS clock against CLOCK_MONOTONIC."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

_NS_PER_S = 1_000_000_000
_READINGS = 20


def stamp_ns(stamp: Any) -> int:
    """A stamp (builtin_interfaces/Time, of rclpy or of rosbags) in ns since the epoch."""
    return int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)


def set_stamp(stamp: Any, time_ns: int) -> None:
    """Write ns since the epoch into a stamp."""
    stamp.sec, stamp.nanosec = divmod(time_ns, _NS_PER_S)


def ros_minus_monotonic_ns(
    ros_now_ns: Callable[[], int], monotonic_ns: Callable[[], int] = time.monotonic_ns
) -> int:
    """How far the ROS clock is ahead of the monotonic one, ns.

    Stamps made from one such offset are as evenly spaced as the monotonic clock, whatever the
    system's time does meanwhile. Of some readings, each between two of the monotonic clock, the one
    with the closest pair counts: it was disturbed least.
    """

    def reading() -> tuple[int, int]:
        before, ros, after = monotonic_ns(), ros_now_ns(), monotonic_ns()
        return after - before, ros - (before + after) // 2

    return min(reading() for _ in range(_READINGS))[1]
