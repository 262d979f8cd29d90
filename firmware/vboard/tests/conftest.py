# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds what the tests run, and starts virtual boards for them."""

from __future__ import annotations

import fcntl
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

TESTS = Path(__file__).resolve().parent
VBOARD = TESTS.parent
BUILD = VBOARD.parents[1] / "build/firmware"
sys.path[:0] = [str(VBOARD), str(TESTS)]

from probe_link import Probe  # noqa: E402
from vboard import VirtualBoard  # noqa: E402


@pytest.fixture(scope="session", autouse=True)
def _built() -> None:
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "test-programs.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # test runs beside this one build the same files
        made = subprocess.run(
            ["make", "-C", str(VBOARD), "test-programs"],
            capture_output=True,
            text=True,
            check=False,
        )
    assert made.returncode == 0, made.stdout + made.stderr


@pytest.fixture
def open_probe() -> Iterator[Callable[..., Probe]]:
    """Starts boards with the tests' own firmware; noise off unless asked for."""
    with ExitStack() as stack:

        def open_one(**options: Any) -> Probe:
            options.setdefault("noise_volts", 0.0)
            board = stack.enter_context(VirtualBoard(BUILD / "vboard/probe.elf", **options))
            return Probe(board)

        yield open_one


@pytest.fixture
def program() -> Path:
    """The executable."""
    return BUILD / "vboard/towtank-vboard"


@pytest.fixture
def board_elf() -> Path:
    """The real firmware."""
    elf = BUILD / "towtank_board.elf"
    assert elf.exists(), "the board's firmware is not built: make -C firmware"
    return elf
