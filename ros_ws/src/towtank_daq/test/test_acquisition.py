# SPDX-License-Identifier: Apache-2.0
"""The process of acquisition: scans handed over in memory, faults of one sensor, kept zeros."""

import itertools
import math
import os
import subprocess
import threading
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from towtank_daq import acquisition
from towtank_daq.pressure import ZeroingError
from towtank_daq.sensors import Sensors
from towtank_interfaces.msg import AdcScan, Depth
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node import names, topics
from towtank_node.endpoints import client, subscription
from towtank_node.services import SET_CRANK_SPEED

ROOT = Path(__file__).parents[4]
RIG = ROOT / "hardware" / "rigs" / "nit_calicut_2012.yaml"
BUILD = ROOT / "build" / "firmware"
SUCCESS = TransitionCallbackReturn.SUCCESS
DELAYS_NS = [-3_364_380, -2_272_257, -8_268_653, -7_176_531, -6_084_409, 2_096_232]
SPEED_SCANS = 11
"""They span half the window of a velocity, which is known from then on."""
ZERO_SCANS = 10


@pytest.fixture
def ros(monkeypatch):
    """Inits rclpy with parameters, and shuts it down."""

    def init(**parameters) -> None:
        given = {"rig": RIG, **parameters}
        arguments = itertools.chain.from_iterable(("-p", f"{k}:={v}") for k, v in given.items())
        rclpy.try_shutdown()
        rclpy.init(args=["--ros-args", *arguments])

    yield init
    rclpy.try_shutdown()


def scan_of(number: int, crank: int, carriage: int, epoch: int = 1) -> AdcScan:
    """A sound scan; the fish's bridge at 12 mV, the depressor's at 16 mV, and 1 g upwards."""
    scan = AdcScan(sequence=number, board_ticks=20_000 * number)
    scan.configured_mask = scan.valid_mask = 0x3F
    scan.header.stamp.sec, scan.header.stamp.nanosec = divmod(10**15 + 10**7 * number, 10**9)
    bridges = [round(2**23 * (35.96 * volts / 2.5 + 1)) for volts in (0.012, 0.016)]
    axes = [round(2**24 * volts / 3.3) for volts in (1.65, 1.65, 2.31)]
    codes = [*bridges, *axes, round(2**24 * 2.0 / 2.5)]
    scan.codes = [code + number % 2 for code in codes]
    scan.channel_delay_ns = DELAYS_NS
    scan.crank_count, scan.carriage_count, scan.count_epoch = crank, carriage, epoch
    return scan


class Published:
    """What the sensors' nodes publish, by topic, taken where they hand it to the middleware."""

    def __init__(self, sensors: Sensors, monkeypatch) -> None:
        self.depths: list[tuple[float, bool, float]] = []
        self.positions: list[list[float]] = []
        self.imus = 0
        self.sensors = sensors
        fish, _, inclinometer, encoder = sensors.nodes
        monkeypatch.setattr(fish._depths, "publish", self._on_depth)
        monkeypatch.setattr(encoder._publisher, "publish", self._on_joints)
        monkeypatch.setattr(inclinometer._imus, "publish", self._on_imu)

    def _on_depth(self, message: Depth) -> None:
        self.depths.append((message.depth, message.zeroed, message.zero_depth))

    def _on_joints(self, message: JointState) -> None:
        self.positions.append(list(message.position))

    def _on_imu(self, message: Imu) -> None:
        self.imus += 1

    def take(self, numbers, per_scan: int = 10, epoch: int = 1) -> None:
        for number in numbers:
            self.sensors.take(scan_of(number, per_scan * number, 2 * per_scan * number, epoch))

    def close(self) -> None:
        for node in self.sensors.nodes:
            node.destroy_node()


def zero(node) -> None:
    """As by the node's service."""
    assert node._on_zero(Trigger.Request(), Trigger.Response()).success


def test_a_fault_in_one_sensor_is_told_and_the_others_go_on(ros, monkeypatch):
    """Nothing is raised into the thread that hands the scans over: it serves the drive, too."""
    ros(zero_scans=ZERO_SCANS)
    published = Published(Sensors(), monkeypatch)
    fish, depressor, inclinometer, encoder = published.sensors.nodes
    published.take(range(5))
    sound = fish._sensor.process

    def faulty(codes, valid_mask, drive):
        raise LookupError("no such speed")

    fish._sensor.process = faulty
    published.take(range(5, 15))
    assert (len(published.depths), len(published.positions), published.imus) == (5, 15, 15)
    assert fish.diagnostics._level == DiagnosticStatus.ERROR
    assert "LookupError('no such speed')" in fish.diagnostics._message
    assert fish._details()["scans_with_a_fault"] == 10
    for node in (depressor, inclinometer, encoder):
        assert node.diagnostics._level == DiagnosticStatus.OK
        assert node._details()["scans_with_a_fault"] == 0
    # What it says later does not hide that there was a fault
    fish._sensor.process = sound
    published.take(range(15, 40))
    assert len(published.depths) == 30
    assert fish.diagnostics._level == DiagnosticStatus.ERROR
    published.close()


