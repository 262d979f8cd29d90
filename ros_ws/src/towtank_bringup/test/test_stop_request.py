# SPDX-License-Identifier: Apache-2.0
"""Signals that end a trial at its next safe point."""

from __future__ import annotations

import os
import signal

import click
import pytest
from towtank_bringup import cli
from towtank_bringup.stop_request import Stopped, StopRequest


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_is_noted_and_told_when_asked(number):
    before = signal.getsignal(number)
    with StopRequest() as stop:
        stop.check()
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), signal.SIGTERM)  # the first one counts
        with pytest.raises(KeyboardInterrupt) as stopped:
            stop.check()
    assert isinstance(stopped.value, Stopped)
    assert stopped.value.status == 128 + number
    assert signal.getsignal(number) == before


@pytest.mark.parametrize(
    ("error", "status"),
    [(Stopped(signal.SIGHUP), 129), (Stopped(signal.SIGTERM), 143), (KeyboardInterrupt(), 130)],
)
def test_command_ends_with_the_signals_status(monkeypatch, error, status):
    @click.command()
    def verb():
        raise error

    monkeypatch.setattr(cli, "towtank", verb)
    monkeypatch.setattr("sys.argv", ["towtank"])
    assert cli._run() == status


def test_hangup_that_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopRequest() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            stop.check()
    finally:
        signal.signal(signal.SIGHUP, before)
