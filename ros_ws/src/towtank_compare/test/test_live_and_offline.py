# SPDX-License-Identifier: Apache-2.0
"""The comparison while a trial runs gives the numbers that its bag gives afterwards."""

import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from synthetic_trial import DURATION_S, RIG_FILE, START_NS, trial_samples, write_trial
from towtank_compare import comparison
from towtank_compare.compare import compare_bag
from towtank_compare.live import SETTLING_MS, LiveHeave
from towtank_compare.trial_result import trial_result
from towtank_interfaces.msg import HeaveRatio
from towtank_node import topics
from towtank_node.endpoints import publisher, subscription
from towtank_rig import load_rig

START_MS = START_NS // 1_000_000
SAMPLES = trial_samples()


def feed(live: LiveHeave, sample) -> None:
    message, stamp = sample.message, sample.stamp_ns
    _, source, body = [*sample.topic.split("/"), ""][:3]
    if sample.topic == topics.MEASURED_JOINTS.name:
        live.add_crank(stamp, message.position[0])
    elif sample.topic.endswith(topics.DEPTH.name):
        live.add_depth(body, stamp, message.depth, message.valid, message.zero_depth)
    elif sample.topic.endswith(topics.ODOMETRY.name) and source == "twin":
        pose = message.pose.pose
        turn = pose.orientation
        live.add_pose(body, stamp, pose.position.z, (turn.x, turn.y, turn.z, turn.w))


def test_live_and_offline_give_the_same_numbers(trial_bag):
    """Bit for bit in one process: the same samples go through the same function."""
    live = LiveHeave(load_rig(RIG_FILE), window_s=5.0)
    compared = 0
    for number, sample in enumerate(SAMPLES):
        feed(live, sample)
        if number % 4000 != 3999:
            continue
        evaluations = live.evaluate()
        if not evaluations:
            assert sample.stamp_ns < START_NS + 5.1e9
            continue
        measured, twin = evaluations
        assert measured.t1_ms - measured.t0_ms == 5000
        assert 0 <= sample.stamp_ns / 1e6 - measured.t1_ms <= SETTLING_MS + 11
        offline = compare_bag(trial_bag, (measured.t0_ms / 1000, measured.t1_ms / 1000))
        assert offline["measured"] == measured.result.ratio
        assert offline["twin"] == twin.result.ratio
        assert offline["heave_ratio"]["measured"]["u95"] == measured.result.u95
        assert offline["heave_ratio"]["twin"]["phase_deg"] == twin.result.phase_deg
        compared += 1
    assert compared >= 3


def test_a_window_in_which_the_crank_was_lost_gives_its_reason():
    live = LiveHeave(load_rig(RIG_FILE), window_s=5.0)
    for sample in trial_samples(reset_s=8.0, zeroed_s=8.01):
        if sample.stamp_ns < START_NS + 10_000_000_000:
            feed(live, sample)
    evaluations = live.evaluate()
    assert [evaluation.source for evaluation in evaluations] == ["measured", "twin"]
    for evaluation in evaluations:
        assert evaluation.result is None
        assert evaluation.reason.startswith("the crank's angle is not known at 3.0")


def test_nothing_is_evaluated_before_the_window_is_full():
    live = LiveHeave(load_rig(RIG_FILE), window_s=5.0)
    assert live.evaluate() == []
    for sample in SAMPLES:
        if sample.stamp_ns < START_NS + 5_000_000_000:
            feed(live, sample)
    assert live.evaluate() == []


def test_the_window_waits_for_the_slowest_topic():
    """The twin lags by a second: the window ends where the twin's samples end."""
    live = LiveHeave(load_rig(RIG_FILE), window_s=5.0)
    for sample in SAMPLES:
        lag = 1_000_000_000 if sample.topic.startswith("/twin") else 0
        if sample.stamp_ns + lag < START_NS + 10_000_000_000:
            feed(live, sample)
    measured, twin = live.evaluate()
    assert measured.t1_ms == twin.t1_ms == START_MS + 8_990 - SETTLING_MS
    assert twin.result is not None


