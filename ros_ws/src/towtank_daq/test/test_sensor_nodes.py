# SPDX-License-Identifier: Apache-2.0
"""The sensor nodes: a scan in, messages out with the right stamps, units and flags."""

import itertools
import math
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from patient_qos import patiently
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger
from towtank_daq.sensors import make_sensors
from towtank_interfaces.msg import AdcScan, SensorHealth
from towtank_node import names, topics
from towtank_node.endpoints import publisher, subscription

RIG = Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
START_S = 1_000_000
ZERO_SCANS = 10
SPEED_SCANS = 11
"""They span half the window of a velocity, which is known from then on."""
DRIVE_SCANS = 37
"""So many until the carriage's acceleration is known, too."""


FISH = names.pressure_node(names.FISH)
DEPRESSOR = names.pressure_node(names.DEPRESSOR)
INCLINOMETER = names.INCLINOMETER_NODE
ENCODER = names.ENCODER_NODE


class Bench:
    """The sensors' nodes, one of them under test, and one that sends scans and hears answers."""

    def __init__(self, name: str, **parameters) -> None:
        given = {"rig": RIG, **parameters}
        arguments = itertools.chain.from_iterable(("-p", f"{k}:={v}") for k, v in given.items())
        rclpy.init(args=["--ros-args", *arguments])
        self.sensors = make_sensors()
        self.node = next(n for n in self.sensors if n.get_fully_qualified_name() == name)
        self.peer = rclpy.create_node("peer")
        self.heard: dict[str, list] = {}
        self.executor = SingleThreadedExecutor()
        for node in (*self.sensors, self.peer):
            self.executor.add_node(node)
        self.publisher = publisher(self.peer, topics.SCANS)
        self.sequence = -1
        self.statuses: list[DiagnosticStatus] = []
        subscription(self.peer, topics.DIAGNOSTICS, self._on_status)

    def _on_status(self, array: DiagnosticArray) -> None:
        name = self.node.get_fully_qualified_name()
        self.statuses += [status for status in array.status if status.name == name]

    def hear(self, topic: topics.Topic) -> list:
        messages = self.heard[topic.name] = []
        subscription(self.peer, patiently(topic), messages.append)
        return messages

    def connected(self) -> None:
        """Spin until all have found each other."""
        while not (
            self.publisher.get_subscription_count() == 1
            and all(self.peer.count_publishers(topic) for topic in self.heard)
            and self.statuses
        ):
            self.executor.spin_once(timeout_sec=0.05)

    def send(self, codes, valid_mask=0x3F, crank=0, carriage=0, epoch=1) -> AdcScan:
        self.sequence += 1
        scan = AdcScan(sequence=self.sequence, configured_mask=0x3F, valid_mask=valid_mask)
        scan.header.stamp.sec = START_S
        scan.header.stamp.nanosec = 10_000_000 * self.sequence
        scan.codes = codes
        scan.channel_delay_ns = [
            -3_364_380,
            -2_272_257,
            -8_268_653,
            -7_176_531,
            -6_084_409,
            2_096_232,
        ]
        scan.crank_count = crank
        scan.carriage_count = carriage
        scan.count_epoch = epoch
        self.publisher.publish(scan)
        return scan

    def settle(self, codes, heard: list, scans: int) -> AdcScan:
        """Send so many scans with standing shafts, and wait for what comes of them.

        Codes are live ones, up by one in every second scan, but not in the first and the last.
        """
        for k in range(scans):
            scan = self.send([code + k % 2 if code else 0 for code in codes])
        self.spin_until(lambda: len(heard) == scans)
        return scan

    def spin_until(self, condition) -> None:
        while not condition():
            self.executor.spin_once(timeout_sec=0.1)

    def call_zero(self) -> Trigger.Response:
        client = self.peer.create_client(Trigger, f"{self.node.get_fully_qualified_name()}/zero")
        self.spin_until(client.service_is_ready)
        future = client.call_async(Trigger.Request())
        self.spin_until(future.done)
        return future.result()

    def values(self) -> dict[str, str]:
        """What the node's last status says."""
        return {pair.key: pair.value for pair in self.statuses[-1].values}

    def close(self) -> None:
        for node in (*self.sensors, self.peer):
            node.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture
