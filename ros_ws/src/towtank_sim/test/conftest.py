# SPDX-License-Identifier: Apache-2.0
"""Rigs, and nodes of this package run as processes of their own."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rclpy
from patient_qos import patiently
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from towtank_node.calls import AGAIN_S, Call
from towtank_node.endpoints import subscription
from towtank_node.topics import Topic
from towtank_rig import load_rig

RIGS = Path(__file__).resolve().parents[4] / "hardware" / "rigs"
PATIENCE_S = 30.0  # a test that has waited so long has failed


@pytest.fixture(scope="session")
def nit_calicut():
    return load_rig(RIGS / "nit_calicut_2012.yaml")


@pytest.fixture(scope="session")
def wu_chwang():
    return load_rig(RIGS / "wu_chwang_2001.yaml")


class RunningNode:
    """A process of towtank_sim, in its place of the graph."""

    def __init__(self, module: str, remapping: tuple[str, ...], parameters: dict):
        arguments = ["--ros-args", *remapping]
        for key, value in parameters.items():
            arguments += ["-p", f"{key}:={value}"]
        start = f"from towtank_sim.{module} import main; raise SystemExit(main())"
        self.popen = subprocess.Popen(
            [sys.executable, "-c", start, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def has_ended(self, within: float) -> bool:
        """True if it ends within so many seconds."""
        try:
            self.popen.wait(within)
        except subprocess.TimeoutExpired:
            return False
        return True

    def interrupt(self) -> tuple[int, str]:
        """Stop it as Ctrl-C does; returns its exit status and its standard error."""
        self.popen.send_signal(signal.SIGINT)
        return self.wait()

    def wait(self) -> tuple[int, str]:
        """Wait for its end; returns its exit status and its standard error."""
        _, errors = self.popen.communicate(timeout=PATIENCE_S)
        return self.popen.returncode, errors


class Graph:
    """Nodes as processes, and a probe node of the test's own among them."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.probe = Node("probe", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.probe)
        self._nodes: list[RunningNode] = []

    def start(self, module: str, *remapping: str, **parameters: object) -> RunningNode:
        self._nodes.append(RunningNode(module, remapping, parameters))
        return self._nodes[-1]

    def tank(self, **parameters: object) -> RunningNode:
        return self.start("virtual_tank", **parameters)

    def twin(self, **parameters: object) -> RunningNode:
        names = ("-r", "__ns:=/twin", "-r", "__node:=simulator")
        return self.start("twin_node", *names, **parameters)

    def spin_until(self, condition, what: str, may_end: RunningNode | None = None) -> None:
        """Take part in the graph until `condition()`.

        Fails if a node ends (other than `may_end`) or if nothing comes.
        """
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            self._executor.spin_once(timeout_sec=0.05)
            for node in self._nodes:
                if node.popen.poll() is not None and node is not may_end:
                    pytest.fail(f"a node ended: {node.wait()}")
            if time.monotonic() > deadline:
                pytest.fail(f"{what}: not within {PATIENCE_S:g} s")

    def collect(self, topic: Topic, noted=lambda message: message) -> list:
        """Subscribe; returns the list that the messages, or what is `noted` of each, come to."""
        heard: list = []
        subscription(self.probe, patiently(topic), lambda message: heard.append(noted(message)))
        return heard

    def call(self, client, request):
        """Call a service of a node; returns its answer. One that got lost is asked for again."""
        call = Call(client, request, AGAIN_S)
        self.spin_until(lambda: call.answer() is not None, f"answer of {client.srv_name}")
        return call.answer()

    def close(self) -> None:
        for node in self._nodes:
            if node.popen.poll() is None:
                node.popen.kill()
                node.popen.communicate()
        self.probe.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def graph():
    graph = Graph()
    yield graph
    graph.close()
