# SPDX-License-Identifier: Apache-2.0
"""The crank of a running trial is stopped from a second terminal, on the virtual tank."""

from __future__ import annotations

import os
import subprocess

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from towtank_command import TOWTANK, processes_of
from towtank_node import topics

pytestmark = pytest.mark.real_time


@pytest.fixture
def environment(tmp_path):
    """That of two terminals of one user: a runtime folder, no ROS domain."""
    own = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
    return {**own, "XDG_RUNTIME_DIR": str(tmp_path)}


def test_an_emergency_stop_ends_the_trial(tmp_path, environment):
    directory = tmp_path / "trial"
    trial = subprocess.Popen(
        [*TOWTANK, "trial", "--duration", "6", "--noise", "none", "--out", directory],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    said = []
    for line in trial.stderr:
        said.append(line)
        if line.startswith("settling"):
            break
    stop = subprocess.run(
        [*TOWTANK, "crank", "emergency-stop", "--trial", directory],  # and none of others
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    _, rest = trial.communicate(timeout=60)
    words = "".join(said) + rest
    assert stop.returncode == 0, stop.stderr
    assert stop.stderr.startswith(f"emergency stop: {directory} (virtual tank, ROS domain ")
    assert trial.returncode == 1, words
    assert words.splitlines()[-1] == (
        "towtank: error: the crank was stopped from outside: emergency stop: see that all is well "
        "and start a new trial (trial marked incomplete)"
    )
    assert (directory / "INCOMPLETE").exists()
    assert processes_of(directory) == []
    assert list((tmp_path / "towtank").iterdir()) == []
    with AnyReader([directory / "bag"]) as reader:  # closed: it has its index and metadata
        connections = {connection.topic: connection for connection in reader.connections}

        def messages(topic):
            connection = connections[topic]
            return [
                reader.deserialize(raw, connection.msgtype)
                for _, _, raw in reader.messages([connection])
            ]

        drive = messages(topics.CRANK_DRIVE.name)
        assert (drive[-1].state, drive[-1].trip) == (drive[-1].TRIPPED, drive[-1].EMERGENCY_STOP)
        joints = messages(topics.MEASURED_JOINTS.name)
        scans = [scan.sequence for scan in messages(topics.SCANS.name)]
    assert scans == list(range(scans[0], scans[-1] + 1))
    # It turned in the run, and what was recorded goes on until it stands.
    rates = np.array([joint.velocity[joint.name.index("crank")] for joint in joints])
    assert np.nanmax(rates) > 3.0
    assert abs(rates[-1]) < 0.1