def bench():
    """Makes a bench and takes it down."""
    made = []

    def make(*arguments, **parameters) -> Bench:
        made.append(Bench(*arguments, **parameters))
        return made[-1]

    yield make
    for item in made:
        item.close()


def time_ns(stamp) -> int:
    return stamp.sec * 10**9 + stamp.nanosec


def bridge(volts: float) -> int:
    return round(2**23 * (35.96 * volts / 2.5 + 1))


def single_ended(volts: float) -> int:
    return round(2**24 * volts / 2.5)


def ratiometric(volts: float) -> int:
    return round(2**24 * volts / 3.3)


@pytest.mark.timeout(60)
def test_pressure_node(bench):
    """16 mV at the bridge is 20 kPa; the depressor's channel is the second."""
    made = bench(DEPRESSOR, zero_scans=ZERO_SCANS)
    pressures = made.hear(topics.DEPRESSOR_PRESSURE)
    depths = made.hear(topics.DEPRESSOR_DEPTH)
    made.connected()
    scan = made.settle([0, bridge(0.016), 0, 0, 0, 0], depths, SPEED_SCANS)
    made.spin_until(lambda: len(pressures) == SPEED_SCANS)
    pressure, depth = pressures[-1], depths[-1]
    assert pressure.fluid_pressure == pytest.approx(20_000, abs=0.01)
    weight = made.node.rig.water.density.value * made.node.rig.water.gravity.value
    assert depth.depth == pytest.approx(20_000 / weight, abs=1e-6)
    assert pressure.variance == pytest.approx((weight * depth.standard_uncertainty) ** 2, rel=1e-3)
    assert (depth.valid, depth.zeroed) == (True, False)
    parts = (depth.type_a_uncertainty, depth.type_b_uncertainty)
    assert depth.standard_uncertainty == pytest.approx(math.hypot(*parts))
    assert depth.standard_uncertainty < depth.u95 < 2 * depth.standard_uncertainty
    assert math.isnan(depth.zero_depth)
    assert depth.health.flags == SensorHealth.EXCITATION  # its code is zero here
    # Until the carriage's speed is known, a depth is not, but the pressure is
    assert all(math.isnan(early.depth) and not early.valid for early in depths[:-1])
    assert pressures[0].fluid_pressure == pressure.fluid_pressure
    assert pressures[0].variance == pressure.variance
    for message in (pressure, depth):
        assert message.header.frame_id == "depressor_pressure"
        assert time_ns(message.header.stamp) == time_ns(scan.header.stamp) - 2_272_257


@pytest.mark.timeout(60)
def test_zeroing_by_service(bench):
    """Refused as long as scans are few; the node is ready when it can be zeroed."""
    made = bench(FISH, zero_scans=ZERO_SCANS)
    depths = made.hear(topics.FISH_DEPTH)
    made.connected()
    made.settle([bridge(0.012), 0, 0, 0, 0, 0], depths, SPEED_SCANS)
    before = depths[-1]
    assert math.isnan(before.zero_depth)
    refused = made.call_zero()
    assert not refused.success
    assert f"only 1 of {ZERO_SCANS} good scans" in refused.message
    assert (made.values()["state"], made.values()["zeroed"]) == ("not ready", "")
    for _ in range(ZERO_SCANS):
        made.send([bridge(0.012), 0, 0, 0, 0, 0])
    made.spin_until(lambda: made.values()["state"] == "ready")
    done = made.call_zero()
    assert done.success
    assert f"mean of {ZERO_SCANS} scans" in done.message
    made.spin_until(lambda: made.values()["zeroed"] == done.message)  # where the answer gets lost
    depths.clear()
    made.send([bridge(0.012), 0, 0, 0, 0, 0])
    made.spin_until(lambda: depths)
    assert depths[0].zeroed
    assert depths[0].zero_depth == pytest.approx(before.depth, abs=1e-9)
    assert depths[0].depth == pytest.approx(0.0, abs=1e-9)
    weight = made.node.rig.water.density.value * made.node.rig.water.gravity.value
    assert depths[0].zero_depth == pytest.approx(15_000 / weight, abs=1e-6)


