# SPDX-License-Identifier: Apache-2.0
"""The board's node on a port: the virtual board in real time, and ports that are none."""

import itertools
import math
import os
import pty
import re
import select
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import State, Transition
from patient_qos import patiently
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from towtank_daq.adc_board_node import AdcBoardNode
from towtank_daq.board import AdcBoard
from towtank_daq.framing import FrameReader, encode_frame
from towtank_daq.serial_port import SerialPort
from towtank_interfaces.msg import AdcScan, CrankDrive
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node import names, topics
from towtank_node.endpoints import client, subscription
from towtank_node.leading import LifecycleClient
from towtank_node.quick_stop import quick_stop
from towtank_node.services import SET_CRANK_SPEED

ROOT = Path(__file__).parents[4]
RIG = ROOT / "hardware" / "rigs" / "nit_calicut_2012.yaml"
BUILD = ROOT / "build" / "firmware"
SUCCESS = TransitionCallbackReturn.SUCCESS
FAILURE = TransitionCallbackReturn.FAILURE


class Graph:
    """The node under test and a listener, in one executor of a ROS context of their own."""

    def __init__(self, port: Path, **parameters) -> None:
        given = {"rig": RIG, "port": port, **parameters}
        arguments = itertools.chain.from_iterable(("-p", f"{k}:={v}") for k, v in given.items())
        rclpy.init(args=["--ros-args", *arguments])
        self.node = AdcBoardNode()
        self.listener = rclpy.create_node("listener")
        self.scans: list[AdcScan] = []
        self.statuses: list[DiagnosticStatus] = []
        subscription(self.listener, patiently(topics.SCANS), self.scans.append)
        subscription(
            self.listener, topics.DIAGNOSTICS, lambda array: self.statuses.extend(array.status)
        )
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.listener)

    def spin_until(self, condition) -> None:
        """The test's time limit ends what never comes true."""
        while not condition():
            self.executor.spin_once(timeout_sec=0.1)

    @property
    def state(self) -> int:
        return self.node._state_machine.current_state[0]

    def close(self) -> None:
        for node in (self.node, self.node.drive_node):
            node.close()
            node.destroy_node()
        self.listener.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture
def graph():
    """Makes a graph and takes it down."""
    graphs = []

    def make(port: Path, **parameters) -> Graph:
        graphs.append(Graph(port, **parameters))
        return graphs[-1]

    yield make
    for made in graphs:
        made.close()


