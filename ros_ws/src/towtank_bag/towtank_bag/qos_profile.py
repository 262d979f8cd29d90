# SPDX-License-Identifier: Apache-2.0
"""Offered quality of service in the form in which rosbag2 stores it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

# rosbag2's word for "no limit" in a duration
_UNLIMITED = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True)
class OfferedQos:
    """What a publisher offers, as far as the graph's profiles differ.

    reliability: reliable or best_effort; durability: volatile or transient_local.
    """

    reliability: str
    durability: str
    depth: int

    def profile(self) -> dict[str, Any]:
        """All nine fields, as in metadata.yaml version 9. rosbag2 refuses a shorter profile."""
        return {
            "history": "keep_last",
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": dict(_UNLIMITED),
            "lifespan": dict(_UNLIMITED),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_UNLIMITED),
            "avoid_ros_namespace_conventions": False,
        }
