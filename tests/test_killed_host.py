# SPDX-License-Identifier: Apache-2.0
"""The process of acquisition is killed in the logged part of a whole trial."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import time

import numpy as np
import psutil
import pytest
from towtank_bag.reader import open_bag
from towtank_command import TOWTANK, processes_of, run_towtank
from towtank_node import names, topics

pytestmark = pytest.mark.alone

PERIOD_NS = 10_000_000
PERIOD_TICKS = 20_000
"""Of the scans, at 100 Hz."""


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    """The directory of a trial whose process of acquisition was killed 8 s into the log."""
    directory = tmp_path_factory.mktemp("trials") / "killed"
    process = subprocess.Popen(
        [
            *TOWTANK,
            "trial",
            "--duration",
            "30",
            "--beyond-tank",
            "--noise",
            "none",
            "--out",
            directory,
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for line in process.stderr:
        if line.startswith("logging"):
            break
    time.sleep(8.0)
    nodes = [
        child.pid
        for child in psutil.Process(process.pid).children()
        if any(part.endswith("/acquisition") for part in child.cmdline())
    ]
    assert len(nodes) == 1
    os.kill(nodes[0], signal.SIGKILL)
    table, words = process.communicate(timeout=180)
    assert process.returncode == 0, words
    assert f"{names.BOARD_NODE} had ended and was started again" in table
    assert processes_of(directory) == []
    assert not (directory / "INCOMPLETE").exists()
    return directory


@pytest.fixture(scope="module")
def result(trial):
    return json.loads((trial / "result.json").read_text())


@pytest.fixture(scope="module")
def scans(trial):
    fields = ["sequence", "board_ticks", "crank_count", "valid_mask"]
    return open_bag(trial / "bag").series(topics.SCANS.name, fields)


@pytest.fixture(scope="module")
def gap(scans):
    """Index of the first scan of the second run."""
    (begins,) = np.flatnonzero(np.diff(scans["sequence"].astype(np.int64)) < 0) + 1
    return int(begins)


@pytest.fixture(scope="module")
def begun_ns(scans, gap):
    """Stamp of the second run's first scan, number 0. The recorder hears of the new process's
    topics one after the other, so it may have begun later, and other topics earlier or later."""
    return scans["stamp_ns"][gap] - PERIOD_NS * int(scans["sequence"][gap])


def test_the_gap_is_marked(trial, result, scans, gap):
    assert result["restarts"] == {names.BOARD_NODE: 1}
    events = {
        message.event: (message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, message)
        for _, message in open_bag(trial / "bag").messages(topics.EVENTS.name)
    }
    stamp, message = events["restarted"]
    assert json.loads(message.detail) == {"node": names.BOARD_NODE}
    assert events["log_start"][0] < scans["stamp_ns"][gap - 1] < stamp < events["log_stop"][0]


def test_lost_scans_are_right_to_the_scan(trial, result, scans, gap):
    """By the virtual board's clock, which is the host's and went on all the time."""
    start, end = (round(1000 * t) * 1_000_000 for t in result["window"])
    inside = (scans["stamp_ns"] >= start) & (scans["stamp_ns"] <= end)
    periods = scans["board_ticks"].astype(np.int64) / PERIOD_TICKS
    first, last = np.flatnonzero(inside)[[0, -1]]
    # Two runs are two phases: over the gap the nearest whole number of periods counts
    over_the_gap = round(periods[gap] - periods[gap - 1])
    seconds = (scans["stamp_ns"][gap] - scans["stamp_ns"][gap - 1]) * 1e-9
    assert over_the_gap == pytest.approx(100 * seconds, abs=2)
    passed = (
        over_the_gap
        + round(periods[last] - periods[gap])
        + round(periods[gap - 1] - periods[first])
    )
    assert result["scans"]["scheduled"] == passed + 1
    assert result["scans"]["lost"] == passed + 1 - np.count_nonzero(inside)
    offline = json.loads(run_towtank("compare", trial / "bag", "--json").stdout)
    assert offline["scans"] == result["scans"]


def test_nothing_is_invented_in_the_gap(trial, scans, gap, begun_ns):
    """A sample is up to a scan's length (10 ms) later than its scan."""
    bag = open_bag(trial / "bag")
    start, end = scans["stamp_ns"][gap - 1], begun_ns
    assert end - start > 1e9
    for topic in (
        *(topics.SCANS.name, topics.MEASURED_JOINTS.name, topics.FISH_DEPTH.name),
        *(topics.DEPRESSOR_DEPTH.name, topics.FISH_PRESSURE.name, topics.INCLINATION.name),
        *(topics.TWIN_FISH.name, topics.TWIN_DEPRESSOR.name),
    ):
        stamps = bag.series(topic, [])["stamp_ns"]
        inside = (stamps > start + 10_000_000) & (stamps < end - 10_000_000)
        assert not np.count_nonzero(inside), topic


