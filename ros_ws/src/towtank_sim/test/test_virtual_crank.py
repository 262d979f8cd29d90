# SPDX-License-Identifier: Apache-2.0
"""The virtual tank's crank obeys as the board's drive does."""

from __future__ import annotations

import math

import pytest
from towtank_sim.drive import Drive, DriveError
from towtank_sim.virtual_crank import COASTING_RATE, RPM, VirtualCrank


@pytest.fixture
def crank() -> VirtualCrank:
    return VirtualCrank(Drive())


def states(crank: VirtualCrank, *times: float) -> list[tuple[str, float]]:
    """State and speed in rpm at some times."""
    return [
        (status.state, pytest.approx(status.rate / RPM, abs=1e-9))
        for status in map(crank.status, times)
    ]


def test_it_runs_and_stops_along_the_boards_ramp(crank):
    crank.run(1.0, 30 * RPM)  # at 10 rpm/s
    assert states(crank, 1.0, 2.5, 4.0, 20.0) == [
        ("running", 0.0),
        ("running", 15.0),
        ("running", 30.0),
        ("running", 30.0),
    ]
    crank.run(20.0, 10 * RPM)
    assert states(crank, 22.0) == [("running", 10.0)]
    crank.stop(30.0)
    assert states(crank, 30.5, 31.0) == [("stopping", 5.0), ("stopped", 0.0)]


def test_a_second_stop_does_not_put_the_rest_off(crank):
    crank.run(0.0, 30 * RPM)
    crank.stop(10.0)
    crank.stop(12.9)
    assert states(crank, 13.0) == [("stopped", 0.0)]


def test_an_emergency_stop_is_a_trip_until_it_is_cleared(crank):
    crank.run(0.0, 30 * RPM)
    crank.emergency_stop(10.0)
    rest = 10.0 + 30 * RPM / COASTING_RATE
    assert rest < 12.0
    assert states(crank, 10.0, rest) == [("tripped", 30.0), ("tripped", 0.0)]
    assert crank.status(rest).trip == "emergency_stop"
    with pytest.raises(DriveError, match=r"stopped \(emergency stop\): clear the trip"):
        crank.run(20.0, 10 * RPM)
    with pytest.raises(DriveError, match="clear the trip"):
        crank.follow(20.0, 1.0, 4.0)
    crank.stop(20.0)
    assert states(crank, 21.0) == [("tripped", 0.0)]
    crank.clear_trip()
    assert states(crank, 21.0) == [("stopped", 0.0)]
    crank.run(21.0, 10 * RPM)
    assert states(crank, 22.0) == [("running", 10.0)]


def test_the_end_of_a_trial_does_not_lengthen_an_emergency_stop(crank):
    crank.run(0.0, 30 * RPM)
    crank.emergency_stop(10.0)
    crank.follow(10.1, 0.0, 60.0)
    assert states(crank, 12.0) == [("tripped", 0.0)]


def test_a_standing_crank_trips_too(crank):
    crank.emergency_stop(5.0)
    assert states(crank, 5.0) == [("tripped", 0.0)]


@pytest.mark.parametrize("rpm", [0.0, 4.99, 60.01, -30.0, math.nan, math.inf])
def test_what_the_board_refuses_is_refused(crank, rpm):
    with pytest.raises(DriveError, match="give 5 to 60 rpm"):
        crank.run(0.0, rpm * RPM)
    assert states(crank, 1.0) == [("stopped", 0.0)]


def test_a_trial_may_want_what_the_verbs_may_not(crank):
    """Its rig's crank need not be one that the board drives."""
    crank.follow(0.0, 100 * RPM, 4.0)
    assert states(crank, 4.0) == [("running", 100.0)]
    crank.follow(10.0, 0.0, 4.0)
    assert states(crank, 12.0, 14.0) == [("stopping", 50.0), ("stopped", 0.0)]
