# SPDX-License-Identifier: Apache-2.0
"""The recorder node among publishers: its bag holds what was sent, and it says when it cannot."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import Transition
from rclpy.executors import SingleThreadedExecutor
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_interfaces.msg import Depth, TrialEvent
from towtank_node import names, topics
from towtank_node.endpoints import publisher, subscription
from towtank_node.leading import LifecycleClient

RIG = Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
TIMEOUT_S = 30.0


class Graph:
    """A recorder in its own process, and a node that publishes to it and leads it."""

    def __init__(self, uri: Path, file_size_limit: int | None = None) -> None:
        self.node = rclpy.create_node("tester")
        self.depth = publisher(self.node, topics.FISH_DEPTH)
        self.events = publisher(self.node, topics.EVENTS)
        self.statuses: list[DiagnosticStatus] = []
        subscription(self.node, topics.DIAGNOSTICS, lambda a: self.statuses.extend(a.status))
        self.leader = LifecycleClient(self.node, names.RECORDER_NODE)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        program = "from towtank_bag.recorder import main; main()"
        if file_size_limit is not None:
            # It holds for shared memory too: what Fast DDS cannot have of that it does by UDP
            limit = f"({file_size_limit}, {file_size_limit})"
            program = f"import resource as r; r.setrlimit(r.RLIMIT_FSIZE, {limit}); {program}"
        self.process = subprocess.Popen(
            [sys.executable, "-c", program, "--ros-args", "-p", f"rig:={RIG}", "-p", f"uri:={uri}"],
            stderr=subprocess.PIPE,
            text=True,
        )

    def spin_until(self, condition) -> None:
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert self.process.poll() is None, self.process.stderr.read()
            assert time.monotonic() < deadline, "waited too long"
            self.executor.spin_once(timeout_sec=0.05)

    def transition(self, transition: int) -> bool:
        self.spin_until(self.leader.is_ready)
        call = self.leader.transition(transition)
        self.spin_until(lambda: call.outcome() is not None)
        return call.outcome()

    def bring_up(self) -> None:
        assert self.transition(Transition.TRANSITION_CONFIGURE)
        assert self.transition(Transition.TRANSITION_ACTIVATE)
        self.spin_until(lambda: self.depth.get_subscription_count() == 1)

    def publish_depths(self, count: int) -> None:
        """No faster than the recorder takes them: its queue holds 50."""
        for number in range(count):
            if number % 30 == 0:
                self.spin_until(lambda number=number: self.messages() >= number)
            self.depth.publish(Depth(depth=float(number)))
            self.executor.spin_once(timeout_sec=0.002)

    def said(self, text: str) -> bool:
        return any(text in status.message for status in self.statuses)

    def value(self, key: str) -> str:
        return next(
            (v.value for s in reversed(self.statuses) for v in s.values if v.key == key), ""
        )

    def messages(self) -> int:
        """In the bag, as the recorder last said."""
        return int(self.value("messages") or 0)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.node.destroy_node()


@pytest.fixture
def make_graph():
    rclpy.init()
    graphs = []

    def make(*arguments) -> Graph:
        graphs.append(Graph(*arguments))
        return graphs[-1]

    yield make
    for graph in graphs:
        graph.close()
    rclpy.try_shutdown()


@pytest.mark.real_time
def test_the_bag_holds_what_was_sent(make_graph, tmp_path):
    graph = make_graph(tmp_path / "bag")
    graph.events.publish(TrialEvent(event="started"))  # before the recorder is up: latched
    graph.bring_up()
    graph.publish_depths(120)
    graph.spin_until(lambda: graph.messages() >= 122)
    assert graph.value("state") == "ready"
    assert graph.value("lost_in_transport") == "0"
    assert graph.transition(Transition.TRANSITION_DEACTIVATE)
    assert graph.transition(Transition.TRANSITION_CLEANUP)

    bag = open_bag(tmp_path / "bag")
    assert bag.complete
    depths = bag.series(topics.FISH_DEPTH.name, ["depth"])
    assert depths["depth"].tolist() == list(range(120))
    raw = bag.raw(topics.FISH_DEPTH.name)
    assert (raw.log_time_ns >= raw.publish_time_ns).all()
    assert [m.event for _, m in bag.messages(topics.EVENTS.name)] == ["started"]
    assert recorded_rig(bag).text == RIG.read_text()
    assert [m.data for _, m in bag.messages(topics.RIG.name)] == [RIG.read_text()]
    assert "fish_pressure" in bag.attachments["calibration.json"].decode()
    assert bag.metadata["towtank"]["rig"] == "nit_calicut_2012"
    assert bag.topics[topics.DIAGNOSTICS.name].count > 0


@pytest.mark.real_time
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_recording_cleanly(make_graph, tmp_path, end):
    graph = make_graph(tmp_path / "bag")
    graph.bring_up()
    graph.publish_depths(50)
    graph.spin_until(lambda: graph.messages() >= 50)
    graph.process.send_signal(end)
    _, errors = graph.process.communicate(timeout=TIMEOUT_S)
    assert graph.process.returncode == 0, errors
    assert "Traceback" not in errors
    bag = open_bag(tmp_path / "bag")
    assert bag.complete
    assert bag.topics[topics.FISH_DEPTH.name].count == 50


def test_an_existing_directory_is_refused(make_graph, tmp_path):
    graph = make_graph(tmp_path)
    assert not graph.transition(Transition.TRANSITION_CONFIGURE)
    graph.spin_until(lambda: graph.said("exists already and is not overwritten"))
    assert os.listdir(tmp_path) == []


def test_a_full_disk_is_said_and_ends_the_recording(make_graph, tmp_path):
    graph = make_graph(tmp_path / "bag", 60_000)
    graph.bring_up()
    deadline = time.monotonic() + TIMEOUT_S
    while not graph.said("cannot write"):
        assert time.monotonic() < deadline
        graph.publish_depths(30)
    worst = max(status.level for status in graph.statuses)
    assert worst == DiagnosticStatus.ERROR
    # Only an inactive node can be cleaned up; this one cannot, for its bag cannot be finished.
    assert not graph.transition(Transition.TRANSITION_CLEANUP)
    bag = open_bag(tmp_path / "bag")
    assert not bag.complete
    assert bag.topics[topics.FISH_DEPTH.name].count > 0
    graph.process.send_signal(signal.SIGINT)
    _, errors = graph.process.communicate(timeout=TIMEOUT_S)
    assert "Traceback" not in errors
    assert (tmp_path / "bag" / "RECORDING").exists()


def test_a_bad_topic_list_is_refused_in_one_line(tmp_path):
    arguments = ["-p", f"rig:={RIG}", "-p", f"uri:={tmp_path / 'b'}", "-p", "topics:=['/depth']"]
    result = subprocess.run(
        [sys.executable, "-m", "towtank_bag.recorder", "--ros-args", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 1
    assert result.stderr.startswith("error: topic '/depth': write it as")
    assert result.stderr.count("\n") == 1
