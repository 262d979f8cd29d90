# SPDX-License-Identifier: Apache-2.0
"""What a trial makes of the state of the crank's drive."""

from __future__ import annotations

import re

import pytest
from towtank_bringup.crank_watch import CrankWatch
from towtank_interfaces.msg import CrankDrive


def state(state=CrankDrive.RUNNING, trip=CrankDrive.NONE, target=3.0) -> CrankDrive:
    return CrankDrive(state=state, trip=trip, target_rate=target)


def held(*states: CrankDrive) -> CrankWatch:
    """A watch that holds the drive as it is after these states."""
    watch = CrankWatch()
    for each in states:
        watch.take(each)
    watch.hold(0.03)
    return watch


@pytest.mark.parametrize(
    ("next_state", "words"),
    [
        (state(), ""),
        (state(target=3.08), ""),
        (state(target=2.0), "set from 28.6 to 19.1 rpm from outside"),
        (state(CrankDrive.STOPPING, target=0.0), "stopped from outside"),
        (state(CrankDrive.STOPPED, target=0.0), "stopped from outside"),
        (
            state(CrankDrive.TRIPPED, CrankDrive.EMERGENCY_STOP),
            "stopped from outside: emergency stop",
        ),
        (state(CrankDrive.TRIPPED, CrankDrive.STALL), "has tripped: stall: free the crank"),
        (state(CrankDrive.STOPPING, CrankDrive.HOST_SILENCE), "has tripped: host silence"),
        (
            state(CrankDrive.TRIPPED, CrankDrive.OVERLOAD),
            "has tripped: overload: the crank does not reach its speed",
        ),
        (
            state(CrankDrive.TRIPPED, CrankDrive.RUNAWAY),
            "has tripped: runaway: .* cut the motor's supply at the main switch",
        ),
        (state(CrankDrive.TRIPPED, 77), "has tripped: trip 77: look at the drive"),
    ],
)
def test_a_run_needs_its_crank(next_state, words):
    watch = held(state())
    watch.take(next_state)
    assert re.search(words, watch.fault())
    assert bool(watch.fault()) == bool(words)
    watch.release()
    assert watch.fault() == ""


def test_a_crank_that_something_else_drives_is_not_judged_but_a_trip_is():
    """The board's drive stands all the while."""
    watch = held(state(CrankDrive.STOPPED, target=0.0))
    watch.take(state(CrankDrive.STOPPED, target=0.0))
    assert watch.fault() == ""
    watch.take(state(CrankDrive.TRIPPED, CrankDrive.EMERGENCY_STOP, 0.0))
    assert "emergency stop" in watch.fault()


def test_a_stop_just_before_the_run_ends_it():
    """The crank was steady, and is not yet slower, when it is held."""
    watch = held(state(), state(CrankDrive.STOPPING, target=0.0))
    assert watch.fault() == "the crank was stopped from outside"


def test_before_the_run_a_trip_is_told_once_and_may_be_cleared():
    watch = CrankWatch()
    tripped = state(CrankDrive.TRIPPED, CrankDrive.EMERGENCY_STOP, 0.0)
    told = [watch.take(each) for each in (state(), tripped, tripped)]
    assert [bool(words) for words in told] == [False, True, False]
    assert "`towtank crank clear`" in told[1]
    assert watch.fault() == ""
    assert watch.take(state()) == ""
    watch.hold(0.03)
    assert watch.fault() == ""


def test_without_a_drive_there_is_nothing_to_judge():
    watch = CrankWatch()
    watch.hold(0.03)
    assert watch.fault() == ""


def test_a_crank_turns_while_it_is_stopped():
    watch = CrankWatch()
    told = [watch.turns]
    for each in (
        state(),
        state(CrankDrive.STOPPING, target=0.0),
        state(CrankDrive.STOPPED, target=0.0),
    ):
        watch.take(each)
        told.append(watch.turns)
    assert told == [False, True, True, False]