@pytest.fixture
def start_board(tmp_path):
    """Starts a virtual board's process, whose port is tmp_path/board; ends all that it started,
    however the test ends: one left over takes a share of the processor for ever."""
    processes = []

    def start(*options: str) -> subprocess.Popen:
        process = subprocess.Popen(
            [
                BUILD / "vboard" / "towtank-vboard",
                "--elf", BUILD / "towtank_board.elf",
                "--pty-link", tmp_path / "board",
                "--bench-socket", tmp_path / "bench",
                *options,
            ],
            stdout=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        processes.append(process)
        assert process.stdout.readline().startswith("ready")
        return process

    yield start
    for process in processes:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        process.communicate()


@pytest.fixture
def virtual_board(start_board):
    return start_board()


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_through_all_states(graph, virtual_board, tmp_path):
    made = graph(tmp_path / "board")
    assert made.node.trigger_configure() == SUCCESS
    assert made.node.trigger_activate() == SUCCESS
    made.spin_until(lambda: len(made.scans) >= 150)
    assert made.node.trigger_deactivate() == SUCCESS
    details = made.node._details()
    assert made.node.trigger_cleanup() == SUCCESS

    for a, b in itertools.pairwise(made.scans):
        assert b.sequence - a.sequence == 1
        assert b.board_ticks - a.board_ticks == 20_000
    assert (details["scans_lost"], details["scans_bad"]) == (0, 0)
    assert details["scans_received"] > made.scans[-1].sequence
    # stamps are in ROS time: the last one lies in the run that has just ended
    now = made.listener.get_clock().now().nanoseconds
    last = made.scans[-1].header.stamp
    assert 0 < now - (last.sec * 10**9 + last.nanosec) < 10 * 10**9
    assert made.scans[0].header.frame_id == names.BOARD_FRAME


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_start_again_after_a_stop(graph, virtual_board, tmp_path):
    """Also over a cleanup; each start counts from 0."""
    made = graph(tmp_path / "board", rate_hz=200)
    assert made.node.trigger_configure() == SUCCESS
    for scans in (100, 200):
        assert made.node.trigger_activate() == SUCCESS
        made.spin_until(lambda scans=scans: len(made.scans) >= scans)
        assert made.node.trigger_deactivate() == SUCCESS
    pairs = list(itertools.pairwise(made.scans))
    assert sum(b.sequence <= a.sequence for a, b in pairs) == 1
    for a, b in pairs:
        if b.sequence > a.sequence:
            assert b.board_ticks - a.board_ticks == 10_000 * (b.sequence - a.sequence)
    assert made.node.trigger_cleanup() == SUCCESS
    assert made.node.trigger_configure() == SUCCESS
    assert made.node.trigger_activate() == SUCCESS
    made.spin_until(lambda: len(made.scans) >= 300)
    # Opening the port anew has not reset the board (the first time has, maybe after a first boot)
    assert len({scan.count_epoch for scan in made.scans}) == 1


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_ready_is_said_and_health_is_told(graph, virtual_board, tmp_path):
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: made.node._board.health is not None)
    made.statuses.clear()
    made.spin_until(lambda: made.statuses)
    status = made.statuses[-1]
    values = {pair.key: pair.value for pair in status.values}
    assert status.level == DiagnosticStatus.OK
    assert (status.name, values["state"]) == (names.BOARD_NODE, "ready")
    assert values["board_reset_cause"] == "unknown cause (a bootloader hides it)"
    assert values["board_dropped_frames"] == "0"
    assert float(values["clock_residual_us"]) >= 0


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_port_that_vanishes_in_the_run(graph, start_board, virtual_board, tmp_path):
    """When its patience is over, the node falls back to unconfigured, says why, and can be
    configured again."""
    made = graph(tmp_path / "board", patience_s=0.0)
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: made.scans)
    virtual_board.kill()
    made.spin_until(lambda: made.state == State.PRIMARY_STATE_UNCONFIGURED)
    made.spin_until(lambda: made.statuses and made.statuses[-1].level == DiagnosticStatus.ERROR)
    assert re.search(r"port .*/board is gone: plug the board in", made.statuses[-1].message)
    assert made.node.trigger_configure() == FAILURE
    # Another board's process: its power was off, and counts begin anew
    virtual_board.wait()
    before = made.scans[-1].count_epoch
    made.scans.clear()
    start_board()
    assert made.node.trigger_configure() == SUCCESS
    assert made.node.trigger_activate() == SUCCESS
    made.spin_until(lambda: made.scans)
    assert made.scans[-1].count_epoch == before + 1


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_acquisition_goes_on_when_the_port_comes_back(graph, start_board, virtual_board, tmp_path):
    """The board's process is killed and another started: its port vanishes and returns, its power
    was off. The gap stands in the numbers of the scans as it does in their stamps."""
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: len(made.scans) > 50)
    virtual_board.kill()
    virtual_board.wait()
    made.spin_until(lambda: made.statuses[-1].level == DiagnosticStatus.WARN)
    assert "is gone: plug the board in" in made.statuses[-1].message
    epoch = made.scans[-1].count_epoch
    start_board()
    made.spin_until(lambda: made.scans[-1].count_epoch != epoch)
    made.spin_until(lambda: len(made.scans) > 200)
    assert made.state == State.PRIMARY_STATE_ACTIVE
    before = [scan for scan in made.scans if scan.count_epoch == epoch][-1]
    after = next(scan for scan in made.scans if scan.count_epoch != epoch)
    passed_s = _seconds(after) - _seconds(before)
    assert after.sequence - before.sequence == pytest.approx(100 * passed_s, abs=1)
    assert after.count_epoch == before.count_epoch + 1
    assert made.node.trigger_deactivate() == SUCCESS
    details = made.node._details()
    assert (details["restarts"], details["reconnections"]) == (1, 1)
    assert details["scans_lost"] >= after.sequence - before.sequence - 1


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_a_reset_in_the_run_of_a_board_with_a_bootloader(graph, virtual_board, tmp_path):
    """Its reset button: the node stays active, and says so."""
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: len(made.scans) > 50)
    epoch = made.scans[-1].count_epoch
    virtual_board.send_signal(signal.SIGUSR2)
    made.spin_until(lambda: made.scans[-1].count_epoch == epoch + 1)
    assert made.state == State.PRIMARY_STATE_ACTIVE
    assert made.node._details()["restarts"] > 0
    # A busy computer may hold the virtual board up for longer than a silence may last
    told = re.compile(r"the board was reset \(|the board has sent nothing")
    made.spin_until(lambda: any(told.match(status.message) for status in made.statuses))


