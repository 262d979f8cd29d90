# SPDX-License-Identifier: Apache-2.0
"""Offered quality of service in the form in which rosbag2 stores it."""

from __future__ import annotations

from typing import Any

from towtank_node.qos import Qos

# rosbag2's word for "no limit" in a duration
_UNLIMITED = {"sec": 9223372036, "nsec": 854775807}


def offered_profile(qos: Qos) -> dict[str, Any]:
    """All nine fields, as in metadata.yaml version 9. rosbag2 refuses a shorter profile."""
    return {
        "history": "keep_last",
        "depth": qos.depth,
        "reliability": qos.reliability,
        "durability": qos.durability,
        "deadline": dict(_UNLIMITED),
        "lifespan": dict(_UNLIMITED),
        "liveliness": "automatic",
        "liveliness_lease_duration": dict(_UNLIMITED),
        "avoid_ros_namespace_conventions": False,
    }
