# SPDX-License-Identifier: Apache-2.0
"""Timers that a step of the system's clock neither stops nor hurries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType


def create_steady_timer(node: Any, period_s: float, callback: Callable[[], None]) -> Any:
    """Like `node.create_timer(period_s, callback)`, on the steady clock.

    rclpy's timers are on the node's clock, which is the system's: set back by a minute, it stops
    them for that minute. With `use_sim_time` these timers keep real time.
    """
    return node.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
