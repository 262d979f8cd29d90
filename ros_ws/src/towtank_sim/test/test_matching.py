# SPDX-License-Identifier: Apache-2.0
"""Matching of messages by their stamps."""

from hypothesis import given
from hypothesis import strategies as st
from towtank_sim.matching import StampMatcher


def test_complete_sets_come_out_in_topic_order():
    matcher = StampMatcher(topics=3)
    assert matcher.add(2, 10, "c") is None
    assert matcher.add(0, 10, "a") is None
    assert matcher.add(1, 10, "b") == ["a", "b", "c"]
    assert matcher.lost == 0


def test_a_lost_message_costs_its_instant_only():
    matcher = StampMatcher(topics=2)
    matcher.add(0, 10, "a10")
    matcher.add(0, 20, "a20")
    assert matcher.add(1, 20, "b20") == ["a20", "b20"]
    assert matcher.lost == 1


def test_a_silent_topic_does_not_fill_the_memory():
    matcher = StampMatcher(topics=2)
    for stamp in range(1000):
        assert matcher.add(0, stamp, "a") is None
    assert matcher.lost == 950


@given(st.lists(st.integers(0, 2), min_size=30, max_size=200))
def test_any_interleaving_of_lossless_topics_gives_every_instant_once(order):
    """Each topic delivers its own stamps in order; between topics anything goes."""
    matcher = StampMatcher(topics=3)
    following = [0, 0, 0]
    results = []
    for topic in order:
        if following[topic] - min(following) >= 40:
            continue  # further ahead than the topics' queues let it get
        result = matcher.add(topic, following[topic], (topic, following[topic]))
        following[topic] += 1
        if result is not None:
            results.append(result)
    assert results == [[(t, stamp) for t in range(3)] for stamp in range(min(following))]
    assert matcher.lost == 0