@pytest.mark.timeout(60)
def test_pressure_of_a_bad_scan(bench):
    made = bench(FISH)
    depths = made.hear(topics.FISH_DEPTH)
    made.connected()
    made.settle([bridge(0.012), 0, 0, 0, 0, 0], depths, SPEED_SCANS)
    made.send([0] * 6, valid_mask=0x3E)
    made.spin_until(lambda: len(depths) == SPEED_SCANS + 1)
    assert not depths[-1].valid
    assert math.isnan(depths[-1].depth)


@pytest.mark.timeout(60)
def test_inclinometer_node(bench):
    """Bow up by asin(0.5): half a g forward (0.33 V), the rest upwards."""
    made = bench(INCLINOMETER)
    imus = made.hear(topics.FISH_IMU)
    inclinations = made.hear(topics.INCLINATION)
    made.connected()
    volts = (1.65 + 0.33, 1.65, 1.65 + 0.66 * math.cos(math.pi / 6))
    scan = made.settle([0, 0, *map(ratiometric, volts), 0], inclinations, DRIVE_SCANS)
    made.spin_until(lambda: len(imus) == DRIVE_SCANS)
    imu, inclination = imus[-1], inclinations[-1]
    assert inclination.pitch == pytest.approx(-math.pi / 6, abs=1e-5)
    assert inclination.roll == pytest.approx(0.0, abs=1e-5)
    assert inclination.valid
    for angle in ("pitch", "roll"):
        combined, a, b, u95 = (
            getattr(inclination, f"{angle}_{kind}")
            for kind in ("standard_uncertainty", "type_a_uncertainty", "type_b_uncertainty", "u95")
        )
        assert combined == pytest.approx(math.hypot(a, b))
        assert combined < u95 < 2.1 * combined
    assert inclination.health.flags == 0
    # What the carriage's acceleration does to an angle is not known at once; the angle is
    assert all(math.isnan(early.pitch_u95) for early in inclinations[:-1])
    assert inclinations[0].pitch == inclination.pitch and inclinations[0].valid
    covariance = imu.linear_acceleration_covariance.reshape(3, 3)
    assert (covariance == covariance.T).all()
    assert 0.03 < math.sqrt(covariance[0, 0]) < 0.08
    assert imu.linear_acceleration.x == pytest.approx(9.80665 / 2, abs=1e-3)
    assert imu.linear_acceleration.y == pytest.approx(0.0, abs=1e-3)
    assert imu.orientation_covariance[0] == -1
    assert imu.angular_velocity_covariance[0] == -1
    assert imu.header.frame_id == "fish"
    for message in (imu, inclination):
        # the mean of the three channels' instants is that of the middle one
        stamp = time_ns(message.header.stamp) - time_ns(scan.header.stamp)
        assert stamp == pytest.approx(-7_176_531, abs=1)
    assert made.values()["state"] == "ready"


@pytest.mark.timeout(60)
def test_encoder_node(bench):
    """100 counts of 4096 a scan on the crank, 200 on the wheel of 0.5 m; counts start anywhere.
    Of eleven scans in 0.1 s the first and the last state their uncertainty."""
    made = bench(ENCODER)
    joints = made.hear(topics.MEASURED_JOINTS)
    motions = made.hear(topics.CRANK_MOTION)
    made.connected()
    for k in range(SPEED_SCANS):
        scan = made.send([0] * 6, crank=2**40 + 100 * k, carriage=-7 + 200 * k)
    made.spin_until(lambda: len(joints) == SPEED_SCANS and len(motions) == 2)
    last = joints[-1]
    assert all(math.isnan(rate) for early in joints[:-1] for rate in early.velocity)
    assert list(last.name) == ["crank", "carriage", "tow_point"]
    assert last.position[0] == pytest.approx(1000 * 2 * math.pi / 4096)
    assert last.position[1] == pytest.approx(2000 * 0.5 / 4096)
    assert last.velocity[0] == pytest.approx(10_000 * 2 * math.pi / 4096)
    assert last.velocity[1] == pytest.approx(20_000 * 0.5 / 4096)
    # The rig's crank moves the tow point by 60 mm times the sine of its angle
    angle = 1000 * 2 * math.pi / 4096
    assert last.position[2] == pytest.approx(0.06 * math.sin(angle))
    rate = 10_000 * 2 * math.pi / 4096
    assert last.velocity[2] == pytest.approx(0.06 * math.cos(angle) * rate)
    assert last.header.stamp == scan.header.stamp
    assert list(joints[0].position) == [0.0, 0.0, 0.0]
    motion = motions[-1]
    assert motion.header.stamp == scan.header.stamp
    assert (motion.angle, motion.heave) == (last.position[0], last.position[2])
    for name, slope in (("angle", 1.0), ("heave", 0.06 * math.cos(angle))):
        combined, a, b, u95 = (
            getattr(motion, f"{name}_{kind}")
            for kind in ("standard_uncertainty", "type_a_uncertainty", "type_b_uncertainty", "u95")
        )
        assert a == pytest.approx(slope * 2 * math.pi / 4096 / math.sqrt(12))
        assert b >= slope * 0.05 / math.sqrt(3)  # the rig's limit of the zero
        assert combined == pytest.approx(math.hypot(a, b))
        assert combined < u95 < 2.0 * combined
    assert not motion.zeroed
    assert made.call_zero().success
    made.send([0] * 6, crank=5, carriage=5)
    made.spin_until(lambda: len(joints) == SPEED_SCANS + 1)
    assert list(joints[-1].position) == [0.0, 0.0, 0.0]
    made.spin_until(lambda: motions[-1].zeroed)


