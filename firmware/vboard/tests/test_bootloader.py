# SPDX-License-Identifier: GPL-3.0-or-later
"""The bootloader before the firmware: what the host sees after each cause of a reset."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from board_link import BOOT, IDENTIFY, RESET, RESPONSE, Frames, request
from vboard import Bootloader, ResetCause, VirtualBoard

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
START_UP_S, WINDOW_S, HOLD_S = 0.065, 0.85, 9.0
INITIALISATION_S = 0.02  # of the firmware, up to the end of its boot frame
FROM_OUTSIDE = (  # the other causes are the firmware's own mark, and a debugger
    ResetCause.POWER_ON,
    ResetCause.EXTERNAL,
    ResetCause.BROWN_OUT,
    ResetCause.WATCHDOG,
)

Open = Callable[..., VirtualBoard]


@pytest.fixture
def open_board(board_elf: Path) -> Iterator[Open]:
    with ExitStack() as stack:

        def open_one(**options: Any) -> VirtualBoard:
            options.setdefault("bootloader", Bootloader.SHIPPED)
            return stack.enter_context(VirtualBoard(board_elf, noise_volts=0.0, **options))

        yield open_one


def boots_after_s(board: VirtualBoard, patience_s: float) -> tuple[float, int] | None:
    """When the next boot frame is there, s from now, and the cause that it tells."""
    frames, start_ns = Frames(), board.now_ns
    while board.now_ns < start_ns + patience_s * SECOND:
        board.run_until(board.now_ns + MILLISECOND)
        frames.take(board.read())
        if boots := frames.of_type(BOOT):
            return (board.now_ns - start_ns) / SECOND, boots[0][1]
    return None


def run(board: VirtualBoard, seconds: float) -> None:
    board.run_until(board.now_ns + round(seconds * SECOND))


@pytest.mark.parametrize("cause", FROM_OUTSIDE)
def test_every_reset_passes_through_it_and_its_cause_is_lost(open_board, cause):
    board = open_board()
    assert boots_after_s(board, 2.0) is not None
    board.reset(cause)
    after_s, told = boots_after_s(board, 2.0)
    assert after_s == pytest.approx(START_UP_S + WINDOW_S, abs=INITIALISATION_S)
    assert told == 0


def test_a_watchdog_that_strikes_by_itself_passes_through_it(open_board):
    """The firmware resets itself by it at the host's request; 0.5 s until it strikes."""
    board = open_board()
    assert boots_after_s(board, 2.0) is not None
    board.write(request(RESET, 1))
    after_s, told = boots_after_s(board, 3.0)
    assert after_s == pytest.approx(0.5 + START_UP_S + WINDOW_S, abs=0.1)
    assert told == 0x20  # `command`: the firmware's own mark in RAM


def test_a_byte_in_its_window_holds_it(open_board):
    board = open_board()
    run(board, 0.5)
    board.write(b"\0")
    after_s, _ = boots_after_s(board, 12.0)
    assert after_s == pytest.approx(HOLD_S, abs=INITIALISATION_S)


def test_each_further_byte_holds_it_anew(open_board):
    """A host that asks every second is never answered; one that is quiet then is."""
    board = open_board()
    run(board, 0.5)
    for number in range(20):
        board.write(request(IDENTIFY, number))
        run(board, 1.0)
    assert board.read() == b""
    assert boots_after_s(board, 10.0)[0] == pytest.approx(HOLD_S - 1.0, abs=INITIALISATION_S)


def test_a_byte_before_its_window_is_lost(open_board):
    board = open_board()
    run(board, START_UP_S - 0.01)
    board.write(request(IDENTIFY, 1))
    run(board, 0.005)
    assert boots_after_s(board, 2.0)[0] == pytest.approx(WINDOW_S, abs=2 * INITIALISATION_S)
    assert board.read() == b""


def test_a_reset_lets_go_of_a_board_that_is_held(open_board):
    board = open_board()
    run(board, 0.5)
    board.write(b"\0")
    run(board, 1.0)
    board.reset(ResetCause.EXTERNAL)
    assert boots_after_s(board, 2.0)[0] < 1.0


def test_the_firmware_behind_it_is_well(open_board):
    board = open_board(clock_ppm=5000.0)
    assert boots_after_s(board, 2.0) is not None
    board.write(request(IDENTIFY, 9))
    run(board, 0.05)
    frames = Frames()
    frames.take(board.read())
    (identity,) = frames.of_type(IDENTIFY | RESPONSE)
    assert struct.unpack_from("<BBB", identity) == (IDENTIFY | RESPONSE, 9, 0)


def test_pins_are_free_while_it_runs(open_board):
    """A motor that was on is off: pull-downs hold its lines."""
    board = open_board(crank_motor={})
    run(board, 0.5)
    assert board.counters()["motor_duty"] == 0.0


def test_an_old_one_never_ends_after_a_watchdog_reset_until_the_power_goes(open_board):
    board = open_board(bootloader=Bootloader.OLD)
    assert boots_after_s(board, 2.0) == (pytest.approx(0.925, abs=0.02), ResetCause.POWER_ON)
    board.reset(ResetCause.EXTERNAL)
    assert boots_after_s(board, 2.0)[1] == ResetCause.EXTERNAL
    board.reset(ResetCause.WATCHDOG)
    assert boots_after_s(board, 15.0) is None
    board.reset(ResetCause.EXTERNAL)  # the reset button does not help
    assert boots_after_s(board, 15.0) is None
    board.reset(ResetCause.POWER_ON)
    assert boots_after_s(board, 2.0)[1] == ResetCause.POWER_ON


def test_without_it_the_firmware_starts_at_once(open_board):
    board = open_board(bootloader=Bootloader.NONE)
    for cause in FROM_OUTSIDE:
        board.reset(cause)
        assert boots_after_s(board, 1.0) == (pytest.approx(0.01, abs=0.01), cause)