def _seconds(scan: AdcScan) -> float:
    return scan.header.stamp.sec + 1e-9 * scan.header.stamp.nanosec


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_board_that_falls_silent_in_the_run(graph, virtual_board, tmp_path):
    made = graph(tmp_path / "board", patience_s=0.0)
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: made.scans)
    virtual_board.send_signal(signal.SIGSTOP)
    made.spin_until(lambda: made.state == State.PRIMARY_STATE_UNCONFIGURED)
    made.spin_until(lambda: made.statuses and made.statuses[-1].level == DiagnosticStatus.ERROR)
    assert "sent nothing for 2.5 s: check its power and cable" in made.statuses[-1].message


def refusal(made: Graph) -> str:
    """What the node says when it cannot be configured."""
    assert made.node.trigger_configure() == FAILURE
    assert made.state == State.PRIMARY_STATE_UNCONFIGURED
    made.spin_until(lambda: made.statuses and made.statuses[-1].level == DiagnosticStatus.ERROR)
    message = made.statuses[-1].message
    assert "\n" not in message
    return message


@pytest.mark.timeout(60)
def test_port_that_does_not_exist(graph, tmp_path):
    assert "none does not exist: plug the board in" in refusal(graph(tmp_path / "none"))


@pytest.mark.timeout(60)
def test_port_that_is_no_serial_port(graph, tmp_path):
    (tmp_path / "file").write_text("")
    assert "file is no serial port: give the board's port" in refusal(graph(tmp_path / "file"))


@pytest.mark.timeout(60)
@pytest.mark.parametrize("any_calibration", [False, True])
def test_board_of_another_calibration(graph, virtual_board, tmp_path, any_calibration):
    rig = tmp_path / "rig.yaml"
    text = RIG.read_text().replace(
        "  sample_rate: 100 Hz\n", "  sample_rate: 100 Hz\n  calibration_id: 3\n"
    )
    rig.write_text(text)
    made = graph(tmp_path / "board", rig=rig, any_calibration=any_calibration)
    if any_calibration:
        assert made.node.trigger_configure() == SUCCESS
    else:
        assert "rig is for a board of calibration 3; the board has no serial" in refusal(made)


@pytest.mark.timeout(60)
def test_port_in_use(graph, virtual_board, tmp_path):
    holder = graph(tmp_path / "board")
    assert holder.node.trigger_configure() == SUCCESS
    rival = AdcBoardNode()  # with the same parameters
    try:
        assert rival.trigger_configure() == FAILURE
        assert "in use by another program: stop that first" in rival._failure
    finally:
        rival.destroy_node()


