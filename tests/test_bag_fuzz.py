# SPDX-License-Identifier: Apache-2.0
"""A slice of `towtank bench bag-fuzz`."""

import sys
from collections import Counter
from pathlib import Path
from unittest.mock import patch

import pytest

sys.path.append(str(Path(__file__).parent / "benchmarks"))

import bag_fuzz
from towtank_compare import compare


@pytest.fixture(scope="module")
def quick():
    """No text is parsed twice; other tests may run in this process."""
    bag_fuzz.parse_once()
    yield
    patch.stopall()


def test_a_damaged_bag_gives_what_is_right_or_says_so(quick):
    outcomes = [bag_fuzz.judge(seed=11, number=number) for number in range(200)]
    wrong = [outcome for outcome in outcomes if outcome.verdict not in bag_fuzz.RIGHT]
    assert wrong == []
    counts = Counter(outcome.verdict for outcome in outcomes)
    # Among so many there is each: damage outside of the messages, in them, and all over
    assert min(counts[v] for v in (bag_fuzz.SAME_TOLD, bag_fuzz.LESS_TOLD, bag_fuzz.REFUSED)) > 10


def test_a_reader_that_keeps_quiet_is_found_out(quick, monkeypatch):
    monkeypatch.setattr("towtank_bag.reader.Bag.problem", None)
    monkeypatch.setattr("towtank_bag.reader.Bag.notes", [])
    verdicts = [bag_fuzz.judge(seed=11, number=number).verdict for number in range(30)]
    assert bag_fuzz.SILENT in verdicts


def test_a_reader_that_trips_is_found_out(quick, monkeypatch):
    monkeypatch.setattr(compare, "open_bag", lambda path: 1 / 0)
    assert bag_fuzz.judge(seed=11, number=0).verdict == bag_fuzz.CRASHED
