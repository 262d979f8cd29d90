# SPDX-License-Identifier: Apache-2.0
"""The result of a synthetic trial whose motions, losses and delays are known."""

import json
import math
from dataclasses import replace

import pytest
import synthetic_trial
from rclpy.serialization import serialize_message
from synthetic_trial import (
    CRANK_HZ,
    LATENCY_NS,
    LOG,
    MEASURED,
    RIG_FILE,
    SIMULATED,
    START_NS,
    Sample,
    head,
    to_time,
    trial_samples,
    write_trial,
)
from towtank_bag import writer
from towtank_bag.definitions import message_definition
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_compare.compare import CompareError, compare_bag
from towtank_compare.samples import bag_samples, zero_depth
from towtank_compare.trial_result import trial_result
from towtank_interfaces.msg import AdcScan, HeaveRatio, TrialEvent
from towtank_node import names, topics
from towtank_rig import load_rig


@pytest.fixture(scope="module")
def result(trial_bag):
    return trial_result(trial_bag)


def test_the_keys_are_those_that_readers_rely_on(result):
    assert result["rig"] == "nit_calicut_2012"
    assert result["duration_s"] == LOG[1] - LOG[0]
    assert set(result["scans"]) == {"scheduled", "received", "lost", "bad"}
    assert {"value", "u95", "phase_deg"} <= set(result["heave_ratio"]["measured"])
    assert {"value", "phase_deg"} <= set(result["heave_ratio"]["twin"])
    for body in ("fish", "depressor"):
        assert {"measured", "u95", "twin"} <= set(result["amplitude_m"][body])
    assert set(result["encoder"]) == {
        "crank_expected",
        "crank_counted",
        "carriage_expected",
        "carriage_counted",
        "reference_lost_s",
    }
    assert result["encoder"]["reference_lost_s"] == []
    assert {"median", "p999"} <= set(result["latency_ms"])
    assert result["overruns"] == {names.TWIN_NODE: 1}
    assert result["cpu_cores"] == 0.9
    assert result["live"] is None
    json.dumps(result, allow_nan=False)


def test_heave_is_that_of_the_motion(result):
    """The depressor's noise of 0.2 mm over 1600 samples leaves 7 µm (k = 1); four of that."""
    for body, (amplitude, _) in MEASURED.items():
        assert result["amplitude_m"][body]["measured"] == pytest.approx(amplitude, abs=3e-5)
    ratio = result["heave_ratio"]["measured"]
    lag = math.degrees(MEASURED["fish"][1] - MEASURED["depressor"][1])
    assert ratio["value"] == pytest.approx(0.012 / 0.055, abs=4e-4)
    assert ratio["phase_deg"] == pytest.approx(lag, abs=0.2)
    assert 0 < ratio["u95"] < 0.05 * ratio["value"]


def test_the_twins_heave_is_taken_at_the_pressure_port(result):
    """Heave of a place x forward of mid-hull is z − x·sin(pitch): two phasors. sin differs from its
    argument by a sixth of its square: 0.02²/6 = 7e-5 of 4 mm."""
    x = load_rig(RIG_FILE).sensors.fish_pressure.position.x.value
    half_length = load_rig(RIG_FILE).fish.length.value / 2
    amplitude, phase = SIMULATED["fish"]

    def at(place):
        real = amplitude * math.cos(phase) - place * 0.02 * math.cos(1.0)
        imaginary = amplitude * math.sin(phase) - place * 0.02 * math.sin(1.0)
        return math.hypot(real, imaginary)

    assert result["amplitude_m"]["fish"]["twin"] == pytest.approx(at(x), rel=1e-4)
    assert result["amplitude_m"]["fish"]["plant"] == result["amplitude_m"]["fish"]["twin"]
    along = result["fish_place"]["twin_amplitude_m"]
    assert along["mid-hull"] == pytest.approx(at(0), rel=1e-4)
    assert along["nose"] == pytest.approx(at(half_length), rel=1e-4)
    assert result["fish_place"]["position_m"][0] == x


def test_samples_know_where_the_sensors_were_zeroed(trial_bag):
    """What acts on the way from there needs it; without it, it counts from the surface."""
    bag = open_bag(trial_bag)
    assert bag_samples(bag, load_rig(RIG_FILE), "measured").zero_depths == (0.3, 0.2)
    assert zero_depth(bag, topics.MEASURED_JOINTS.name) == 0.0