@pytest.mark.timeout(60)
def test_port_where_nobody_answers(graph):
    here, there = pty.openpty()
    try:
        message = refusal(graph(Path(os.ttyname(there))))
    finally:
        os.close(here)
        os.close(there)
    assert "not answered within 13 s: check that it has power" in message


@pytest.mark.timeout(60)
def test_board_of_another_schema(graph, protocol):
    """Somebody on the line who answers `identify` with a hash that is not ours."""
    here, there = pty.openpty()
    os.set_blocking(here, False)
    finished = threading.Event()
    other = protocol.board.schema_hash ^ 0xFFFFFFFF

    def answer() -> None:
        reader = FrameReader(64)
        while not finished.is_set():
            os.write(here, encode_frame(b"\x11"))  # it is heard
            if select.select([here], [], [], 0.1)[0]:
                for request in reader.feed(os.read(here, 4096)):
                    identity = bytes((1,)) + other.to_bytes(4, "little") + bytes(16)
                    os.write(here, encode_frame(bytes((0x81, request[1], 0)) + identity))

    thread = threading.Thread(target=answer)
    thread.start()
    try:
        message = refusal(graph(Path(os.ttyname(there))))
    finally:
        finished.set()
        thread.join()
        os.close(here)
        os.close(there)
    assert f"schema 0x{other:08x}" in message
    assert f"0x{protocol.board.schema_hash:08x}: flash the firmware" in message


# -- as processes


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_interrupt_in_the_run_leaves_an_idle_board(virtual_board, tmp_path, protocol):
    """SIGINT at any moment: no traceback, status 0, and the port is free and the board idle."""
    port = tmp_path / "board"
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from towtank_daq.adc_board_node import main; main()",
            *("--ros-args", "-r", "__node:=board", "-p", f"rig:={RIG}", "-p", f"port:={port}"),
        ],
        stderr=subprocess.PIPE,
        text=True,
    )
    rclpy.init()
    listener = rclpy.create_node("listener")
    try:
        scans = []
        subscription(listener, patiently(topics.SCANS), scans.append)
        # a name of its own: nodes of other tests in this process may still be there
        leader = LifecycleClient(listener, f"/{names.MEASURED}/board")
        while not leader.is_ready():
            rclpy.spin_once(listener, timeout_sec=0.1)
        for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            call = leader.transition(transition)
            while call.outcome() is None:
                rclpy.spin_once(listener, timeout_sec=0.1)
            assert call.outcome()
        while not scans:
            rclpy.spin_once(listener, timeout_sec=0.1)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    finally:
        process.kill()
        listener.destroy_node()
        rclpy.try_shutdown()
    assert process.returncode == 0
    assert "Traceback" not in errors
    left = SerialPort(str(port), protocol.board.wire.baud)
    driver = AdcBoard(left, protocol, lambda scan: None, print)
    driver.connect()
    while driver.health is None:
        driver.poll(0.2)
    left.close()
    assert driver.health.state == protocol.board.board_state["idle"]
    assert driver.statistics.scans_received == 0


def run(module: str, *parameters: str) -> subprocess.CompletedProcess:
    """Start a node's process that should end by itself."""
    given = itertools.chain.from_iterable(("-p", parameter) for parameter in parameters)
    return subprocess.run(
        [
            sys.executable,
            "-c",
            f"from towtank_daq.{module} import main; main()",
            "--ros-args",
            *given,
        ],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    ("module", "parameters", "words"),
    [
        ("adc_board_node", [f"rig:={RIG}"], "parameter 'port' is missing"),
        ("adc_board_node", [f"rig:={RIG}", "port:=/dev/null", "rate_hz:=500"], "rate_hz"),
        ("adc_board_node", ["rig:=/nowhere.yaml", "port:=/dev/null"], "/nowhere.yaml: no such"),
        ("sensors", [], "parameter 'rig' is missing"),
        ("sensors", [f"rig:={RIG}", "zero_scans:=1"], "zero_scans"),
        ("sensors", [f"rig:={RIG}", "velocity_window_s:=0.001"], "velocity_window_s"),
    ],
)
def test_bad_parameters_end_the_process(module, parameters, words):
    ended = run(module, *parameters)
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("error: ")
    assert words in ended.stderr


