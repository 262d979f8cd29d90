# SPDX-License-Identifier: Apache-2.0
"""Processes that end before their time."""

from __future__ import annotations

import os
import signal
import time

import pytest
from towtank_bringup import processes
from towtank_bringup.graph import NodeGroup, RosNode
from towtank_bringup.processes import ProcessError, ProcessGroup


@pytest.fixture
def started(monkeypatch, tmp_path):
    """Starts a stand-in for a node that may be restarted twice, and one that may not."""
    monkeypatch.setattr(
        processes, "command_of", lambda item: ["sh", "-c", "echo up; exec sleep 60"]
    )
    group = ProcessGroup(tmp_path)
    group.start(
        (
            NodeGroup("p", "mortal", ("/a",), restarts=2),
            RosNode("p", "e", "/", "other"),
        ),
        watch=lambda: None,
    )
    yield group
    group.stop()


def kill(group: ProcessGroup, name: str) -> int:
    """Kill a process of the group and wait until it is dead; returns its identifier."""
    pid = group.pids()[name]
    os.kill(pid, signal.SIGKILL)
    while os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
        time.sleep(0.01)
    return pid


def test_process_is_started_again_so_often(started):
    for _ in range(2):
        dead = kill(started, "mortal")
        started.check(may_restart=True)
        assert started.pids()["mortal"] != dead
        started.check()
    kill(started, "mortal")
    with pytest.raises(ProcessError, match="mortal ended with status -9"):
        started.check(may_restart=True)


def test_it_is_not_started_again_while_it_may_not(started):
    kill(started, "mortal")
    with pytest.raises(ProcessError, match="mortal ended with status -9"):
        started.check()


def test_any_other_process_ends_the_trial(started):
    kill(started, "/other")
    with pytest.raises(ProcessError, match="/other ended with status -9"):
        started.check(may_restart=True)


def test_a_log_that_cannot_be_read_hides_no_end(started, tmp_path):
    """Its directory was removed, or its disk has failed."""
    kill(started, "/other")
    (tmp_path / "other.log").unlink()
    with pytest.raises(
        ProcessError, match="/other ended with status -9: its log cannot be read: No such file"
    ):
        started.check()