SCANS = {"scheduled": 1601, "received": 1599, "lost": 2, "bad": 1}
"""From 2.00 s to 18.00 s there are 1601 ticks, two of them lost and one scan bad."""


def test_lost_and_bad_scans_are_counted(result):
    assert result["scans"] == SCANS


@pytest.mark.parametrize("configured_mask", [0b10_0110, 0b1111_1111_1111])
def test_a_scan_is_bad_that_lacks_a_channel_which_is_configured(tmp_path, configured_mask):
    """Boards that scan three of their channels, and twelve: as good as one that scans its six."""
    bag = write_trial(tmp_path / "bag", trial_samples(configured_mask=configured_mask))
    assert trial_result(bag)["scans"] == SCANS


def trial_without(tmp_path, begin_s: float, end_s: float):
    """The synthetic trial, whose board or recorder brought no scans in a part of it."""
    samples = [
        sample
        for sample in trial_samples()
        if sample.topic != topics.SCANS.name
        or not begin_s <= (sample.stamp_ns - START_NS) * 1e-9 < end_s
    ]
    return write_trial(tmp_path / "bag", samples)


@pytest.mark.parametrize(
    ("begin_s", "end_s", "received", "lost"),
    [
        (15.005, 30.0, 1301 - 2, 300 + 2),  # none to the end of the bag: of the log 3 s
        (15.005, 18.505, 1301 - 2, 300 + 2),  # others come behind the log
        (0.0, 2.505, 1550 - 2, 51 + 2),  # the first 0.5 s of the log, and before
        (1.0, 2.505, 1550 - 2, 51 + 2),
        (1.0, 19.0, 0, 1600),  # the whole log; not even its ends are known
        (0.0, 30.0, 0, 0),  # no scan in the bag, and so nothing tells how many were due
    ],
)
def test_scans_missing_at_the_ends_are_counted(tmp_path, begin_s, end_s, received, lost):
    """Of the 1601 of the log. Two are lost anyway (700, 701), but where all are."""
    scans = compare_bag(trial_without(tmp_path, begin_s, end_s))["scans"]
    assert (scans["received"], scans["lost"]) == (received, lost)


def test_no_scans_are_due_outside_the_trial(tmp_path):
    """A window that reaches beyond the trial's marks has no lost scans there."""
    bag = trial_without(tmp_path, 19.0, 30.0)
    window = (START_NS * 1e-9 + 10.0, START_NS * 1e-9 + 50.0)
    assert compare_bag(bag, window)["scans"]["lost"] == 0


@pytest.mark.parametrize("board_was_reset", [False, True])
def test_scans_lost_while_the_boards_node_was_down_are_counted(tmp_path, board_was_reset):
    """The last scan before is number 499, the first one after would be number 1205 by the host's
    time, but the board's clock runs fast: 4.45 periods more fit between. They have no witness where
    the board was reset."""
    samples = []
    for sample in trial_samples():
        if sample.topic == topics.SCANS.name:
            scan = sample.message
            if 500 <= scan.sequence < 1205:
                continue
            scan.board_ticks = 7_000_000_000 + 20_000 * scan.sequence
            if scan.sequence >= 1205:
                scan.board_ticks += 4 * 20_000 + 9_000
                if board_was_reset:
                    scan.board_ticks -= 7_020_000_000
                scan.sequence -= 1205
        samples.append(sample)
    stamp = START_NS + int(12.0e9)
    event = TrialEvent(header=head(stamp, ""), event="restarted", detail='{"node": "/a"}')
    samples.append(Sample(topics.EVENTS.name, stamp, event))
    stranger = {"node": "/gamepad", "topic": topics.DIAGNOSTICS.name}
    event = TrialEvent(header=head(stamp, ""), event="stranger", detail=json.dumps(stranger))
    samples.append(Sample(topics.EVENTS.name, stamp, event))
    bag = write_trial(tmp_path / "bag", sorted(samples, key=lambda sample: sample.stamp_ns))
    lost = 705 if board_was_reset else 709
    result = trial_result(bag)
    assert result["scans"]["lost"] == lost
    assert result["scans"]["scheduled"] == result["scans"]["received"] + lost
    assert result["restarts"] == {"/a": 1}
    assert result["strangers"] == [stranger]
    compared = compare_bag(bag)
    assert compared["scans"] == result["scans"]
    assert compared["restarts"] == result["restarts"]


