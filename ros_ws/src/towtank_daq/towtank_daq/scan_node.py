# SPDX-License-Identifier: Apache-2.0
"""What the sensor nodes have in common: the rig, the board's channels, and the scans.

The nodes of all sensors live in one process (sensors.py), so that a scan is received once and the
drive's motion is worked out once; they stay nodes of their own, with names, services and
diagnostics of their own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from rclpy.node import Node
from towtank_interfaces.msg import AdcScan
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.health import Health
from towtank_node.names import split_name
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.scan_account import ScanAccount
from towtank_node.stamps import stamp_ns
from towtank_node.timers import create_steady_timer
from towtank_rig import load_rig

from towtank_daq.description import installed_description, load_description
from towtank_daq.encoder import Drive
from towtank_daq.sensor_health import ADVICE

_HEALTH_PERIOD_S = 1.0


class ScanNode(Node, ABC):
    """A node that makes something of each scan of the ADC board. full_name: with its namespace.

    Its period for counting overruns is that of the rig's sample rate.
    """

    def __init__(self, full_name: str, parameters: Sequence[Parameter] = ()) -> None:
        namespace, name = split_name(full_name)
        super().__init__(name, namespace=namespace)
        self.parameters = read_parameters(
            self, [Parameter("rig", str, "path of the rig file"), *parameters]
        )
        self.rig = load_rig(self.parameters.rig)
        self.board = load_description(installed_description())
        self._account = ScanAccount()
        self._ready = False
        self._seen, self._told = Health(0), Health(0)
        self._flagged = dict.fromkeys(Health, 0)
        self.diagnostics = NodeDiagnostics(
            self, 1.0 / self.rig.board.sample_rate.value, self._details
        )
        create_steady_timer(self, _HEALTH_PERIOD_S, self._tell_health)

    def ready(self) -> None:
        """The node does its work; said once."""
        if not self._ready:
            self._ready = True
            self.diagnostics.ready()

    def note_health(self, flags: Health) -> None:
        """Count what a scan says of the sensor's health; diagnostics tell it, once a second."""
        if flags:
            self._seen |= flags
            for flag in flags:
                self._flagged[flag] += 1

    def on_scan(self, scan: AdcScan, drive: Drive) -> None:
        """Work on the next scan; `drive` is how crank and carriage move at its instant."""
        with self.diagnostics.cycle():
            self._account.take(scan.sequence, scan.board_ticks, stamp_ns(scan.header.stamp))
            self.take(scan, drive)

    @abstractmethod
    def take(self, scan: AdcScan, drive: Drive) -> None:
        """Publish what the sensor says in one scan."""

    def _details(self) -> dict[str, object]:
        return {
            "scans_missed": self._account.lost,
            **{f"health_{flag.names[0]}": count for flag, count in self._flagged.items()},
        }

    def _tell_health(self) -> None:
        seen, self._seen = self._seen, Health(0)
        if not self._ready or seen == self._told:
            return
        self._told = seen
        if seen:
            what = "; ".join(f"{flag.names[0]}: the sensor {ADVICE[flag]}" for flag in seen)
            self.get_logger().warning(what)
            self.diagnostics.warn(what)
        else:
            self.get_logger().info("the sensor looks sound again")
            self.diagnostics.ready()
