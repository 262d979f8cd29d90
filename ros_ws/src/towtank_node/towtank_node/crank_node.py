# SPDX-License-Identifier: Apache-2.0
"""A node that drives a crank, and hears of an emergency stop past ROS 2 too."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from towtank_node.quick_stop import QuickStop


class CrankNode(Node):
    """Listens in the ROS domain of its context from heed() on, until it is closed or destroyed."""

    _quick_stop: QuickStop | None = None

    def heed(self, stop: Callable[[], str]) -> None:
        """Call `stop`, as QuickStop does, when an emergency stop is asked for.

        Where another process listens already, the node's service alone is left; a warning says so.
        """
        try:
            self._quick_stop = QuickStop(self.context.get_domain_id(), stop)
        except OSError as error:
            self.get_logger().warning(
                f"emergency stops come by the service only, not by the quick way: {error.strerror}"
            )

    def close(self) -> None:
        """Listen to no emergency stop any more."""
        if self._quick_stop is not None:
            self._quick_stop.close()

    def destroy_node(self) -> None:
        """As rclpy's; nobody is left listening."""
        self.close()
        super().destroy_node()