def test_shafts_turned_on_and_speeds_are_true(trial, result, begun_ns):
    """The board was not reset: its counts of the gap are those of the plant. A speed is not made
    of the way over the gap: there is none until the positions behind it span 0.1 s. (A turn has
    4096 counts, and the gap thousands; a busy computer may hold the virtual board up for some.)"""
    for joint in ("crank", "carriage"):
        expected = result["encoder"][f"{joint}_expected"]
        assert result["encoder"][f"{joint}_counted"] == pytest.approx(expected, abs=100)
    bag = open_bag(trial / "bag")
    joints = bag.series(topics.MEASURED_JOINTS.name, ["velocity"])
    speed = np.array([row[1] for row in joints["velocity"]])
    since_ns = joints["stamp_ns"] - begun_ns
    before = speed[since_ns < -1e9][-1]
    # Half a window of 0.2 s; scans come a little unevenly
    unknown = (since_ns >= 0) & (since_ns < 80_000_000)
    known = (since_ns > 120_000_000) & (since_ns < 1e9)
    assert np.isnan(speed[unknown]).all()
    assert speed[known][:5] == pytest.approx(before, rel=0.1)
    for body in names.BODIES:
        depths = bag.series(topics.DEPTHS[body].name, ["depth", "valid"])
        since_ns = depths["stamp_ns"] - begun_ns  # up to a scan's length before its scan
        unknown = (since_ns >= 0) & (since_ns < 70_000_000)
        assert not depths["valid"][unknown].any()
        assert np.isnan(depths["depth"][unknown]).all()
        assert depths["valid"][(since_ns > 120_000_000) & (since_ns < 1e9)].all()


def test_zeros_outlive_the_process(trial):
    """Positions go on from the same origins, depths from the same places of zeroing."""
    bag = open_bag(trial / "bag")
    joints = bag.series(topics.MEASURED_JOINTS.name, ["position"])
    plant = bag.series(topics.PLANT_JOINTS.name, ["position"])
    for index, per_second in ((0, math.pi), (1, 1.5)):  # at most, rad/s and m/s
        measured = np.array([row[index] for row in joints["position"]])
        true = np.interp(
            joints["stamp_ns"], plant["stamp_ns"], [row[index] for row in plant["position"]]
        )
        inside = joints["stamp_ns"] < plant["stamp_ns"][-1]
        error = (measured - true)[inside]
        # Of an encoder's step, and of the way in the time by which the board's clock may err
        assert np.abs(error - np.median(error)).max() < per_second * 0.02 + 0.002
    for body in names.BODIES:
        depths = bag.series(topics.DEPTHS[body].name, ["zeroed", "zero_depth"])
        zeroed = depths["zero_depth"][np.flatnonzero(depths["zeroed"])[0] :]
        assert np.unique(zeroed).size == 1


def test_heave_ratio_is_given(trial, result, begun_ns):
    measured = result["heave_ratio"]["measured"]
    plant = result["heave_ratio"]["plant"]
    assert measured["value"] == pytest.approx(plant["value"], abs=measured["u95"])
    depressor = result["amplitude_m"]["depressor"]
    assert depressor["measured"] == pytest.approx(depressor["plant"], rel=0.01)
    bag = open_bag(trial / "bag")
    for body in names.BODIES:  # a depth wants a speed, 0.1 s behind the gap
        depths = bag.series(topics.DEPTHS[body].name, ["valid"])
        stamps = depths["stamp_ns"][depths["valid"]]
        after = np.searchsorted(stamps, begun_ns)
        assert stamps[after] - begun_ns > 70_000_000
        gap_s = result["analysis"]["measured"][body]["largest_gap_s"]
        assert gap_s == pytest.approx((stamps[after] - stamps[after - 1]) * 1e-9, abs=0.05)
