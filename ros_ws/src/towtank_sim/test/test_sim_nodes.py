# SPDX-License-Identifier: Apache-2.0
"""Virtual tank (plant and bench) and twin as processes in a graph."""

from __future__ import annotations

import contextlib
import itertools
import math
import socket
import struct
import threading
import time
from array import array

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from towtank_interfaces.msg import CrankDrive
from towtank_interfaces.srv import SetCrankSpeed, SetDrive
from towtank_node import names, topics
from towtank_node.endpoints import client, publisher
from towtank_node.quick_stop import quick_stop
from towtank_node.services import SET_CRANK_SPEED, SET_DRIVE
from towtank_rig.conversion import carriage_encoder, depth_from_pressure, pressure_conversion
from towtank_sim.resolution import SEGMENTS

pytestmark = pytest.mark.slow

PERIOD_NS = 10_000_000
FRAME = struct.Struct("<IIq6d2d")


def stamp_of(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def rig_path(rig) -> str:
    return rig.source


class FakeBoard:
    """Listens as the virtual board does, in a thread of its own."""

    def __init__(self, path) -> None:
        self.path = str(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener.bind(self.path)
        self._listener.listen(1)
        self._bench: socket.socket | None = None
        self.frames: list[tuple] = []
        self.leads: list[int] = []  # of each frame when it was taken here, ns
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        with contextlib.suppress(OSError):  # closed
            self._bench, _ = self._listener.accept()
            while packet := self._bench.recv(4096):
                self.frames.append(FRAME.unpack(packet))
                self.leads.append(self.frames[-1][2] - time.monotonic_ns())

    def close(self) -> None:
        for each in (self._listener, self._bench):
            if each is not None:
                with contextlib.suppress(OSError):
                    each.shutdown(socket.SHUT_RDWR)  # wakes the thread
        self._thread.join()
        for each in (self._listener, self._bench):
            if each is not None:
                each.close()


@pytest.fixture
def board(tmp_path):
    board = FakeBoard(tmp_path / "bench")
    yield board
    board.close()


# ---------------------------------------------------------------------------------- plant


@pytest.mark.real_time
def test_plant_publishes_evenly_and_ahead_of_time(graph, nit_calicut, board):
    odometry = graph.collect(topics.PLANT_FISH)
    depressor = graph.collect(topics.PLANT_DEPRESSOR)
    imu = graph.collect(topics.PLANT_IMU)
    joints = graph.collect(topics.PLANT_JOINTS)
    cables = graph.collect(topics.PLANT_CABLES)
    leads = graph.collect(
        topics.PLANT_JOINTS,
        noted=lambda m: stamp_of(m) - graph.probe.get_clock().now().nanoseconds,
    )
    plant = graph.tank(rig=rig_path(nit_calicut), socket=board.path, lead_s=0.2)
    graph.spin_until(lambda: len(odometry) >= 150, "150 states of the plant")

    stamps = [stamp_of(message) for message in joints]
    # The machine may hold a process up, but no state is left out and none is stamped late.
    assert {later - earlier for earlier, later in itertools.pairwise(stamps)} == {PERIOD_NS}
    assert max(leads) <= 210_000_000  # the lead and a cycle
    assert max(leads) > 100_000_000
    for messages in (odometry, depressor, imu):
        # Of the topics one is heard before the other.
        states = {stamp_of(m) for m in messages[:100] if stamp_of(m) >= stamps[0]}
        assert len(states) > 10
        assert states <= set(stamps)
    distance = stamp_of(cables[1]) - stamp_of(cables[0])
    assert distance == 5 * PERIOD_NS

    fish = odometry[-1]
    assert (fish.header.frame_id, fish.child_frame_id) == ("tank", "fish")
    assert list(joints[-1].name) == ["crank", "carriage"]
    assert list(joints[-1].position) == [0.0, 0.0]
    assert depressor[-1].pose.pose.orientation.w == 1.0
    # At rest an accelerometer feels gravity alone, upwards, whatever the fish's attitude.
    force = imu[-1].linear_acceleration
    assert math.hypot(force.x, force.y, force.z) == pytest.approx(
        nit_calicut.water.gravity.value, rel=1e-6
    )
    # All lines meet: primary's end, depressor line's start and secondary's start are one point.
    cable = cables[-1]
    assert cable.line_names == ["primary", "depressor", "secondary"]
    assert sum(cable.segment_counts) == SEGMENTS
    assert len(cable.x) == SEGMENTS + 3  # each of the three lines has a node more
    assert len(cable.tension) == SEGMENTS
    first, second, _ = cable.segment_counts
    junction = [(cable.x[i], cable.z[i]) for i in (first, first + 1, first + second + 2)]
    assert junction[0] == junction[1] == junction[2]
    assert cable.z[0] == nit_calicut.tow_point.height.value
    assert plant.interrupt() == (0, "")


@pytest.mark.real_time
def test_plant_follows_drive_commands_and_refuses_bad_ones(graph, nit_calicut, board):
    joints = graph.collect(topics.PLANT_JOINTS)
    drive = client(graph.probe, SET_DRIVE)
    graph.tank(rig=rig_path(nit_calicut), socket=board.path)
    graph.spin_until(lambda: joints and drive.service_is_ready(), "the plant")

    def set_drive(carriage_speed, crank_rate, ramp_time):
        request = SetDrive.Request(
            carriage_speed=carriage_speed, crank_rate=crank_rate, ramp_time=ramp_time
        )
        return graph.call(drive, request)

    refused = set_drive(math.nan, 0.0, 1.0)
    assert not refused.success
    assert refused.message.startswith("carriage_speed")
    refused = set_drive(1.0, 3.0, 0.0)
    assert not refused.success
    assert refused.message.startswith("ramp_time")
    assert all(list(message.velocity) == [0.0, 0.0] for message in joints)

    accepted = set_drive(0.5, 2.0, 0.5)
    assert accepted.success
    graph.spin_until(lambda: joints[-1].velocity[1] == 0.5, "the carriage's speed")
    assert joints[-1].velocity[0] == 2.0
    # Half the ramp's time at full speed, since the ramp began.
    moving = [m for m in joints if m.velocity[1] > 0.0]
    start = stamp_of(moving[0]) - PERIOD_NS
    elapsed = (stamp_of(joints[-1]) - start) * 1e-9
    assert joints[-1].position[1] == pytest.approx(0.5 * (elapsed - 0.25), abs=1e-9)


@pytest.mark.real_time
def test_plants_crank_obeys_as_the_boards_does(graph, nit_calicut, board):
    """Same service, same state, same words, as far as an ideal motor can."""
    states = graph.collect(topics.CRANK_DRIVE)
    statuses = graph.collect(topics.DIAGNOSTICS)
    crank = client(graph.probe, SET_CRANK_SPEED)
    carriage = client(graph.probe, SET_DRIVE)
    graph.tank(rig=rig_path(nit_calicut), socket=board.path)
    graph.spin_until(
        lambda: states and crank.service_is_ready() and carriage.service_is_ready(), "the plant"
    )

    def ask(action, rate=0.0):
        return graph.call(crank, SetCrankSpeed.Request(action=action, crank_rate=rate))

    assert (states[-1].state, states[-1].trip) == (CrankDrive.STOPPED, CrankDrive.NONE)
    assert "give 5 to 60 rpm" in ask(SetCrankSpeed.Request.RUN, 7.0).message
    assert ask(SetCrankSpeed.Request.RUN, 2.0).success
    graph.spin_until(lambda: states[-1].crank_rate == 2.0, "the crank's speed")
    assert (states[-1].state, states[-1].target_rate) == (CrankDrive.RUNNING, 2.0)
    assert ask(SetCrankSpeed.Request.STOP).success
    graph.spin_until(lambda: states[-1].state == CrankDrive.STOPPED, "rest")
    assert CrankDrive.STOPPING in {state.state for state in states}

    request = SetDrive.Request(carriage_speed=0.5, crank_rate=2.0, ramp_time=0.5)
    assert graph.call(carriage, request).success
    graph.spin_until(lambda: states[-1].crank_rate == 2.0, "the crank's speed")
    assert ask(SetCrankSpeed.Request.EMERGENCY_STOP).success
    graph.spin_until(lambda: states[-1].state == CrankDrive.TRIPPED, "the trip")
    assert states[-1].trip == CrankDrive.EMERGENCY_STOP
    assert "clear the trip" in ask(SetCrankSpeed.Request.RUN, 2.0).message
    assert "clear the trip" in graph.call(carriage, request).message
    graph.spin_until(lambda: states[-1].crank_rate == 0.0, "rest")
    graph.spin_until(
        lambda: any(
            (status.name, status.level) == (names.CRANK_DRIVE_NODE, DiagnosticStatus.ERROR)
            for array in statuses
            for status in array.status
        ),
        "its word on the trip",
    )
    assert ask(SetCrankSpeed.Request.CLEAR_TRIP).success
    graph.spin_until(lambda: states[-1].state == CrankDrive.STOPPED, "cleared")
    assert "no action 9" in ask(9).message
    assert quick_stop(graph.probe.context.get_domain_id()) == ""
    graph.spin_until(lambda: states[-1].state == CrankDrive.TRIPPED, "the trip past ROS")


# ---------------------------------------------------------------------------------- bench


@pytest.mark.real_time
def test_bench_turns_the_plants_states_into_frames_before_their_time(graph, nit_calicut, board):
    odometry = graph.collect(topics.PLANT_DEPRESSOR)
    bench = graph.tank(rig=rig_path(nit_calicut), socket=board.path, lead_s=0.2, noise="none")
    graph.spin_until(lambda: len(board.frames) >= 100 and odometry, "100 bench frames")
    # The machine may hold up a process, and not all three for all of the 100 frames.
    assert max(board.leads) > 0

    magics, sequences, times = zip(*(frame[:3] for frame in board.frames), strict=True)
    assert set(magics) == {0x31425754}
    assert list(sequences) == list(range(len(sequences)))
    assert {b - a for a, b in itertools.pairwise(times)} == {PERIOD_NS}

    conversion = pressure_conversion(nit_calicut, "depressor_pressure")
    depth = depth_from_pressure(conversion.pressure(board.frames[-1][4]), nit_calicut.water)
    assert depth == pytest.approx(-odometry[-1].pose.pose.position.z, abs=1e-6)
    assert board.frames[-1][8] == nit_calicut.board.excitation.value
    assert bench.interrupt() == (0, "")


def test_bench_ends_with_one_line_when_the_board_goes(graph, nit_calicut, board):
    bench = graph.tank(rig=rig_path(nit_calicut), socket=board.path)
    graph.spin_until(lambda: len(board.frames) >= 5, "bench frames")
    board.close()
    status, errors = bench.wait()
    assert status == 1
    assert errors.startswith(f"error: bench socket {board.path}: the virtual board is gone")
    assert errors.count("\n") == 1


@pytest.mark.parametrize(
    ("prepare", "cause"),
    [
        (lambda path: None, "No such file"),
        (lambda path: path.write_text("no socket"), "Connection refused"),
    ],
)
def test_bench_without_a_board_ends_with_one_line(graph, nit_calicut, tmp_path, prepare, cause):
    path = tmp_path / "bench"
    prepare(path)
    status, errors = graph.tank(rig=rig_path(nit_calicut), socket=path).wait()
    assert status == 1
    assert cause in errors
    assert str(path) in errors
    assert errors.count("\n") == 1


# ----------------------------------------------------------------------------------- twin


class Encoders:
    """Publishes measured joint states of a uniform run: 0.4 m/s, crank at 2 rad/s."""

    def __init__(self, graph, rig) -> None:
        self._publisher = publisher(graph.probe, topics.MEASURED_JOINTS)
        self._carriage = carriage_encoder(rig)
        self._sample = 0
        self._offset = 0.0
        self.stamps: list[int] = []
        self._timer = graph.probe.create_timer(0.01, self._publish)

    def _publish(self) -> None:
        if self._publisher.get_subscription_count() == 0:
            return
        self._offset *= -2.0
        stamp = 1_000_000_000_000 + self._sample * PERIOD_NS
        t = self._sample * 0.01
        message = JointState(name=[names.CRANK_JOINT, names.CARRIAGE_JOINT])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        position = self._carriage.value(self._carriage.counts(0.4 * t + self._offset))
        message.position = array("d", (2.0 * t, float(position)))
        self._publisher.publish(message)
        self.stamps.append(stamp)
        self._sample += 1

    def go_wild(self) -> None:
        """From now on the carriage jumps to and fro, twice as far each time."""
        self._offset = 1000.0

    def skip(self, samples: int) -> None:
        self._sample += samples


@pytest.mark.real_time
def test_twin_follows_measured_joints_and_reports_an_interruption(graph, nit_calicut):
    fish = graph.collect(topics.TWIN_FISH)
    cables = graph.collect(topics.TWIN_CABLES)
    status = graph.collect(topics.DIAGNOSTICS)
    encoders = Encoders(graph, nit_calicut)
    twin = graph.twin(rig=rig_path(nit_calicut))
    graph.spin_until(lambda: len(fish) >= 200, "200 states of the twin")

    stamps = [stamp_of(message) for message in fish]
    assert set(stamps) <= set(encoders.stamps)
    assert stamps == sorted(set(stamps))
    # It was started at the carriage's speed and stays behind it.
    assert fish[-1].twist.twist.linear.x == pytest.approx(0.4, abs=0.2)
    assert cables[-1].x[0] == pytest.approx(0.4 * (stamp_of(cables[-1]) * 1e-9 - 1000.0), abs=1e-3)
    # The first one comes with the first state, the others at multiples of 50 ms.
    assert {stamp_of(b) - stamp_of(a) for a, b in itertools.pairwise(cables[1:])} == {5 * PERIOD_NS}

    encoders.skip(60)
    before = len(fish)

    def messages():
        return [s.message for array_ in status for s in array_.status if "twin" in s.name]

    graph.spin_until(lambda: len(fish) >= before + 100, "the twin's states after the gap")
    said = messages()
    assert any("no samples of crank and carriage for 0.61" in message for message in said)
    assert "began anew after an interruption" in said[-1]
    assert twin.interrupt() == (0, "")


def test_twin_refuses_joints_without_a_crank(graph, nit_calicut):
    twin = graph.twin(rig=rig_path(nit_calicut))
    joints = publisher(graph.probe, topics.MEASURED_JOINTS)
    graph.spin_until(lambda: joints.get_subscription_count() > 0, "the twin")
    # Best effort: the twin may not be listening yet when it is already seen here.
    for _ in range(100):
        joints.publish(JointState(name=[names.CARRIAGE_JOINT], position=[1.0]))
        if twin.has_ended(within=0.1):
            break
    status, errors = twin.wait()
    assert status == 1
    assert "no joint 'crank'" in errors
    assert errors.count("\n") == 1


def test_twin_that_cannot_follow_ends_with_place_and_time(graph, nit_calicut):
    """No simulation solves a carriage that jumps kilometres to and fro between samples."""
    status = graph.collect(topics.DIAGNOSTICS)
    fish = graph.collect(topics.TWIN_FISH)
    encoders = Encoders(graph, nit_calicut)
    twin = graph.twin(rig=rig_path(nit_calicut))
    graph.spin_until(lambda: fish, "the twin")
    encoders.go_wild()

    def error_reported():
        return any(s.level == DiagnosticStatus.ERROR for a in status for s in a.status)

    graph.spin_until(error_reported, "the twin's last diagnostics", may_end=twin)
    code, errors = twin.wait()
    assert code == 1
    assert errors.startswith("error: the twin stopped at the sample of 10")
    assert errors.count("\n") == 1


# -------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize("module", ["virtual_tank", "twin_node"])
@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"rig": "/nowhere/rig.yaml"}, "/nowhere/rig.yaml"),
        ({}, "'rig' is missing"),
        ({"rig": "{rig}", "segments": 4}, "4 segments are too few"),
        ({"rig": "{rig}", "step_s": 0.5}, "'step_s'"),
    ],
)
def test_bad_parameters_end_a_simulator_with_one_line(
    graph, nit_calicut, board, module, parameters, words
):
    given = {**parameters, **({"socket": board.path} if module == "virtual_tank" else {})}
    if given.get("rig") == "{rig}":
        given["rig"] = rig_path(nit_calicut)
    status, errors = graph.start(module, **given).wait()
    assert status == 1
    assert words in errors
    assert errors.count("\n") == 1
