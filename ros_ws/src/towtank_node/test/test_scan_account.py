# SPDX-License-Identifier: Apache-2.0
"""Missing scans, against a board that is made up here."""

import pytest
from towtank_node.scan_account import ScanAccount

PERIOD = 20_000  # ticks, 10 ms


def taken(*runs, tick_ns=500):
    """The account of runs, each numbered from 0: begin in ticks and the numbers that came in.
    A pair of begins stands for a board that was reset: by its time and by the host's."""
    account = ScanAccount()
    for begin, numbers in runs:
        board, host = begin if isinstance(begin, tuple) else (begin, begin)
        for number in numbers:
            account.take(number, board + PERIOD * number, tick_ns * (host + PERIOD * number))
    return account


def test_numbers_tell_within_a_run():
    account = taken((7, [0, 1, 4, 5, 9]))
    assert (account.received, account.lost) == (5, 5)


@pytest.mark.parametrize("aside", [-9_000, 0, 9_000])
def test_board_time_tells_between_runs_whatever_their_phase(aside):
    """The last of one run and the first two of the next did not come in."""
    begin = 500 * PERIOD + aside
    account = taken((0, range(99)), (begin, range(2, 50)))
    assert account.lost == 502 - 98 - 1


@pytest.mark.parametrize("tick_ns", [500, 4000])
def test_host_time_tells_where_the_board_was_reset(tick_ns):
    """Of a board of 2 MHz, and of one of 250 kHz: its scans say how long its ticks are."""
    account = taken(
        (90_000_000, range(100)),
        ((3_000_000, 90_000_000 + 500 * PERIOD), range(50)),
        tick_ns=tick_ns,
    )
    assert account.lost == 400


def test_several_runs_and_doubled_scans():
    account = taken((0, [0, 0, 1]), (10 * PERIOD, [0]), (20 * PERIOD, [0, 1, 1, 3]))
    assert (account.received, account.lost) == (6, 8 + 9 + 1)


def test_gap_right_behind_the_first_scan():
    assert taken((0, [5]), (20 * PERIOD, [0, 1])).lost == 14
