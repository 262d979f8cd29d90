# SPDX-License-Identifier: Apache-2.0
"""`towtank crank`: which trial it means, and on a board whose node runs: the real firmware, the
virtual motor."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
import rclpy
from domain_coordinator import domain_id
from towtank_bringup.conductor import open_conductor
from towtank_bringup.crank_call import CrankCalls
from towtank_bringup.graph import FIRMWARE_IMAGE, VIRTUAL_BOARD, Program, RosNode
from towtank_bringup.plan import firmware_folder
from towtank_bringup.processes import ProcessGroup
from towtank_bringup.rigs import rig_path
from towtank_bringup.ros_domain import DomainError, domain_of_environment
from towtank_bringup.run_file import RunFileError, RunningTrial, _process_start
from towtank_bringup.verbs.crank import (
    _domain_besides,
    _not_stopped_quickly,
    emergency_domains,
    one_domain,
)
from towtank_interfaces.msg import CrankDrive
from towtank_node import names, topics
from towtank_node.endpoints import publisher, server, subscription
from towtank_node.executor import StreamExecutor
from towtank_node.quick_stop import quick_stop
from towtank_node.services import SET_CRANK_SPEED

CLI = """
import os, pathlib
from towtank_bringup import cli, run_file
place = pathlib.Path(os.environ["XDG_RUNTIME_DIR"], "towtank")
run_file._places = lambda: [place]
cli.main()
"""
"""The command, which sees no other trials of this user: a test must not stop these."""


def crank(*words: str) -> tuple[int, str]:
    """Exit status and last line of the error stream."""
    done = subprocess.run(
        [sys.executable, "-c", CLI, "crank", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stderr.strip()


@pytest.fixture
def empty_domain():
    """A ROS domain in which none of this module's nodes is still being forgotten."""
    with domain_id() as domain:
        yield domain


@pytest.fixture
def runtime(monkeypatch, tmp_path):
    """A runtime folder for run files."""
    folder = tmp_path / "runtime"
    folder.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    return folder / "towtank"


@pytest.mark.real_time
@pytest.mark.timeout(120)
def test_the_crank_obeys(tmp_path, runtime, monkeypatch):
    """Also where the trial's own process hangs: the calls go past it to the board's node."""
    firmware = firmware_folder()
    board = Program(
        "virtual_board",
        (
            *(str(firmware / VIRTUAL_BOARD), "--elf", str(firmware / FIRMWARE_IMAGE)),
            *("--pty-link", str(tmp_path / "board"), "--bench-socket", str(tmp_path / "bench")),
            "--crank-motor",
        ),
        "ready",
    )
    node = RosNode(
        "towtank_daq",
        "adc_board",
        *names.split_name(names.BOARD_NODE),
        {"rig": str(rig_path("nit_calicut_2012")), "port": str(tmp_path / "board")},
        lifecycle=True,
    )
    hung = subprocess.Popen(["sleep", "600"])
    hung.send_signal(signal.SIGSTOP)
    graph = (board, node)
    processes = ProcessGroup(tmp_path / "logs")
    conductor = None
    try:
        processes.start(graph, processes.check)
        conductor = open_conductor(graph, processes.check, print)
        states = []
        subscription(conductor, topics.CRANK_DRIVE, states.append)
        conductor.bring_up()
        trial = led_by(hung, tmp_path / "trial", int(os.environ["ROS_DOMAIN_ID"]))
        runtime.mkdir(mode=0o700)
        (runtime / trial.file_name).write_text(trial.text())
        monkeypatch.delenv("ROS_DOMAIN_ID")
        status, words = crank("run", "61")
        assert (status, "give 5 to 60 rpm" in words) == (1, True)
        assert crank("run", "10") == (0, "")
        conductor.wait_until(lambda: states and states[-1].crank_rate > 0.5, 20.0, "turning")
        assert crank("stop") == (0, "")
        conductor.wait_until(lambda: states[-1].state == CrankDrive.STOPPED, 20.0, "rest")
        assert states[-1].trip == CrankDrive.NONE

        assert crank("run", "10", "--trial", str(tmp_path / "trial")) == (0, "")
        conductor.wait_until(lambda: states[-1].crank_rate > 0.5, 20.0, "turning")
        status, words = crank("emergency-stop")
        assert (status, words) == (0, f"emergency stop: {trial}")
        conductor.wait_until(lambda: states[-1].state == CrankDrive.TRIPPED, 5.0, "trip")
        assert states[-1].trip == CrankDrive.EMERGENCY_STOP
        status, words = crank("run", "10")
        assert (status, "emergency stop" in words) == (1, True)
        assert crank("clear") == (0, "")
        conductor.wait_until(lambda: states[-1].state == CrankDrive.STOPPED, 20.0, "cleared")
        assert quick_stop(trial.domain) == ""
        conductor.wait_until(lambda: states[-1].state == CrankDrive.TRIPPED, 20.0, "trip")
        assert crank("clear") == (0, "")
        assert crank("run", "5") == (0, "")
        conductor.wait_until(lambda: states[-1].crank_rate > 0.3, 20.0, "turning")
        conductor.bring_crank_to_rest()  # as a trial does at its end
        assert (states[-1].state, states[-1].trip) == (CrankDrive.STOPPED, CrankDrive.NONE)
        conductor.shut_down()
    finally:
        hung.kill()
        hung.wait()
        if conductor is not None:
            conductor.close()
            rclpy.shutdown()
        processes.stop()


def led_by(process, directory: Path, domain: int) -> RunningTrial:
    trial = RunningTrial.of_this_process(directory, domain, False)
    return replace(trial, pid=process.pid, process_start=_process_start(process.pid))


