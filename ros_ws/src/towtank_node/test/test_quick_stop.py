# SPDX-License-Identifier: Apache-2.0
"""The emergency stop past ROS 2."""

from __future__ import annotations

import threading

import pytest
from towtank_node import quick_stop as module
from towtank_node.quick_stop import QuickStop, listens, quick_stop

DOMAIN = 100_000
"""There is no such ROS domain, so that no crank of this machine listens there."""


@pytest.fixture
def listening():
    made = []

    def listen(stop, domain=DOMAIN):
        made.append(QuickStop(domain, stop))
        return made[-1]

    yield listen
    for each in made:
        each.close()


def test_it_is_done_and_answered(listening):
    calls = []
    listening(lambda: calls.append("stop") or "")
    assert quick_stop(DOMAIN) == ""
    assert quick_stop(DOMAIN) == ""
    assert calls == ["stop", "stop"]


def test_why_it_was_not_done_is_told(listening):
    listening(lambda: "the board does not answer — see its cable")
    assert quick_stop(DOMAIN) == "the board does not answer — see its cable"


def test_where_nobody_listens_it_is_known_at_once(listening):
    assert quick_stop(DOMAIN) is None
    listening(lambda: "").close()
    assert quick_stop(DOMAIN) is None
    listening(lambda: "")  # the name is free again
    assert quick_stop(DOMAIN) == ""
    assert quick_stop(DOMAIN + 1) is None


def test_that_one_listens_is_seen_without_a_stop(listening):
    calls = []
    assert not listens(DOMAIN)
    made = listening(lambda: calls.append("stop") or "")
    assert listens(DOMAIN)
    assert not listens(DOMAIN // 10)  # a part of the number is another domain
    made.close()
    assert not listens(DOMAIN)
    assert calls == []


def test_a_second_one_in_a_domain_is_refused(listening):
    listening(lambda: "")
    with pytest.raises(OSError, match="in use"):
        listening(lambda: "")


def test_another_user_is_neither_heard_nor_believed(listening, monkeypatch):
    calls = []
    listening(lambda: calls.append("stop") or "")
    monkeypatch.setattr(module, "_peer", lambda connection: 4_000_000)
    assert quick_stop(DOMAIN) is None
    assert calls == []


def test_one_that_hangs_is_given_up(listening, monkeypatch):
    ended = threading.Event()
    monkeypatch.setattr(module, "ANSWER_S", 0.2)
    listening(lambda: str(ended.wait(30)))
    assert quick_stop(DOMAIN) is None
    ended.set()
