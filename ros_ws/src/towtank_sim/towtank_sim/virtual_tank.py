# SPDX-License-Identifier: Apache-2.0
"""The process of the virtual tank: the plant, its crank's drive, and the bench.

The plant hands each state to the bench in memory; its topics are for those who look on.
"""

from __future__ import annotations

from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from towtank_node.main import run_nodes
from towtank_rig import RigError

import sim_core as sc
from towtank_sim.bench import BenchError
from towtank_sim.bench_node import BenchNode
from towtank_sim.model import ModelError
from towtank_sim.plant_node import PlantNode
from towtank_sim.terminal_faults import FaultError

_EXPECTED_ERRORS = (
    *(RigError, ModelError, sc.ConvergenceError, sc.InvalidInput),
    *(BenchError, FaultError),
)


def make_nodes() -> list[Node]:
    """Make the nodes: the bench, the plant, and its crank's drive."""
    bench = BenchNode()
    plant = PlantNode(bench.take)
    return [bench, plant, plant.crank_node]


def main() -> int:
    """Run the nodes until they are stopped."""
    return run_nodes(make_nodes, _EXPECTED_ERRORS, make_executor=EventsExecutor)