@pytest.mark.timeout(60)
def test_encoder_node_after_a_reset_of_the_board(bench):
    """Positions are not known, and a warning says so, until they are zeroed."""
    made = bench(ENCODER)
    joints = made.hear(topics.MEASURED_JOINTS)
    made.connected()
    made.send([0] * 6, crank=1000)
    for k in range(SPEED_SCANS):
        made.send([0] * 6, crank=100 * k, carriage=200 * k, epoch=2)
    made.spin_until(lambda: len(joints) == 1 + SPEED_SCANS)
    assert list(joints[0].position) == [0.0, 0.0, 0.0]
    assert all(math.isnan(x) for message in joints[1:] for x in message.position)
    assert joints[-1].velocity[0] == pytest.approx(10_000 * 2 * math.pi / 4096)
    made.spin_until(lambda: made.statuses[-1].level == DiagnosticStatus.WARN)
    assert made.statuses[-1].message == (
        "the board was reset: the positions of crank and carriage are not known; bring both to "
        "where they are zero and call /measured/encoder/zero"
    )
    assert made.call_zero().success
    made.send([0] * 6, crank=2000, carriage=5, epoch=2)
    made.spin_until(lambda: len(joints) == 2 + SPEED_SCANS)
    assert list(joints[-1].position) == [0.0, 0.0, 0.0]
    made.spin_until(lambda: made.statuses[-1].level == DiagnosticStatus.OK)


@pytest.mark.timeout(60)
def test_missed_scans_are_reported(bench):
    made = bench(ENCODER)
    joints = made.hear(topics.MEASURED_JOINTS)
    made.connected()
    made.send([0] * 6)
    made.sequence += 3
    made.send([0] * 6)
    made.spin_until(lambda: len(joints) == 2)
    made.spin_until(lambda: made.values()["scans_missed"] == "3")


@pytest.mark.timeout(60)
def test_diagnostics_tell_what_looks_wrong_and_that_it_is_over(bench):
    """A bridge at the end of its amplifier's range, then sound again."""
    made = bench(FISH, zero_scans=ZERO_SCANS)
    depths = made.hear(topics.FISH_DEPTH)
    made.connected()

    def send(volts, count):
        for _ in range(count):
            made.send([bridge(volts) + made.sequence % 2, 0, 0, 0, 0, single_ended(2.0)])

    def level():
        return made.statuses[-1].level

    send(0.012, SPEED_SCANS - 1 + ZERO_SCANS)
    made.spin_until(lambda: made.values()["state"] == "ready")
    assert level() == DiagnosticStatus.OK
    send(0.055, 3)
    made.spin_until(lambda: level() == DiagnosticStatus.WARN)
    assert "open: the sensor reads what an intact sensor cannot give" in (made.statuses[-1].message)
    assert [depth.health.flags for depth in depths[-3:]] == [SensorHealth.OPEN] * 3
    made.spin_until(lambda: level() == DiagnosticStatus.OK)
    assert made.values()["health_open"] == "3"
    assert made.values()["state"] == "ready"
