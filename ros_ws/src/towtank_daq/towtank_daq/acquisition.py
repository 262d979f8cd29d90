# SPDX-License-Identifier: Apache-2.0
"""The process of acquisition: the board's node, the crank's drive and the sensors' nodes.

The board's serial thread hands each scan to the sensors' nodes in memory, as soon as it is complete
and published: no middleware, no other thread and no wake-up lies between sampling and the
engineering values. The executor's thread serves what is rare: transitions, zeroing, parameters,
diagnostics. `adc_board` and `sensors` are the same nodes in processes of their own, for sensors'
nodes elsewhere on the network.
"""

from __future__ import annotations

import sys

from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from towtank_node.main import run_nodes

from towtank_daq import adc_board_node
from towtank_daq.sensors import Sensors


def make_nodes() -> list[Node]:
    """Make all nodes of the process."""
    sensors = Sensors()
    return [*adc_board_node.make_nodes(sensors.take), *sensors.nodes]


def main() -> None:
    sys.exit(run_nodes(make_nodes, adc_board_node.EXPECTED_ERRORS, make_executor=EventsExecutor))
