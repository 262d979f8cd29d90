# SPDX-License-Identifier: Apache-2.0
"""What the host wants of the crank's drive, on a board that keeps a list of what it was told."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.board import BoardError, NoAnswer
from towtank_daq.crank_drive import RPM, CrankDrive


class Board:
    """Says yes to everything, or raises what it is given."""

    def __init__(self) -> None:
        self.told: list[tuple] = []
        self.error: Exception | None = None
        self.lost: list[Exception] = []  # told all the same
        self.on_drive = lambda: None
        self.statistics = SimpleNamespace(restarts=0, reconnections=0)
        self.drive_state = SimpleNamespace(trip="none")

    def drive(self, action, speed_rpm=0.0, counts_per_revolution=0):
        if self.error:
            raise self.error
        self.told.append((action, speed_rpm, counts_per_revolution))
        if self.lost:
            raise self.lost.pop()
        on_drive, self.on_drive = self.on_drive, lambda: None
        on_drive()


class Host:
    def __init__(self) -> None:
        self.now_s = 100.0
        self.dropped: list[str] = []
        self.board = Board()
        self.drive = CrankDrive(-4096, self.dropped.append, lambda: self.now_s)

    def pass_time(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.now_s += 0.05
            self.drive.serve(self.board)


@pytest.fixture
def host():
    return Host()


def test_nothing_is_said_unasked(host):
    host.pass_time(10.0)
    assert host.board.told == []


def test_a_running_crank_is_kept_on_until_something_else_is_asked_for(host):
    asked = host.drive.ask("run", 30 * RPM)
    host.pass_time(1.0)
    assert asked.done()
    assert asked.exception() is None
    assert len(host.board.told) == 4  # every 0.25 s; the board gives up after 1 s
    assert host.board.told[0] == ("run", pytest.approx(30.0), -4096)
    assert set(host.board.told[1:]) == {("keep", 0.0, 0)}  # "run" would start a reset board
    host.board.told.clear()
    host.drive.ask("stop")
    host.pass_time(5.0)
    assert host.board.told == [("stop", 0.0, 0)]


def test_a_refusal_reaches_the_one_who_asked_and_ends_it(host):
    host.board.error = BoardError("the crank cannot be driven at 70 rpm: give 5 to 60 rpm")
    asked = host.drive.ask("run", 70 * RPM)
    host.pass_time(0.1)
    with pytest.raises(BoardError, match="give 5 to 60 rpm"):
        asked.result(0)
    host.board.error = None
    host.pass_time(5.0)
    assert host.board.told == []


@pytest.mark.parametrize("what", ["restarts", "reconnections"])
def test_a_crank_does_not_start_by_itself_after_an_interruption(host, what):
    host.drive.ask("run", 30 * RPM)
    host.pass_time(1.0)
    setattr(host.board.statistics, what, 1)
    host.board.told.clear()
    host.pass_time(5.0)
    assert host.board.told == [("watch", 0.0, -4096)]
    assert host.dropped == [
        "the crank is no longer driven: the board or its line was gone: set the crank's speed again"
    ]
    host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    assert len(host.board.told) == 2


@pytest.mark.parametrize("driven", [False, True])
def test_a_board_that_was_reset_is_told_of_the_encoder_of_a_crank_that_was_driven(host, driven):
    """Until it knows; a crank that this host never drove may turn by a motor of its own."""
    if driven:
        host.drive.ask("run", 30 * RPM)
        host.drive.ask("stop")
        host.pass_time(1.0)
    host.board.told.clear()
    host.board.statistics.restarts = 1
    host.board.error = BoardError("the board does not answer 'drive': check its cable")
    host.pass_time(1.0)
    assert host.board.told == []
    host.board.error = None
    host.pass_time(5.0)
    assert host.board.told == ([("watch", 0.0, -4096)] if driven else [])
    assert host.dropped == []


def test_a_fault_of_the_program_behind_a_run_is_followed_by_a_stop(host):
    """What came with the answer was worked on badly, and the crank may turn."""
    host.board.lost = [ZeroDivisionError("a scan's conversion")]
    asked = host.drive.ask("run", 30 * RPM)
    with pytest.raises(ZeroDivisionError):
        host.drive.serve(host.board)
    assert [action for action, *_ in host.board.told] == ["run", "stop"]
    assert isinstance(asked.exception(timeout=0.0), ZeroDivisionError)


def test_a_trip_ends_the_wish(host):
    host.drive.ask("run", 30 * RPM)
    host.pass_time(1.0)
    host.board.drive_state = SimpleNamespace(trip="stall")
    host.board.told.clear()
    host.pass_time(1.0)
    host.board.drive_state = SimpleNamespace(trip="none")  # somebody has cleared it
    host.pass_time(5.0)
    assert host.board.told == []
    assert host.dropped == ["the crank is no longer driven: the drive has tripped (stall)"]


def test_a_failure_in_the_run_is_told(host):
    host.drive.ask("run", 30 * RPM)
    host.pass_time(1.0)
    host.board.error = OSError("port board is gone")
    host.pass_time(1.0)
    host.board.error = None
    host.pass_time(1.0)
    assert host.dropped == ["the crank is no longer driven: port board is gone"]


def test_who_waits_is_answered_when_the_board_is_given_up(host):
    asked, gone = host.drive.ask("run", 30 * RPM), host.drive.ask("stop")
    gone.cancel()
    host.drive.refuse("the board's node is not active any more")
    with pytest.raises(BoardError, match="not active"):
        asked.result(0)
    host.pass_time(1.0)
    assert host.board.told == []


def test_a_run_that_waits_is_taken_back(host):
    asked = host.drive.ask("run", 30 * RPM)
    host.drive.take_back(asked)
    host.pass_time(1.0)
    assert host.board.told == []


def test_a_run_on_its_way_is_taken_back_by_a_stop(host):
    host.board.on_drive = lambda: host.drive.take_back(asked)
    asked = host.drive.ask("run", 30 * RPM)
    host.pass_time(1.0)
    assert host.board.told == [("run", pytest.approx(30.0), -4096), ("stop", 0.0, 0)]


def test_a_driven_crank_is_stopped_on_release(host):
    host.drive.release(host.board)
    assert host.board.told == []
    host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    host.drive.release(host.board)
    assert host.board.told[-1] == ("stop", 0.0, 0)
    host.drive.release(host.board)
    assert len(host.board.told) == 2


def test_a_board_that_cannot_be_told_to_stop_is_told_of(host):
    """Without an error: the stream is still to be stopped, and the board stops the crank itself."""
    host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    host.board.error = OSError("port board is gone")
    host.drive.release(host.board)
    assert host.dropped == ["the crank is no longer driven: port board is gone"]


def test_a_driver_that_was_given_up_wants_no_crank(host):
    """As the node does at its deactivation: the next run begins at rest."""
    host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    waiting = host.drive.ask("run", 20 * RPM)
    host.drive.release(host.board)
    host.drive.refuse("the board's node is not active any more")
    assert [word for word, *_ in host.board.told] == ["run", "stop"]
    assert isinstance(waiting.exception(0), BoardError)
    host.pass_time(1.0)
    assert len(host.board.told) == 2


@given(st.lists(st.sampled_from(["run", "stop", "emergency_stop", "clear_trip", "cancelled run"])))
def test_the_last_word_holds(words):
    host = Host()
    for word in words:
        asked = host.drive.ask(word.split()[-1], 30 * RPM)
        if word.startswith("cancelled"):
            asked.cancel()
    host.pass_time(0.1)
    host.board.told.clear()
    host.pass_time(1.0)
    heard = [word for word in words if not word.startswith("cancelled")]
    assert bool(host.board.told) == (bool(heard) and heard[-1] == "run")


def test_a_trip_that_a_reset_made_the_board_forget_must_be_cleared(host):
    host.board.drive_state = SimpleNamespace(trip="runaway")
    host.pass_time(0.1)
    for forgotten in (None, SimpleNamespace(trip="none")):
        host.board.drive_state = forgotten
        asked = host.drive.ask("run", 30 * RPM)
        host.pass_time(0.1)
        with pytest.raises(BoardError, match=r"forgotten its trip \(runaway\): .*main"):
            asked.result(0)
    assert host.board.told == []
    host.drive.ask("clear_trip")
    asked = host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    assert asked.exception() is None


def test_a_trip_is_not_told_again_by_the_state_that_was_there_before_it_was_cleared(host):
    host.board.drive_state = SimpleNamespace(trip="stall")
    host.pass_time(0.1)
    host.drive.ask("clear_trip")
    host.pass_time(0.1)
    assert host.drive.trip == "none"
    host.board.drive_state = SimpleNamespace(trip="stall")  # the next one
    host.pass_time(0.1)
    assert host.drive.trip == "stall"


@pytest.mark.parametrize("error", [NoAnswer("nothing comes"), OSError("the port is gone")])
def test_a_start_without_an_answer_is_followed_by_a_stop(host, error):
    """It may have come, and only the answer was lost: the crank would start, asked for by nobody
    who knows of it. No word to keep on follows, whatever becomes of the stop."""
    host.board.lost = [error, error]
    asked = host.drive.ask("run", 30 * RPM)
    host.pass_time(2.0)
    assert asked.exception() is error
    assert [action for action, *_ in host.board.told] == ["run", "stop"]


def test_a_refused_speed_leaves_a_running_crank_running(host):
    host.drive.ask("run", 30 * RPM)
    host.pass_time(0.1)
    host.board.lost = [BoardError("give 5 to 60 rpm")]
    host.drive.ask("run", 61 * RPM)
    host.pass_time(0.5)
    actions = [action for action, *_ in host.board.told]
    assert actions[:3] == ["run", "run", "keep"]
    assert "stop" not in actions
