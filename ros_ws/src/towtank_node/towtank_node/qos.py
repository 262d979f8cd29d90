# SPDX-License-Identifier: Apache-2.0
"""Quality of service of the graph's topics. No ROS in here: endpoints.py makes rclpy's profiles."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Qos:
    """What a publisher offers and a subscription asks for, as far as the graph's topics differ.

    reliability: reliable or best_effort; durability: volatile or transient_local; depth: messages
    that the last ones are kept of.
    """

    reliability: str
    durability: str
    depth: int


SENSOR = Qos("best_effort", "volatile", 50)
"""Streams of samples and states, as ROS 2's sensor-data profile but deeper: half a second at
100 Hz, so that a reader that is held up shortly loses nothing."""

RELIABLE = Qos("reliable", "volatile", 100)
"""Results and everything else that is neither a stream nor a description."""

LATCHED = Qos("reliable", "transient_local", 100)
"""Rig and trial information: a reader that comes late gets it too."""
