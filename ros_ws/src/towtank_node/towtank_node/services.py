# SPDX-License-Identifier: Apache-2.0
"""The services of a trial, besides those of ROS 2 itself. No ROS in here, as in topics.py."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from towtank_node.names import CRANK_DRIVE_NODE, PLANT
from towtank_node.topics import interface


@dataclass(frozen=True)
class Service:
    """One service. name: absolute, or below its node's own; type_name: `package/srv/Name`."""

    name: str
    type_name: str

    def of(self, node: str) -> Service:
        """The service of that name below a node's full name, or `~` for the node that makes it."""
        return replace(self, name=f"{node}/{self.name}")

    @property
    def type(self) -> Any:
        """Class of its requests and answers; imported when it is asked for."""
        return interface(self.type_name)


ZERO = Service("zero", "std_srvs/srv/Trigger")
"""Of a pressure sensor's node and of the encoders'."""

CRANK_SPEED = Service("set_speed", "towtank_interfaces/srv/SetCrankSpeed")
SET_CRANK_SPEED = CRANK_SPEED.of(CRANK_DRIVE_NODE)
SET_DRIVE = Service(f"/{PLANT}/set_drive", "towtank_interfaces/srv/SetDrive")
