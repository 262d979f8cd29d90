# SPDX-License-Identifier: Apache-2.0
"""Signals that end a trial at its next safe point."""

from __future__ import annotations

import os
import signal

import pytest
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


def test_hangup_that_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopRequest() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            stop.check()
    finally:
        signal.signal(signal.SIGHUP, before)
