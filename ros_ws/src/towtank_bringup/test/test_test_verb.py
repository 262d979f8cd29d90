# SPDX-License-Identifier: Apache-2.0
"""`towtank test` runs steps beside one another: all are run, told of, and ended with it."""

from __future__ import annotations

import sys
import time

import pytest
from towtank_bringup.verbs.test import _beside


def python(program: str) -> tuple[str, ...]:
    return (sys.executable, "-c", program)


def test_what_runs_beside_is_said_whole_at_the_end_with_its_failures(tmp_path, capfdbinary):
    bad = python("print('second'); raise SystemExit(3)")
    with _beside([python("print('first')"), bad, python("print('third')")], tmp_path) as failures:
        print("the other", flush=True)
    assert failures == [" ".join(bad)]
    out = capfdbinary.readouterr().out.decode().split()
    assert out == ["the", "other", "first", "second", "third"]


def test_an_interrupt_ends_the_step_beside_and_starts_no_other(tmp_path, capfdbinary):
    begun = tmp_path / "begun"
    endless = python(f"import pathlib, time; pathlib.Path({str(begun)!r}).touch(); time.sleep(600)")
    with (
        pytest.raises(KeyboardInterrupt),
        _beside([endless, python("print('next')")], tmp_path),
    ):
        while not begun.exists():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert b"next" not in capfdbinary.readouterr().out
