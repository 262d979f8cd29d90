# SPDX-License-Identifier: Apache-2.0
"""Node of the fish's accelerometer: scans in, specific force and inclination out."""

from __future__ import annotations

from sensor_msgs.msg import Imu
from towtank_interfaces.msg import AdcScan, Inclination
from towtank_node import names, topics
from towtank_node.endpoints import publisher
from towtank_node.stamps import set_stamp, stamp_ns

from towtank_daq.encoder import Drive
from towtank_daq.inclinometer import Inclinometer
from towtank_daq.scan_node import ScanNode
from towtank_daq.sensor_health import AccelerometerHealth


class InclinometerNode(ScanNode):
    """The three axes are sampled one after another; the stamp is the mean of their instants."""

    def __init__(self) -> None:
        super().__init__(names.INCLINOMETER_NODE)
        self._sensor = Inclinometer(self.rig, self.board)
        self._health = AccelerometerHealth(self.rig, self.board)
        self._imu, self._inclination = Imu(), Inclination()
        self._covariance: tuple[float, ...] = ()
        self._imu.header.frame_id = names.FISH
        self._inclination.header.frame_id = names.ACCELEROMETER_FRAME
        self._imu.orientation_covariance[0] = -1.0  # REP-145: not measured
        self._imu.angular_velocity_covariance[0] = -1.0
        self._imus = publisher(self, topics.FISH_IMU)
        self._inclinations = publisher(self, topics.INCLINATION)

    def take(self, scan: AdcScan, drive: Drive) -> None:
        codes, delays_ns = scan.codes.tolist(), scan.channel_delay_ns.tolist()
        reading = self._sensor.process(codes, scan.valid_mask, drive)
        health = self._health.update(codes, scan.valid_mask)
        self.note_health(health)
        channels = self._sensor.channels
        delay_ns = sum(delays_ns[channel] for channel in channels) // len(channels)
        sampled_ns = stamp_ns(scan.header.stamp) + delay_ns
        imu, inclination = self._imu, self._inclination
        set_stamp(imu.header.stamp, sampled_ns)
        set_stamp(inclination.header.stamp, sampled_ns)
        force = imu.linear_acceleration
        force.x, force.y, force.z = reading.specific_force
        if reading.force_covariance is not self._covariance:  # it changes seldom
            self._covariance = imu.linear_acceleration_covariance = reading.force_covariance
        inclination.pitch = reading.pitch
        inclination.roll = reading.roll
        uncertainty = reading.pitch_uncertainty
        inclination.pitch_standard_uncertainty = uncertainty.combined
        inclination.pitch_type_a_uncertainty = uncertainty.type_a
        inclination.pitch_type_b_uncertainty = uncertainty.type_b
        inclination.pitch_u95 = uncertainty.u95
        uncertainty = reading.roll_uncertainty
        inclination.roll_standard_uncertainty = uncertainty.combined
        inclination.roll_type_a_uncertainty = uncertainty.type_a
        inclination.roll_type_b_uncertainty = uncertainty.type_b
        inclination.roll_u95 = uncertainty.u95
        inclination.valid = reading.valid
        inclination.health.flags = int(health)
        self._imus.publish(imu)
        self._inclinations.publish(inclination)
        self.ready()
