# SPDX-License-Identifier: Apache-2.0
"""ROS stamps as nanoseconds, and the ROS clock against CLOCK_MONOTONIC."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

_NS_PER_S = 1_000_000_000
_READINGS = 20
_STEP_NS = 10_000_000  # reading one clock after the other costs microseconds


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


class SteadyTimes:
    """Turns times of the system's clock into ones that know nothing of its steps.

    They count on from `offset_ns` (ROS clock less monotonic clock, ns, when the trial began), as
    the stamps of scans and events do. The middleware notes its times by the system's clock; which
    side of a step they are on follows from when they can have been noted.
    """

    def __init__(
        self,
        offset_ns: int,
        system_ns: Callable[[], int] = time.time_ns,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._offset_ns = offset_ns
        self._system_ns, self._monotonic_ns = system_ns, monotonic_ns
        self._now_ns = self._before_ns = monotonic_ns()
        self._offsets = [ros_minus_monotonic_ns(system_ns, monotonic_ns)]  # the last one first

    def look(self) -> None:
        """Read both clocks; to be called behind each taking of messages."""
        self._before_ns, self._now_ns = self._now_ns, self._monotonic_ns()
        offset = ros_minus_monotonic_ns(self._system_ns, self._monotonic_ns)
        if abs(offset - self._offsets[0]) > _STEP_NS:
            self._offsets = [offset, self._offsets[0]]

    def received(self, system_ns: int) -> int:
        """A time that was noted between the last two looks. Where a step was shorter than that
        and fell between them, the time may be wrong by the step."""

        def outside(monotonic_ns: int) -> int:
            return max(self._before_ns - monotonic_ns, monotonic_ns - self._now_ns, 0)

        return self._nearest(system_ns, outside)

    def published(self, system_ns: int, received_ns: int) -> int:
        """A time that was noted shortly before `received_ns`, a result of `received`."""
        monotonic_ns = received_ns - self._offset_ns
        return self._nearest(system_ns, lambda published: abs(monotonic_ns - published))

    def _nearest(self, system_ns: int, distance: Callable[[int], int]) -> int:
        candidates = [system_ns - offset for offset in self._offsets]
        return min(candidates, key=distance) + self._offset_ns
