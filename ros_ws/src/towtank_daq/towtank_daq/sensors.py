# SPDX-License-Identifier: Apache-2.0
"""The nodes of all sensors, and the scans for them.

In a trial the board's process has them (acquisition.py). The executable `sensors` is a process of
their own, anywhere on the network, which gets the scans from their topic.
"""

from __future__ import annotations

import sys

from towtank_interfaces.msg import AdcScan
from towtank_node.main import run_nodes
from towtank_node.names import BODIES
from towtank_node.senders import Senders
from towtank_node.topics import SCANS
from towtank_rig import RigError

from towtank_daq.description import DescriptionError
from towtank_daq.encoder_node import EncoderNode
from towtank_daq.inclinometer_node import InclinometerNode
from towtank_daq.pressure_node import PressureNode
from towtank_daq.scan_node import ScanNode


class Sensors:
    """Makes the nodes; the encoders' one tells the others how the drive moves."""

    def __init__(self) -> None:
        self.encoder = EncoderNode()
        self.nodes: list[ScanNode] = [
            *map(PressureNode, BODIES),
            InclinometerNode(),
            self.encoder,
        ]

    def take(self, scan: AdcScan) -> None:
        """Have all sensors work on the next scan; from one thread only, which may be another than
        the executor's."""
        drive = self.encoder.drive_at(scan)
        for node in self.nodes:
            node.on_scan(scan, drive)


def make_sensors() -> list[ScanNode]:
    """Make the sensors' nodes, which get their scans by one subscription."""
    sensors = Sensors()
    Senders(sensors.encoder).subscribe(SCANS, sensors.take)
    return sensors.nodes


def main() -> None:
    sys.exit(run_nodes(make_sensors, (RigError, DescriptionError)))