def running(*trials: tuple[str, int]) -> list[RunningTrial]:
    return [RunningTrial.of_this_process(Path(name), domain, False) for name, domain in trials]


def test_without_a_trial_it_says_so_at_once(runtime, monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    for verb, remedy in (("stop", "`towtank trial`"), ("emergency-stop", "emergency-stop button")):
        status, words = crank(verb)
        assert (status, remedy in words, len(words.splitlines())) == (1, True, 1), words


def test_one_trial_is_asked():
    assert one_domain(running(("/a", 7)), None, None) == 7
    both = running(("/a", 7), ("/b", 8))
    assert one_domain(both, Path("/b"), None) == 8
    with pytest.raises(RunFileError, match="2 trials run: say which with --trial DIR"):
        one_domain(both, None, None)


def test_a_domain_that_is_set_is_where_is_asked():
    """As everywhere in ROS: also of a graph that was started by hand, which has no run file."""
    both = running(("/a", 7), ("/b", 8))
    assert one_domain(both, None, 8) == 8
    assert one_domain(both, None, 9) == 9
    assert one_domain([], None, 9) == 9
    assert one_domain(both, Path("/a"), 8) == 7


def test_an_emergency_stop_goes_to_all():
    both = running(("/a", 7), ("/b", 8))
    assert emergency_domains(both, None, None) == ([7, 8], [])
    assert emergency_domains(both, None, 7) == ([7, 8], [])
    assert emergency_domains(both, None, 9) == ([7, 8], [9])
    assert emergency_domains([], None, 9) == ([9], [])
    assert emergency_domains(both, Path("/b"), 9) == ([8], [])
    with pytest.raises(RunFileError, match="no trial of yours runs"):
        emergency_domains([], None, None)


@pytest.mark.parametrize("text", ["300", "-1", "seven", "7.0", "²", "010", "0x7", " 7"])
def test_a_domain_that_there_is_not_is_named(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(DomainError, match="give 0 to 232, or unset it"):
        domain_of_environment()


def test_a_node_that_hangs_keeps_no_other_from_its_stop(monkeypatch):
    """The first answers only after the second was asked."""
    second_asked = threading.Event()

    def quick_stop(domain):
        if domain == 8:
            second_asked.set()
            return ""
        return None if second_asked.wait(60.0) else "the second was not asked"

    monkeypatch.setattr("towtank_bringup.verbs.crank.quick_stop", quick_stop)
    assert _not_stopped_quickly([7, 8]) == [7]
    assert second_asked.is_set()
    assert _not_stopped_quickly([]) == []


def test_a_domain_that_there_is_not_keeps_no_emergency_stop(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "300")
    assert _domain_besides(running(("/a", 7))) is None
    with pytest.raises(DomainError, match="ROS_DOMAIN_ID is '300'"):
        _domain_besides([])


def test_a_domain_that_cannot_be_entered_keeps_no_call_from_the_others(monkeypatch):
    class Answering:
        def __init__(self, domain):
            if domain == 8:
                raise RuntimeError("failed to initialize\nat line 1")

        def attend(self, request, repeat_s):
            return True

        def refusal(self):
            return ""

        def close(self):
            pass

    monkeypatch.setattr("towtank_bringup.crank_call._Drive", Answering)
    with CrankCalls([8, 7]) as calls:
        told = calls.ask("EMERGENCY_STOP", insistent=[8, 7])
    assert told == {8: "ROS domain 8 cannot be entered: failed to initialize"}


@pytest.mark.parametrize(("runs", "told"), [(True, []), (False, ["does not answer"])])
def test_a_start_whose_answer_got_lost_is_judged_by_the_drives_state(monkeypatch, runs, told):
    """It is asked for once: a second request could follow a stop that somebody made between."""
    monkeypatch.setattr("towtank_bringup.crank_call._WAIT_S", 60.0 if runs else 10.0)
    context = rclpy.Context()
    domain = int(os.environ["ROS_DOMAIN_ID"])
    rclpy.init(context=context, domain_id=domain)
    board = rclpy.create_node("board", context=context)
    states = publisher(board, topics.CRANK_DRIVE)
    asked = []

    def lose(request, response):
        asked.append(request.crank_rate)
        raise LookupError  # the request is taken, and no answer given

    def tell():
        target = asked[-1] if runs and asked else 2.0
        states.publish(CrankDrive(state=CrankDrive.RUNNING, target_rate=target))

    server(board, SET_CRANK_SPEED, lose)
    board.create_timer(0.05, tell)
    ended = threading.Event()

    def spin():
        executor = StreamExecutor(context=context)
        executor.add_node(board)
        while not ended.is_set():
            with contextlib.suppress(LookupError):
                executor.spin_once()
        executor.shutdown()

    thread = threading.Thread(target=spin)
    thread.start()
    with CrankCalls([domain]) as calls:
        refusals = calls.ask("RUN", 3.0)
    ended.set()
    thread.join()
    board.destroy_node()
    context.shutdown()
    assert [word for why in refusals.values() for word in told if word in why] == told
    assert bool(refusals) != runs
    assert asked == [3.0]


@pytest.mark.timeout(60)
def test_a_domain_without_a_board_is_told_of_with_where_trials_run(
    runtime, empty_domain, monkeypatch
):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(empty_domain))
    trial = replace(running(("/trials/a", 0))[0], domain=232)
    runtime.mkdir(mode=0o700)
    (runtime / trial.file_name).write_text(trial.text())
    status, words = crank("stop")
    assert status == 1
    assert "start a trial on the board first" in words
    assert "ROS_DOMAIN_ID is" in words
    assert "/trials/a (real board, ROS domain 232" in words
