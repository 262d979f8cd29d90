# SPDX-License-Identifier: Apache-2.0
"""A trial beside other programs, on a host whose clock is set: its result is its own.

All of it happens to one trial: another program publishes depths, diagnostics and events of its own
from before it starts; while it settles, a second trial is started in the same ROS domain, and the
recorder and the board's node are asked for what they cannot do then; the clock is set back by an
hour in the log.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader
from towtank_command import TOWTANK, processes_of

pytestmark = pytest.mark.alone

DOMAIN = "101"  # none of those that trials and tests take by themselves
STRANGER = """
import sys, threading, rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from towtank_interfaces.msg import Depth, TrialEvent
from towtank_node.calls import AGAIN_S, Call

rclpy.init()
node = rclpy.create_node("gamepad")
depths = node.create_publisher(Depth, "/measured/fish/depth", qos_profile_sensor_data)
diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
events = node.create_publisher(TrialEvent, "/trial/events", latched)
event = TrialEvent(event="note", detail="changed the ballast, notebook p. 12")
event.header.stamp = node.get_clock().now().to_msg()
events.publish(event)
statuses = [
    DiagnosticStatus(name="joy: gamepad", message="none is connected", level=level)
    for level in (DiagnosticStatus.ERROR, DiagnosticStatus.STALE)
]
statuses.append(DiagnosticStatus(name="camera", values=[KeyValue(key="overruns", value="n/a")]))

def publish():
    depth = Depth(depth=0.5, valid=True)
    depth.header.stamp = node.get_clock().now().to_msg()
    depths.publish(depth)
    diagnostics.publish(DiagnosticArray(status=statuses))

node.create_timer(0.1, publish)
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
print("publishing", flush=True)
sys.stdin.readline()
asker = rclpy.create_node("asker")
executor = SingleThreadedExecutor()
executor.add_node(asker)
for name, transition in (("recorder", 1), ("measured/adc_board", 1), ("recorder", 2)):
    client = asker.create_client(ChangeState, f"/{name}/change_state")
    client.wait_for_service()
    request = ChangeState.Request(transition=Transition(id=transition))
    call = Call(client, request, AGAIN_S)  # what is refused may be asked for twice
    while (answer := call.answer()) is None:
        executor.spin_once(timeout_sec=0.1)
    print(name, answer.success, flush=True)
sys.stdin.readline()
"""


@pytest.fixture(scope="module")
def settable_clock(tmp_path_factory) -> tuple[dict[str, str], Path]:
    """Environment of programs whose system clock can be set, and the file to set it by."""
    folder = tmp_path_factory.mktemp("clock")
    library, shift = folder / "clock_shift.so", folder / "shift"
    source = Path(__file__).with_name("clock_shift.c")
    warnings = ["-Wall", "-Wextra", "-Werror"]
    command = ["cc", "-shared", "-fPIC", "-O2", *warnings, "-o", library, source, "-ldl"]
    subprocess.run(command, check=True)
    shift.write_bytes(struct.pack("q", 0))
    return {"LD_PRELOAD": str(library), "CLOCK_SHIFT_FILE": str(shift)}, shift


def set_clock(shift: Path, seconds: int) -> None:
    with shift.open("r+b") as file:
        file.write(struct.pack("q", seconds * 10**9))


def test_trial_is_not_disturbed(tmp_path, settable_clock):
    environment, shift = settable_clock
    # One machine has one clock. A stranger that kept its own would take the trial's nodes for dead:
    # Fast DDS counts, in memory that all programs share, how long a node has waited, on that clock.
    programs = {**os.environ, "ROS_DOMAIN_ID": DOMAIN} | environment
    directory, second_directory = tmp_path / "trial", tmp_path / "second"
    arguments = ["trial", "--duration", "8", "--noise", "none", "--out"]
    stranger = subprocess.Popen(
        [sys.executable, "-c", STRANGER],
        env=programs,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    second = None
    try:
        assert stranger.stdout.readline() == "publishing\n"
        trial = subprocess.Popen([*TOWTANK, *arguments, directory, "--json"], env=programs, **pipes)
        said = []
        for line in trial.stderr:
            said.append(line)
            if line.startswith("settling"):
                stranger.stdin.write("ask\n")
                stranger.stdin.flush()
                second = subprocess.Popen(
                    [*TOWTANK, *arguments, second_directory], env=programs, **pipes
                )
            if line.startswith("logging"):
                set_clock(shift, -3600)
                break
        output, errors = trial.communicate()
        said = "".join(said) + errors
        answers, _ = stranger.communicate("end\n")
        _, second_errors = second.communicate()
    finally:
        for process in filter(None, (stranger, second)):
            process.kill()

    assert second.returncode == 1
    assert "a trial runs in ROS domain 101 already" in second_errors
    assert not second_directory.exists()

    assert trial.returncode == 0, said
    assert processes_of(directory) == []
    result = json.loads(output)
    assert answers.splitlines() == [
        "recorder False",
        "measured/adc_board False",
        "recorder False",
    ]
    # 100 Hz; the log's ends may cut one scan each, and a busy machine ends it late
    assert result["scans"]["received"] >= 8 * 100 - 2
    # Bad ones there may be: other programs start meanwhile, and the virtual tank keeps real time
    assert result["scans"]["lost"] == 0
    assert result["restarts"] == {}
    ratio = result["heave_ratio"]
    # Ideal sensors and the same model on both sides: equal but for what a busy machine does to the
    # virtual tank. The stranger's depths, were they taken, would make 0.1 and more of it.
    assert ratio["measured"]["value"] == pytest.approx(ratio["twin"]["value"], rel=0.1, abs=2e-3)
    assert {(each["node"], each["topic"]) for each in result["strangers"]} == {
        ("/gamepad", topic) for topic in ("/diagnostics", "/measured/fish/depth", "/trial/events")
    }
    assert "warning: /gamepad, which is none of this trial's nodes, publishes" in said
    assert "the host's clock has stepped by -3600.000 s" in "".join(
        log.read_text() for log in (directory / "logs").iterdir()
    )
    with AnyReader([directory / "bag"]) as reader:
        for topic in ("/measured/fish/depth", "/diagnostics"):
            connections = [each for each in reader.connections if each.topic == topic]
            messages = [
                (t, reader.deserialize(raw, c.msgtype))
                for c, t, raw in reader.messages(connections)
            ]
            if topic == "/diagnostics":
                names = {status.name for _, message in messages for status in message.status}
                assert "joy: gamepad" not in names
                assert {"/recorder", "/comparison", "/measured/adc_board"} <= names
            stamps = [m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for _, m in messages]
            # The clock went back an hour; no stamp and no time in the bag did
            assert max(stamps) - min(stamps) < 600
            assert max(t for t, _ in messages) - min(t for t, _ in messages) < 600e9
