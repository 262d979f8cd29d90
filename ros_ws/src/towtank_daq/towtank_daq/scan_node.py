# SPDX-License-Identifier: Apache-2.0
"""What the sensor nodes have in common: the rig, the board's channels, and the scans."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from rclpy.node import Node
from towtank_interfaces.msg import AdcScan
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.qos import SENSOR_QOS
from towtank_rig import load_rig

from towtank_daq.description import installed_description, load_description


class ScanNode(Node, ABC):
    """A node that makes something of each scan of the ADC board.

    Its period for counting overruns is that of the rig's sample rate.
    """

    def __init__(self, name: str, parameters: Sequence[Parameter] = ()) -> None:
        super().__init__(name)
        self.parameters = read_parameters(
            self, [Parameter("rig", str, "path of the rig file"), *parameters]
        )
        self.rig = load_rig(self.parameters.rig)
        self.board = load_description(installed_description())
        self._last_sequence: int | None = None
        self._missed = 0
        self.diagnostics = NodeDiagnostics(
            self, 1.0 / self.rig.board.sample_rate.value, lambda: {"scans_missed": self._missed}
        )

    def listen(self) -> None:
        """From now on take() gets the scans."""
        self.create_subscription(AdcScan, "/measured/adc_scan", self._on_scan, SENSOR_QOS)

    @abstractmethod
    def take(self, scan: AdcScan) -> None:
        """Work on one scan."""

    def _on_scan(self, scan: AdcScan) -> None:
        with self.diagnostics.cycle():
            if self._last_sequence is not None and scan.sequence > self._last_sequence:
                self._missed += scan.sequence - self._last_sequence - 1
            self._last_sequence = scan.sequence
            self.take(scan)
