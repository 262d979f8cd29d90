# SPDX-License-Identifier: Apache-2.0
"""One whole trial with every real part in it: firmware ELF, serial line, ROS 2 graph, MCAP."""

from __future__ import annotations

import json
import math

import pytest
from rosbags.highlevel import AnyReader
from towtank_command import run_towtank

pytestmark = pytest.mark.alone


def test_no_scan_is_lost_or_bad(ideal_trial):
    scans = ideal_trial.result["scans"]
    assert scans["lost"] == scans["bad"] == 0
    # 100 Hz for 15 s; the log's ends may cut one scan each.
    assert scans["scheduled"] == scans["received"] == pytest.approx(1500, abs=30)


def test_encoder_counts_are_exact(ideal_trial):
    encoder = ideal_trial.result["encoder"]
    assert encoder["crank_counted"] == encoder["crank_expected"]
    assert encoder["carriage_counted"] == encoder["carriage_expected"]
    # 15 s at half a revolution a second and 4096 counts a revolution
    assert encoder["crank_counted"] > 7 * 4096


def test_twin_repeats_the_plant(ideal_trial):
    """Same model, ideal sensors: what is left is acquisition, so 1 % and 2 degrees bound it."""
    result = ideal_trial.result
    for place in ("fish", "depressor"):
        amplitude = result["amplitude_m"][place]
        assert amplitude["measured"] == pytest.approx(amplitude["twin"], rel=0.01), place
    ratio = result["heave_ratio"]
    assert ratio["measured"]["value"] == pytest.approx(ratio["twin"]["value"], rel=0.02)
    difference = ratio["measured"]["phase_deg"] - ratio["twin"]["phase_deg"]
    assert abs(math.remainder(difference, 360.0)) < 2.0


def test_result_is_complete(ideal_trial):
    result = ideal_trial.result
    assert result == json.loads((ideal_trial.directory / "result.json").read_text())
    assert result["rig"] == "nit_calicut_2012"
    assert result["duration_s"] == pytest.approx(15.0, abs=0.5)
    assert result["heave_ratio"]["measured"]["u95"] > 0
    assert result["amplitude_m"]["depressor"]["u95"] > 0
    assert result["latency_ms"]["median"] < result["latency_ms"]["p999"]
    assert result["cpu_cores"] > 0
    assert set(result["overruns"]) >= {
        "/plant/simulator",
        "/plant/bench",
        "/measured/adc_board",
        "/measured/fish/pressure_sensor",
        "/measured/depressor/pressure_sensor",
        "/measured/fish/inclinometer",
        "/measured/encoder",
        "/twin/simulator",
        "/comparison",
        "/recorder",
    }


def test_the_error_that_the_twins_segments_leave_is_stated(ideal_trial):
    found = ideal_trial.result["twin_discretisation"]
    ratio = ideal_trial.result["heave_ratio"]["twin"]["value"]
    assert (found["segments"], found["coarse_segments"]) == (40, 20)
    # `towtank bench segments` has 1 % with 40 segments; the estimate rests on 20 and has twice that
    assert 0.002 < abs(found["ratio_error"]) / ratio < 0.04
    assert "The twin has 40 segments." in (ideal_trial.directory / "report.html").read_text()


def test_directory_holds_what_a_trial_leaves(ideal_trial):
    names = {path.name for path in ideal_trial.directory.iterdir()}
    assert names == {"bag", "logs", "report.html", "result.json"}


def test_bag_explains_itself(ideal_trial):
    with AnyReader([ideal_trial.bag]) as reader:
        topics = {connection.topic: connection for connection in reader.connections}
        (_, _, raw), *_ = reader.messages([topics["/rig"]])
        rig_text = reader.deserialize(raw, topics["/rig"].msgtype).data
    assert "name: nit_calicut_2012" in rig_text
    assert {"/measured/adc_scan", "/measured/fish/depth", "/twin/fish/odometry"} <= set(topics)
    assert {"/trial/events", "/diagnostics", "/measured/heave_ratio"} <= set(topics)


def test_compare_gives_the_trials_ratio_again(ideal_trial):
    run = run_towtank("compare", ideal_trial.bag, "--json")
    assert run.returncode == 0, run.stderr
    again = json.loads(run.stdout)["heave_ratio"]
    first = ideal_trial.result["heave_ratio"]
    assert again["measured"]["value"] == pytest.approx(first["measured"]["value"], rel=1e-9)
    assert again["twin"]["value"] == pytest.approx(first["twin"]["value"], rel=1e-9)


def test_live_and_offline_ratios_are_the_same_number(ideal_trial):
    live = ideal_trial.result["live"]
    run = run_towtank("compare", ideal_trial.bag, "--window", *live["window"], "--json")
    assert run.returncode == 0, run.stderr
    offline = json.loads(run.stdout)["heave_ratio"]
    assert offline["measured"]["value"] == pytest.approx(live["measured"], rel=1e-9)
    assert offline["twin"]["value"] == pytest.approx(live["twin"], rel=1e-9)
