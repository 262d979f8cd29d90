# SPDX-License-Identifier: Apache-2.0
"""Signals that end a trial at its next safe point."""

from __future__ import annotations

import os
import signal
import time

import click
import pytest
from towtank_bringup import calibration_session, cli
from towtank_bringup.environment import runtime_folder
from towtank_bringup.stop_request import Stopped, StopRequest, stopping_at_once
from towtank_lab.procedures import PRESSURE_COLUMNS
from towtank_lab.readings_file import read_rows


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


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_every_verb_puts_away_what_it_has_begun(monkeypatch, number):
    before = signal.getsignal(number)
    folders = []

    @click.command()
    def verb():
        with runtime_folder() as folder:
            folders.append(folder)
            try:
                os.kill(os.getpid(), number)
                time.sleep(10)
            finally:
                os.kill(os.getpid(), number)  # once more does not break off the clearing up
                folders.append("cleared up")

    monkeypatch.setattr(cli, "towtank", verb)
    monkeypatch.setattr("sys.argv", ["towtank"])
    assert cli._run() == 128 + number
    folder, *cleared_up = folders
    assert cleared_up == ["cleared up"]
    assert not folder.exists()
    assert signal.getsignal(number) == before


def test_a_calibrations_readings_are_kept_when_the_terminal_goes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [{"depth_m": 1.0, "volts": 2.5}]
    with pytest.raises(Stopped), stopping_at_once(), calibration_session._kept(rows):
        os.kill(os.getpid(), signal.SIGHUP)
        time.sleep(10)
    (path,) = tmp_path.glob("readings-*.csv")
    assert read_rows(path, PRESSURE_COLUMNS) == rows


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (OSError(28, "No space left on device", "/tmp/towtank-a"), "/tmp/towtank-a: No space left"),
        (OSError(5, "Input/output error"), "error: Input/output error"),
        (TimeoutError("timed out"), "error: timed out"),
    ],
)
def test_a_fault_of_the_system_is_one_line(monkeypatch, capsys, error, line):
    @click.command()
    def verb():
        raise error

    monkeypatch.setattr(cli, "towtank", verb)
    monkeypatch.setattr("sys.argv", ["towtank"])
    assert cli._run() == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert line in said


def test_hangup_that_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stopping_at_once(), StopRequest() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            stop.check()
        with stopping_at_once():
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
