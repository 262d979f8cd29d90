# SPDX-License-Identifier: Apache-2.0
"""The process of all sensors: their nodes, and the scans that it hands to each."""

from __future__ import annotations

import sys

from towtank_interfaces.msg import AdcScan
from towtank_node.main import run_nodes
from towtank_node.names import BODIES
from towtank_node.senders import Senders
from towtank_node.stamps import stamp_ns
from towtank_node.topics import SCANS
from towtank_rig import RigError

from towtank_daq.description import DescriptionError
from towtank_daq.encoder_node import EncoderNode
from towtank_daq.inclinometer_node import InclinometerNode
from towtank_daq.pressure_node import PressureNode
from towtank_daq.scan_node import ScanNode

_GATHER_S = 0.03
"""Three scans at 100 Hz, six at 200 Hz. So much later come the values, with the same stamps; it
saves a third of the chain's processor time (`towtank bench cpu`)."""


def make_sensors() -> list[ScanNode]:
    """Make the sensors' nodes, which get their scans by one subscription."""
    encoder = EncoderNode()
    nodes = [*map(PressureNode, BODIES), InclinometerNode(), encoder]

    def deliver(scan: AdcScan) -> None:
        drive = encoder.watch.update(
            stamp_ns(scan.header.stamp), scan.crank_count, scan.carriage_count, scan.count_epoch
        )
        for node in nodes:
            node.on_scan(scan, drive)

    Senders(encoder).subscribe(SCANS, deliver)
    return nodes


def main() -> None:
    sys.exit(run_nodes(make_sensors, (RigError, DescriptionError), gather_s=_GATHER_S))