@pytest.mark.timeout(60)
def test_rig_wired_otherwise_is_refused(tmp_path):
    changed = tmp_path / "rig.yaml"
    text = RIG.read_text(encoding="utf-8")
    old = "[fish_pressure, depressor_pressure, accel_x,"
    assert old in text
    changed.write_text(
        text.replace(old, "[depressor_pressure, fish_pressure, accel_x,"), encoding="utf-8"
    )
    ended = run("adc_board_node", f"rig:={changed}", "port:=/dev/null")
    assert ended.returncode == 1
    assert "board.channels: the rig has depressor_pressure, fish_pressure" in ended.stderr


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_the_crank_is_driven_by_service(graph, start_board, tmp_path):
    """On the virtual board's motor: started, tripped by the host, refused, cleared, stopped."""
    start_board("--crank-motor")
    made = graph(tmp_path / "board")
    made.executor.add_node(made.node.drive_node)
    states = []
    subscription(made.listener, topics.CRANK_DRIVE, states.append)
    drive = client(made.listener, SET_CRANK_SPEED)

    def ask(action, rpm=0.0) -> SetCrankSpeed.Response:
        made.spin_until(drive.service_is_ready)
        request = SetCrankSpeed.Request(action=action, crank_rate=rpm * 2 * math.pi / 60)
        future = drive.call_async(request)
        made.spin_until(future.done)
        return future.result()

    wanted = SetCrankSpeed.Request
    assert "activate it first" in ask(wanted.RUN, 30.0).message
    made.node.trigger_configure()
    made.node.trigger_activate()
    assert "give 5 to 60 rpm" in ask(wanted.RUN, 61.0).message
    assert ask(9).message.startswith("no action 9")
    answer = ask(wanted.RUN, 10.0)
    assert answer.success, answer.message
    made.spin_until(lambda: states and states[-1].setpoint_rate > 1.0)
    last = states[-1]
    assert (last.state, last.trip) == (CrankDrive.RUNNING, CrankDrive.NONE)
    assert last.target_rate == pytest.approx(10.0 * 2 * math.pi / 60)
    assert last.emergency_stop_closed
    made.spin_until(lambda: states[-1].crank_rate > 0.5)
    assert ask(wanted.EMERGENCY_STOP).success
    made.spin_until(lambda: states[-1].state == CrankDrive.TRIPPED)
    assert (states[-1].trip, states[-1].duty) == (CrankDrive.EMERGENCY_STOP, 0.0)
    refused = ask(wanted.RUN, 10.0)
    assert not refused.success
    assert "close the emergency-stop loop, then clear the trip" in refused.message
    assert ask(wanted.CLEAR_TRIP).success
    made.spin_until(lambda: states[-1].state == CrankDrive.STOPPED)
    made.node.trigger_deactivate()
    assert "activate it first" in ask(wanted.RUN, 10.0).message


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_an_emergency_stop_between_runs_reaches_the_board_and_holds(graph, start_board, tmp_path):
    """Asked by the quick way, from its own thread, of a node that is connected but not active; the
    next run is refused until it is cleared."""
    start_board("--crank-motor")
    made = graph(tmp_path / "board")
    domain = made.node.context.get_domain_id()
    assert quick_stop(domain) == "the board's node is not connected: configure it first"
    made.node.trigger_configure()
    assert quick_stop(domain) == ""
    made.node.trigger_activate()
    made.spin_until(lambda: made.node._drive.trip == "emergency_stop")
    asked = made.node._drive.ask("run", 1.0)
    made.spin_until(asked.done)
    assert "then clear the trip" in str(asked.exception())
    asked = made.node._drive.ask("clear_trip")
    made.spin_until(asked.done)
    made.node.trigger_deactivate()
    assert quick_stop(domain) == ""
    made.node.trigger_cleanup()
    assert "not connected" in quick_stop(domain)


