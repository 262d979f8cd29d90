# SPDX-License-Identifier: Apache-2.0
"""Node of one pressure sensor: scans in, gauge pressure and depth out, a service to zero it."""

from __future__ import annotations

from sensor_msgs.msg import FluidPressure
from std_srvs.srv import Trigger
from towtank_interfaces.msg import AdcScan, Depth
from towtank_node import topics
from towtank_node.endpoints import publisher, server
from towtank_node.names import MEASURED, pressure_node
from towtank_node.parameters import Parameter
from towtank_node.services import ZERO
from towtank_node.stamps import set_stamp, stamp_ns
from towtank_rig.instruments import PressureSensorName

from towtank_daq.encoder import Drive
from towtank_daq.pressure import PressureSensor, Zero, ZeroingError
from towtank_daq.scan_node import ScanNode
from towtank_daq.sensor_health import PressureHealth

_PARAMETERS = (
    Parameter("zero_scans", int, "scans that zeroing averages", 200, minimum=10, maximum=10_000),
)


_SENSORS: dict[str, PressureSensorName] = {
    "fish": "fish_pressure",
    "depressor": "depressor_pressure",
}


class PressureNode(ScanNode):
    """Ready once enough scans have come to be zeroed.

    body: where the sensor is, fish or depressor.
    """

    def __init__(self, body: str) -> None:
        super().__init__(pressure_node(body), _PARAMETERS)
        sensor = _SENSORS[body]
        self._sensor = PressureSensor(self.rig, self.board, sensor, self.parameters.zero_scans)
        self._health = PressureHealth(self.rig, self.board, sensor)
        self._pressure, self._depth = FluidPressure(), Depth()
        self._pressure.header.frame_id = self._depth.header.frame_id = sensor
        self._pressures = publisher(self, topics.PRESSURE.within(MEASURED, body))
        self._depths = publisher(self, topics.DEPTH.within(MEASURED, body))
        self._zeroed = ""
        if kept := self.kept_zero.read():
            self._sensor.restore(Zero(**kept["zero"]))
            self._zeroed = kept["zeroed"]
        server(self, ZERO.of("~"), self._on_zero)

    def take(self, scan: AdcScan, drive: Drive) -> None:
        codes = scan.codes.tolist()
        reading = self._sensor.process(codes, scan.valid_mask, drive)
        health = self._health.update(codes, scan.valid_mask, scan.crank_count, scan.count_epoch)
        self.note_health(health)
        sampled_ns = stamp_ns(scan.header.stamp) + int(scan.channel_delay_ns[self._sensor.channel])
        pressure, depth = self._pressure, self._depth
        set_stamp(pressure.header.stamp, sampled_ns)
        set_stamp(depth.header.stamp, sampled_ns)
        pressure.fluid_pressure = reading.pressure
        pressure.variance = reading.pressure_uncertainty**2
        depth.depth = reading.depth
        depth.standard_uncertainty = reading.depth_uncertainty
        depth.type_a_uncertainty = reading.depth_type_a
        depth.type_b_uncertainty = reading.depth_type_b
        depth.u95 = reading.depth_u95
        depth.valid = reading.valid
        depth.zeroed = self._sensor.zeroed
        depth.zero_depth = self._sensor.zero_depth
        depth.health.flags = int(health)
        self._pressures.publish(pressure)
        self._depths.publish(depth)
        if self._sensor.can_be_zeroed:
            self.ready()

    def _details(self) -> dict[str, object]:
        """Also how it was zeroed last: the service's answer may get lost."""
        return {**super()._details(), "zeroed": self._zeroed}

    def _on_zero(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            with self.one_at_a_time:
                self._zeroed = response.message = self._sensor.zero()
            self.keep_zero(zero=self._sensor.zero_taken._asdict(), zeroed=self._zeroed)
            response.success = True
            self.get_logger().info(response.message)
        except ZeroingError as error:
            response.message = str(error)
            self.get_logger().warning(response.message)
        return response
