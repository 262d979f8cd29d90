# SPDX-License-Identifier: Apache-2.0
"""`towtank crank` on a board whose node runs: the real firmware, the virtual motor."""

from __future__ import annotations

import subprocess
import sys

import pytest
import rclpy
from towtank_bringup.conductor import open_conductor
from towtank_bringup.graph import FIRMWARE_IMAGE, VIRTUAL_BOARD, Program, RosNode
from towtank_bringup.plan import firmware_folder
from towtank_bringup.processes import ProcessGroup
from towtank_bringup.rigs import rig_path
from towtank_interfaces.msg import CrankDrive
from towtank_node.qos import RELIABLE_QOS


def crank(*words: str) -> tuple[int, str]:
    """Exit status and last line of the error stream."""
    done = subprocess.run(
        [sys.executable, "-m", "towtank_bringup.cli", "crank", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stderr.strip()


@pytest.mark.real_time
@pytest.mark.timeout(120)
def test_the_crank_obeys(tmp_path):
    firmware = firmware_folder()
    board = Program(
        "virtual_board",
        (
            *(str(firmware / VIRTUAL_BOARD), "--elf", str(firmware / FIRMWARE_IMAGE)),
            *("--pty-link", str(tmp_path / "board"), "--bench-socket", str(tmp_path / "bench")),
            *("--crank-motor", "--bootloader", "none", "--no-dtr-reset"),
        ),
        "ready",
    )
    node = RosNode(
        "towtank_daq",
        "adc_board",
        "/measured",
        "adc_board",
        {"rig": str(rig_path("nit_calicut_2012")), "port": str(tmp_path / "board")},
        lifecycle=True,
    )
    graph = (board, node)
    processes = ProcessGroup(tmp_path / "logs")
    conductor = None
    try:
        processes.start(graph, processes.check)
        conductor = open_conductor(graph, processes.check, print)
        states = []
        conductor.create_subscription(
            CrankDrive, "/measured/crank_drive/state", states.append, RELIABLE_QOS
        )
        conductor.bring_up()
        status, words = crank("run", "61")
        assert (status, "give 5 to 60 rpm" in words) == (1, True)
        assert crank("run", "10") == (0, "")
        conductor.wait_until(lambda: states and states[-1].crank_rate > 0.5, 20.0, "turning")
        assert crank("stop") == (0, "")
        conductor.wait_until(lambda: states[-1].state == CrankDrive.STOPPED, 20.0, "rest")
        assert states[-1].trip == CrankDrive.NONE
        conductor.shut_down()
    finally:
        if conductor is not None:
            conductor.close()
            rclpy.shutdown()
        processes.stop()


@pytest.mark.timeout(60)
def test_without_a_board_it_says_so():
    status, words = crank("stop")
    assert status == 1
    assert "start a trial on the board first" in words