def test_health_of_the_sensors_is_counted(result):
    """The fish's sensor is noisy for a second, and open for a tenth of it; samples of the log are
    those from 2 s to 18 s, two of them lost, stamped up to 2 ms after the tick."""
    health = result["sensor_health"]
    fish = health["fish_pressure"]
    assert (fish["noise"], fish["open"], fish["short"]) == (100, 10, 0)
    assert fish["samples"] == 1598
    flags = ("open", "short", "saturated", "stuck", "excitation", "noise")
    for sensor in ("depressor_pressure", "accelerometer"):
        assert [health[sensor][flag] for flag in flags] == [0] * 6


def test_encoder_counts_are_those_of_the_plant(result):
    """First scan at 0 s, last at 19.99 s: 4096 counts a turn at half a turn a second, 4096 counts
    in half a metre at 1 m/s."""
    crank, carriage = math.floor(4096 * 0.5 * 19.99), math.floor(4096 * 2 * 19.99)
    assert result["encoder"]["crank_counted"] == crank
    assert result["encoder"]["carriage_counted"] == carriage
    assert result["encoder"]["crank_expected"] == crank
    assert result["encoder"]["carriage_expected"] == carriage


def test_latency_is_from_the_sampling_instant(result):
    assert result["latency_ms"]["median"] == pytest.approx(LATENCY_NS * 1e-6)
    assert result["latency_ms"]["p999"] == pytest.approx(LATENCY_NS * 1e-6)


def test_calibrations_in_force_are_named(result):
    rows = {row["sensor"]: row for row in result["calibrations"]}
    assert rows["fish_pressure"]["id"] == "fish-pressure-assumed"
    assert rows["fish_pressure"]["file"] is None  # the rig's figures are assumed
    assert rows["crank"]["id"] is None


def test_assumptions_name_range_and_source(result):
    assert any(row["quantity"] == "fish.axial_drag" for row in result["assumptions"])
    assert all(row["source"] and len(row["range"]) == 2 for row in result["assumptions"])


def live_ratio(source: str, end_s: float, value: float, valid: bool = True) -> HeaveRatio:
    end = START_NS + int(end_s * 1e9)
    return HeaveRatio(
        header=head(end, "tank"),
        source=source,
        window_start=to_time(end - 5_000_000_000),
        window_end=to_time(end),
        valid=valid,
        value=value,
    )


def test_live_holds_the_last_window_inside_the_log_that_both_sources_have(tmp_path):
    ratios = [
        live_ratio("measured", 16.0, 0.20),
        live_ratio("twin", 16.0, 0.21),
        live_ratio("measured", 17.003, 0.22),
        live_ratio("twin", 17.003, 0.23),
        live_ratio("measured", 17.5, 0.24),
        live_ratio("twin", 17.5, 0.25, valid=False),
        live_ratio("measured", 18.5, 0.26),  # ends after the log
        live_ratio("twin", 18.5, 0.27),
    ]
    bag = write_trial(tmp_path / "bag", trial_samples(), ratios)
    live = trial_result(bag)["live"]
    assert (live["measured"], live["twin"]) == (0.22, 0.23)
    assert [round(1000 * t) for t in live["window"]] == [
        START_NS // 1_000_000 + 12_003,
        START_NS // 1_000_000 + 17_003,
    ]


def test_the_whole_log_is_compared_by_default(trial_bag, result):
    compared = compare_bag(trial_bag)
    assert compared["heave_ratio"] == result["heave_ratio"]
    assert compared["measured"] == result["heave_ratio"]["measured"]["value"]
    assert [round(1000 * t) for t in compared["window"]] == [
        START_NS // 1_000_000 + 2_000,
        START_NS // 1_000_000 + 18_000,
    ]