def test_without_the_drives_motion_the_sensors_go_on(ros, monkeypatch):
    """A fault in the encoders' node is the encoders': what the drive does is unknown then."""
    ros()
    published = Published(Sensors(), monkeypatch)
    encoder = published.sensors.encoder
    published.take(range(SPEED_SCANS))
    assert not math.isnan(published.depths[-1][0])

    def faulty(*arguments):
        raise ArithmeticError

    monkeypatch.setattr(encoder._watch, "update", faulty)
    published.take(range(SPEED_SCANS, SPEED_SCANS + 3))
    assert published.imus == SPEED_SCANS + 3
    assert math.isnan(published.depths[-1][0])
    assert encoder.diagnostics._level == DiagnosticStatus.ERROR
    assert published.sensors.nodes[0].diagnostics._level == DiagnosticStatus.OK
    published.close()


def test_zeros_outlive_the_process(ros, monkeypatch, tmp_path):
    """One that is started again goes on from the same origins of the shafts, which turned on
    meanwhile, and from the same places of zeroing; after a reset of the board's counts the
    positions stay unknown."""
    ros(zero_scans=ZERO_SCANS, zeros=tmp_path / "zeros")
    before = Published(Sensors(), monkeypatch)
    fish = before.sensors.nodes[0]
    before.take(range(100, 100 + SPEED_SCANS + ZERO_SCANS))
    zero(fish)
    before.take([130])
    before.close()
    assert before.positions[0][:2] == [0.0, 0.0]
    assert before.depths[-1][1]

    again = Published(Sensors(), monkeypatch)
    assert again.sensors.nodes[0]._details()["zeroed"] == fish._details()["zeroed"] != ""
    again.take(range(300, 300 + SPEED_SCANS))
    crank, carriage = again.positions[0][:2]
    assert crank == pytest.approx(10 * (300 - 100) * 2 * math.pi / 4096)
    assert carriage == pytest.approx(20 * (300 - 100) * 0.5 / 4096)
    assert again.depths[-1][1:] == before.depths[-1][1:]
    assert again.depths[-1][0] == pytest.approx(before.depths[-1][0], abs=1e-4)  # a code or two
    zero(again.sensors.encoder)
    again.take([400])
    assert again.positions[-1][:2] == [0.0, 0.0]
    again.close()

    third = Published(Sensors(), monkeypatch)
    third.take([500])
    assert third.positions[0][0] == pytest.approx(10 * 100 * 2 * math.pi / 4096)
    assert third.sensors.encoder._crank_motion.zeroed
    third.take([501], epoch=2)
    assert all(math.isnan(position) for position in third.positions[-1])
    third.close()

    last = Published(Sensors(), monkeypatch)
    last.take([502], epoch=2)
    assert all(math.isnan(position) for position in last.positions[-1])
    last.close()


def test_without_a_folder_nothing_is_kept(ros, monkeypatch, tmp_path):
    ros()
    monkeypatch.chdir(tmp_path)
    for number in (100, 200):
        published = Published(Sensors(), monkeypatch)
        published.take([number])
        assert published.positions[0][:2] == [0.0, 0.0]
        published.close()
    assert list(tmp_path.iterdir()) == []


def test_a_zero_that_cannot_be_kept_is_taken_all_the_same(ros, monkeypatch, tmp_path):
    ros(zero_scans=ZERO_SCANS, zeros=tmp_path / "zeros")
    published = Published(Sensors(), monkeypatch)
    (tmp_path / "zeros").write_text("a file where the folder should be")
    published.take(range(SPEED_SCANS + ZERO_SCANS))
    zero(published.sensors.nodes[0])
    assert published.sensors.nodes[0].diagnostics._level == DiagnosticStatus.OK
    published.close()


@pytest.mark.timeout(60)
def test_zeroing_and_scans_do_not_meet(ros, monkeypatch):
    """Zeroing averages the last scans in one thread while another brings new ones."""
    ros(zero_scans=200)
    published = Published(Sensors(), monkeypatch)
    fish = published.sensors.nodes[0]
    published.take(range(250))
    ended = threading.Event()

    def scans():
        for number in itertools.count(250):
            if ended.is_set():
                return
            fish.on_scan(
                scan_of(number, 0, 0), published.sensors.encoder.drive_at(scan_of(0, 0, 0))
            )

    thread = threading.Thread(target=scans)
    thread.start()
    try:
        for _ in range(300):
            zero(fish)
    except (RuntimeError, ZeroingError) as error:
        pytest.fail(f"zeroing met a scan: {error!r}")
    finally:
        ended.set()
        thread.join()
    assert fish._details()["scans_with_a_fault"] == 0
    published.close()


