# SPDX-License-Identifier: Apache-2.0
"""What the sensor nodes have in common: the rig, the board's channels, and the scans.

The nodes of all sensors live in one process (sensors.py), so that a scan is received once and the
drive's motion is worked out once; they stay nodes of their own, with names, services and
diagnostics of their own.

Scans come in one thread, services and diagnostics in another. A fault in what a node makes of a
scan is told by its diagnostics and stays its own: the thread that brings the scans also serves the
other sensors, and in the board's process the crank's drive.
"""

from __future__ import annotations

import threading
import traceback
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

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
from towtank_daq.kept_zero import KeptZero
from towtank_daq.sensor_health import ADVICE

_HEALTH_PERIOD_S = 1.0

ZEROS = Parameter(
    "zeros",
    str,
    "folder that keeps where the sensors were zeroed, for a process that is started again in the "
    "trial; empty: they are not kept",
    "",
)


class ScanNode(Node, ABC):
    """A node that makes something of each scan of the ADC board. full_name: with its namespace.

    Its period for counting overruns is that of the rig's sample rate.
    """

    def __init__(self, full_name: str, parameters: Sequence[Parameter] = ()) -> None:
        namespace, name = split_name(full_name)
        super().__init__(name, namespace=namespace)
        self.parameters = read_parameters(
            self, [Parameter("rig", str, "path of the rig file"), ZEROS, *parameters]
        )
        place = self.get_fully_qualified_name().strip("/").replace("/", ".")
        self.kept_zero = KeptZero(self.parameters.zeros, f"{place}.json")
        self.rig = load_rig(self.parameters.rig)
        self.board = load_description(installed_description())
        self._account = ScanAccount()
        self.one_at_a_time = threading.Lock()
        """Held while a scan is worked on; for services that change what that needs."""
        self._faults = 0
        self._ready = False
        self._seen, self._told = Health(0), Health(0)
        self._flagged = dict.fromkeys(Health, 0)
        self.diagnostics = NodeDiagnostics(
            self, 1.0 / self.rig.board.sample_rate.value, self._details
        )
        create_steady_timer(self, _HEALTH_PERIOD_S, self._tell_health)

    def ready(self) -> None:
        """The node does its work; said once, and not after a fault."""
        if not self._ready:
            self._ready = True
            self.say_ready()

    def say_ready(self) -> None:
        """Nothing is to be told, unless there was a fault."""
        if not self._faults:
            self.diagnostics.ready()

    def keep_zero(self, **values: Any) -> None:
        """Keep where the sensor was zeroed, in case the process is started again."""
        try:
            self.kept_zero.write(values)
        except OSError as error:
            self.get_logger().warning(
                f"{error.filename}: {error.strerror}: the zero would be lost if this process died"
            )

    def note_health(self, flags: Health) -> None:
        """Count what a scan says of the sensor's health; diagnostics tell it, once a second."""
        if flags:
            self._seen |= flags
            for flag in flags:
                self._flagged[flag] += 1

    def on_scan(self, scan: AdcScan, drive: Drive) -> None:
        """Work on the next scan; `drive` is how crank and carriage move at its instant."""
        with self.one_at_a_time, self.diagnostics.cycle():
            try:
                self._account.take(scan.sequence, scan.board_ticks, stamp_ns(scan.header.stamp))
                self.take(scan, drive)
            except Exception as error:  # noqa: BLE001 - the thread has others to serve
                self.fault(error)

    def fault(self, error: Exception) -> None:
        """A fault of the program: told at its first time, and counted."""
        self._faults += 1
        if self._faults == 1:
            self.get_logger().error("".join(traceback.format_exception(error)))
            self.diagnostics.fail(f"fault in this sensor's node, see its log: {error!r}")

    @abstractmethod
    def take(self, scan: AdcScan, drive: Drive) -> None:
        """Publish what the sensor says in one scan."""

    def _details(self) -> dict[str, object]:
        return {
            "scans_missed": self._account.lost,
            "scans_with_a_fault": self._faults,
            **{f"health_{flag.names[0]}": count for flag, count in self._flagged.items()},
        }

    def _tell_health(self) -> None:
        seen, self._seen = self._seen, Health(0)
        if not self._ready or self._faults or seen == self._told:
            return
        self._told = seen
        if seen:
            what = "; ".join(f"{flag.names[0]}: the sensor {ADVICE[flag]}" for flag in seen)
            self.get_logger().warning(what)
            self.diagnostics.warn(what)
        else:
            self.get_logger().info("the sensor looks sound again")
            self.diagnostics.ready()