def test_a_topic_that_stopped_is_named_and_does_not_hold_up_the_rest():
    live = LiveHeave(load_rig(RIG_FILE), window_s=5.0)
    for sample in SAMPLES:
        if sample.topic != topics.TWIN_FISH.name or sample.stamp_ns < START_NS + 3_000_000_000:
            feed(live, sample)
    measured, twin = live.evaluate()
    assert measured.result is not None
    assert twin.result is None
    assert twin.reason == "no samples of twin's pose of the fish"


def test_what_cannot_be_evaluated_says_why():
    live = LiveHeave(load_rig(RIG_FILE), window_s=3.0)
    for sample in SAMPLES:
        feed(live, sample)
    for evaluation in live.evaluate():
        assert evaluation.result is None
        assert "1.50 crank periods in the window" in evaluation.reason


BATCH_NS = 100_000_000  # ten messages of each topic: what a poll of the node finds in a trial
TIMEOUT_S = 60.0


class CountingComparison(comparison.Comparison):
    """Counts how often it has emptied its queues."""

    polls = 0

    def _poll(self) -> None:
        super()._poll()
        self.polls += 1


def test_the_node_publishes_what_its_bag_gives_later(tmp_path, monkeypatch):
    """The whole way: messages through the middleware, the node, its results into a bag. As many
    messages to a poll as in a trial, however long the machine takes for them."""
    monkeypatch.setattr(comparison, "POLL_PERIOD_S", 0.005)
    monkeypatch.setattr(comparison, "POLLS_PER_EVALUATION", 20)  # each costs an analysis of the bag
    rclpy.init(args=["--ros-args", "-p", f"rig:={RIG_FILE}", "-p", "window_s:=5.0"])
    node, compared = rclpy.create_node("tester"), CountingComparison()
    try:
        ratios = run_trial_through(node, compared)
    finally:
        compared.destroy_node()
        node.destroy_node()
        rclpy.shutdown()
    valid = [ratio for ratio in ratios if ratio.valid]
    assert {ratio.source for ratio in valid} == {"measured", "twin"}
    assert all(ratio.fish_place == "pressure port" for ratio in valid)

    bag = write_trial(tmp_path / "bag", SAMPLES, valid)
    for ratio in valid:
        window = [time.sec + time.nanosec * 1e-9 for time in (ratio.window_start, ratio.window_end)]
        offline = compare_bag(bag, window)
        assert offline[ratio.source] == pytest.approx(ratio.value, rel=1e-9)
    live = trial_result(bag)["live"]
    offline = compare_bag(bag, live["window"])
    for source in ("measured", "twin"):
        assert offline[source] == pytest.approx(live[source], rel=1e-9)


def run_trial_through(node, compared) -> list[HeaveRatio]:
    """Publish the inputs of the comparison; returns what it publishes."""
    inputs = [
        sample
        for sample in SAMPLES
        if sample.topic.endswith((topics.DEPTH.name, topics.ODOMETRY.name))
        or sample.topic == topics.MEASURED_JOINTS.name
    ]
    known = {topic.name: topic for topic in topics.TRIAL}
    publishers = {
        name: publisher(node, known[name])
        for name in {sample.topic for sample in inputs}
        if not name.startswith("/plant")
    }
    ratios: list[HeaveRatio] = []
    for topic in (topics.MEASURED_RATIO, topics.TWIN_RATIO):
        subscription(node, topic, ratios.append)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.add_node(compared)

    def spin_until(condition):
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert time.monotonic() < deadline, "waited too long"
            executor.spin_once(timeout_sec=0.02)

    spin_until(
        lambda: (
            all(p.get_subscription_count() == 1 for p in publishers.values())
            and node.count_publishers(topics.TWIN_RATIO.name) == 1
        )
    )
    batch_end = START_NS + BATCH_NS
    for sample in inputs:
        if sample.stamp_ns >= batch_end:
            batch_end += BATCH_NS
            polls = compared.polls
            spin_until(lambda polls=polls: compared.polls > polls)
        if sample.topic in publishers:
            publishers[sample.topic].publish(sample.message)
    # The node's results wait in the subscription's queue of 100: 20 s at 4 results a second
    last_end_ns = START_NS + int(DURATION_S * 1e9) - 1_000_000_000
    spin_until(lambda: any(_end_ns(ratio) > last_end_ns for ratio in ratios))
    return ratios


def _end_ns(ratio: HeaveRatio) -> int:
    return ratio.window_end.sec * 1_000_000_000 + ratio.window_end.nanosec