class Process:
    """The nodes of the process as it makes them, in its executor, and a listener."""

    def __init__(self) -> None:
        self.nodes = acquisition.make_nodes()
        self.board = self.nodes[0]
        self.listener = rclpy.create_node("listener")
        self.executor = EventsExecutor()
        for node in (*self.nodes, self.listener):
            self.executor.add_node(node)
        self.statuses: dict[str, DiagnosticStatus] = {}
        subscription(self.listener, topics.DIAGNOSTICS, self._on_status)

    def _on_status(self, array: DiagnosticArray) -> None:
        self.statuses |= {status.name: status for status in array.status}

    def hear(self, topic: topics.Topic) -> list:
        heard: list = []
        subscription(self.listener, topic, heard.append)
        return heard

    def spin_until(self, condition) -> None:
        """The test's time limit ends what never comes true."""
        while not condition():
            self.executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        self.board.close()
        for node in (*self.nodes, self.listener):
            getattr(node, "close", lambda: None)()
            node.destroy_node()
        self.executor.shutdown()


@pytest.fixture
def virtual_board(tmp_path):
    """A virtual board with a motor, whose port is tmp_path/board."""
    process = subprocess.Popen(
        [
            *(BUILD / "vboard" / "towtank-vboard", "--elf", BUILD / "towtank_board.elf"),
            *("--pty-link", tmp_path / "board", "--bench-socket", tmp_path / "bench"),
            "--crank-motor",
        ],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ,
    )
    assert process.stdout.readline().startswith("ready")
    yield process
    process.kill()
    process.communicate()


@pytest.mark.real_time
@pytest.mark.timeout(90)
def test_a_fault_in_a_sensor_costs_no_scan_and_leaves_the_drive_served(
    ros, virtual_board, tmp_path
):
    """The board's node goes on to publish every scan that comes, the other sensors' nodes what they
    make of it, and the crank's drive obeys; the end of the board is told as ever."""
    ros(port=tmp_path / "board", patience_s=0.0)
    process = Process()
    scans = process.hear(topics.SCANS)
    joints = process.hear(topics.MEASURED_JOINTS)
    states = process.hear(topics.CRANK_DRIVE)
    drive = client(process.listener, SET_CRANK_SPEED)
    inclinometer = next(
        node for node in process.nodes if node.get_fully_qualified_name() == names.INCLINOMETER_NODE
    )
    assert process.board.trigger_configure() == SUCCESS
    assert process.board.trigger_activate() == SUCCESS
    process.spin_until(lambda: len(joints) > 20 and drive.service_is_ready())

    def faulty(*arguments):
        raise ZeroDivisionError("in a conversion")

    inclinometer._sensor.process = faulty
    begun = len(joints)
    process.spin_until(
        lambda: process.statuses[names.INCLINOMETER_NODE].level == DiagnosticStatus.ERROR
    )
    told = process.statuses[names.INCLINOMETER_NODE].message
    assert "ZeroDivisionError('in a conversion')" in told
    request = SetCrankSpeed.Request(action=SetCrankSpeed.Request.RUN, crank_rate=1.0)
    asked = drive.call_async(request)
    process.spin_until(asked.done)
    assert asked.result().success, asked.result().message
    process.spin_until(lambda: states and states[-1].crank_rate > 0.5)
    process.spin_until(lambda: len(joints) > begun + 100)
    assert process.statuses[names.BOARD_NODE].level == DiagnosticStatus.OK
    # The listener may miss messages on a busy computer: what it has of both belongs together
    first, last = joints[0].header.stamp, joints[-1].header.stamp
    between = [
        (scan.header.stamp.sec, scan.header.stamp.nanosec)
        for scan in scans
        if (first.sec, first.nanosec)
        <= (scan.header.stamp.sec, scan.header.stamp.nanosec)
        <= (last.sec, last.nanosec)
    ]
    heard = {(message.header.stamp.sec, message.header.stamp.nanosec) for message in joints}
    assert len(heard & set(between)) > 100
    details = process.board._details()
    virtual_board.kill()
    process.spin_until(lambda: process.statuses[names.BOARD_NODE].level == DiagnosticStatus.ERROR)
    assert "is gone: plug the board in" in process.statuses[names.BOARD_NODE].message
    assert details["scans_lost"] == 0
    process.close()