def by_deactivation(node: AdcBoardNode) -> None:
    assert node.trigger_deactivate() == SUCCESS
    assert node.trigger_cleanup() == SUCCESS


@pytest.mark.real_time
@pytest.mark.timeout(60)
@pytest.mark.parametrize("end", [by_deactivation, AdcBoardNode.close])
def test_a_driven_crank_is_stopped_softly_at_the_end(graph, start_board, tmp_path, protocol, end):
    """At the end of a trial, and on Ctrl-C: it comes to rest along its ramp, with no trip that the
    next run would have to clear."""
    start_board("--crank-motor")
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    asked = made.node._drive.ask("run", 30.0 * 2 * math.pi / 60)
    made.spin_until(lambda: (state := made.node._board.drive_state) and state.setpoint_rpm > 15.0)
    asked.result(0)
    end(made.node)

    port = SerialPort(str(tmp_path / "board"), protocol.board.wire.baud)
    states = []
    driver = AdcBoard(port, protocol, lambda scan: None, print, on_drive=states.append)
    driver.connect()
    while not states or states[-1].state not in ("stopped", "tripped"):
        driver.poll(0.1)
    port.close()
    assert {state.state for state in states} == {"stopping", "stopped"}
    assert {state.trip for state in states} == {"none"}


@pytest.mark.real_time
@pytest.mark.timeout(60)
@pytest.mark.parametrize("step_s", [2.0, -2.0])
def test_a_step_of_the_hosts_clock_does_no_harm(graph, virtual_board, tmp_path, step_s):
    """NTP sets the clock in the middle of a run: stamps go on evenly, and the step is told."""
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    made.spin_until(lambda: len(made.scans) >= 100)
    clock = made.node._trial_clock
    before = clock.measured_offset_ns
    clock.measured_offset_ns = lambda: before() + round(step_s * 1e9)
    told = f"the host's clock has stepped by {step_s:+.3f} s"
    made.spin_until(lambda: any(told in status.message for status in made.statuses))
    seen = len(made.scans)
    made.spin_until(lambda: len(made.scans) >= seen + 100)
    details = made.node._details()
    assert float(details["host_clock_step_s"]) == pytest.approx(step_s, abs=0.01)
    assert details["scans_lost"] == 0
    # A machine that holds programs up moves the map from board to host time by milliseconds
    assert 0 < 1e-6 * float(details["clock_u95_us"]) < abs(step_s) / 20
    made.node.trigger_deactivate()
    stamps = [s.header.stamp.sec * 10**9 + s.header.stamp.nanosec for s in made.scans]
    numbers = [scan.sequence for scan in made.scans]
    for a, b in itertools.pairwise(zip(stamps, numbers, strict=True)):
        assert b[0] - a[0] == pytest.approx(10e6 * (b[1] - a[1]), abs=1e9 * abs(step_s) / 20)


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_a_fault_in_the_serial_thread_is_told_and_stops_the_crank(graph, start_board, tmp_path):
    """Whatever it is. Nothing would serve the drive any more, and nobody would know."""
    start_board("--crank-motor")
    made = graph(tmp_path / "board")
    made.node.trigger_configure()
    made.node.trigger_activate()
    driver, told = made.node._driver, []
    drive = driver.drive
    driver.drive = lambda action, *speed: (told.append(action), drive(action, *speed))
    asked = made.node._drive.ask("run", 10.0 * 2 * math.pi / 60)
    made.spin_until(asked.done)

    def fail(scan):
        raise ZeroDivisionError("a mistake of ours")

    driver.on_scan = fail
    made.spin_until(lambda: made.state == State.PRIMARY_STATE_UNCONFIGURED)
    assert "fault in the board's node" in made.node._failure
    assert "a mistake of ours" in made.node._failure
    assert told[-1] == "stop"