def test_a_bag_without_a_log_asks_for_a_window(tmp_path):
    samples = [s for s in trial_samples() if s.topic != topics.EVENTS.name]
    bag = write_trial(tmp_path / "bag", samples)
    with pytest.raises(BagError, match=r"no log_start .* give a window"):
        compare_bag(bag)
    start = START_NS / 1e9
    assert compare_bag(bag, (start + 2, start + 18))["measured"] == pytest.approx(0.218, rel=0.01)


def test_a_trial_that_broke_off_is_compared_as_far_as_it_goes(tmp_path):
    samples = [s for s in trial_samples() if s.stamp_ns < START_NS + 12_000_000_000]
    result = trial_result(write_trial(tmp_path / "bag", samples))
    assert result["duration_s"] == pytest.approx(9.99)
    assert result["analysis"]["measured"]["crank_periods"] == 5
    assert result["cpu_cores"] is None


def test_a_real_tank_has_no_plant(tmp_path):
    samples = [s for s in trial_samples() if not s.topic.startswith("/plant")]
    result = trial_result(write_trial(tmp_path / "bag", samples))
    assert "plant" not in result["heave_ratio"]
    assert result["encoder"]["crank_expected"] is None
    assert result["encoder"]["crank_counted"] == math.floor(4096 * CRANK_HZ * 19.99)


RESET = {"reset_s": 9.0, "zeroed_s": 10.0}


def test_nothing_is_made_of_a_crank_whose_angle_was_lost(tmp_path):
    """The board is reset 9 s after the start, and crank and carriage are zeroed 1 s later."""
    bag = write_trial(tmp_path / "bag", trial_samples(**RESET))
    result = trial_result(bag)
    start = START_NS / 1e9
    encoder = result["encoder"]
    assert encoder.pop("reference_lost_s") == [pytest.approx(start + 9.0, abs=1e-6)]
    assert set(encoder.values()) == {None}
    for source in ("measured", "twin", "plant"):
        assert result["heave_ratio"][source]["value"] is None
        assert result["reasons"][source] == (
            "the crank's angle is not known at 7.00 s of the window, for the board was reset: "
            "choose a window before it, or after the crank was zeroed again"
        )
    json.dumps(result, allow_nan=False)
    for window in ((2, 8.99), (10, 18)):
        compared = compare_bag(bag, [start + t for t in window])
        assert compared["measured"] == pytest.approx(0.218, rel=0.01)
    for window in ((4, 9), (9.5, 18)):
        with pytest.raises(CompareError, match="angle is not known"):
            compare_bag(bag, [start + t for t in window])


def test_a_bag_from_before_the_epochs_is_read(tmp_path, monkeypatch):
    definition = message_definition(topics.SCANS.type_name)
    older = replace(definition, text=definition.text.replace("uint32 count_epoch\n", ""))
    assert older != definition
    monkeypatch.setattr(
        writer,
        "message_definition",
        lambda name: older if name == older.name else message_definition(name),
    )
    monkeypatch.setattr(
        synthetic_trial,
        "serialize_message",
        lambda m: serialize_message(m)[: -4 if isinstance(m, AdcScan) else None],
    )
    bag = write_trial(tmp_path / "bag", trial_samples())
    assert not open_bag(bag).has_field(topics.SCANS.name, "count_epoch")
    encoder = trial_result(bag)["encoder"]
    assert encoder["reference_lost_s"] == []
    assert encoder["crank_counted"] == math.floor(4096 * CRANK_HZ * 19.99)


def test_a_missing_twin_is_null_with_the_reason(tmp_path):
    samples = [s for s in trial_samples() if not s.topic.startswith("/twin")]
    result = trial_result(write_trial(tmp_path / "bag", samples))
    assert result["heave_ratio"]["twin"]["value"] is None
    assert result["reasons"]["twin"] == "not in the bag"
    assert result["heave_ratio"]["measured"]["value"] is not None


@pytest.mark.parametrize(
    ("window", "message"),
    [((1.0, 2.5), "crank periods in the window"), ((5.0, 4.0), "must end after it begins")],
)
def test_a_window_that_gives_nothing_is_refused_in_one_line(trial_bag, window, message):
    start = START_NS / 1e9
    with pytest.raises(CompareError, match=message) as caught:
        compare_bag(trial_bag, [start + t for t in window])
    assert "\n" not in str(caught.value)
