# SPDX-License-Identifier: Apache-2.0
"""The check list against the host's conversions and the sensors of the virtual bench."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_bringup.rigs import rig_path
from towtank_daq.description import installed_description, load_description
from towtank_lab.accelerometer_calibration import SIX_POSITIONS
from towtank_lab.virtual_sensors import VirtualSensors
from towtank_rig import load_rig
from towtank_rig.conversion import accelerometer_conversion, depth_conversion, pitch, roll
from towtank_rig.loading import replaced
from towtank_uncertainty.sensor_errors import draw, error_terms, none, realise
from towtank_workshop.checklist import (
    Item,
    accelerometer_item,
    as_recorded,
    check_list,
    markdown,
    pressure_item,
)

COMMITTED = Path(__file__).parents[4] / "hardware" / "rig" / "checklist.md"
BOARD = load_description(installed_description())
RIGS = {name: load_rig(rig_path(name)) for name in ("nit_calicut_2012", "wu_chwang_2001")}
NIT = RIGS["nit_calicut_2012"]
SENSORS = ("fish_pressure", "depressor_pressure")
depths = st.floats(0.0, 5.0)


@pytest.fixture(params=RIGS)
def rig(request):
    return RIGS[request.param]


@given(st.sampled_from(SENSORS), depths)
def test_a_depth_comes_back_from_its_code(sensor, depth):
    """To half a code, which is 0.19 µm of water here; volts are those before rounding."""
    code, volts, meaning = pressure_item(NIT, BOARD, sensor, depth).readings
    channel = BOARD.adc_channel(sensor, NIT.board.excitation.value)
    conversion = depth_conversion(NIT, sensor, channel)
    read = conversion.depth(conversion.pressure(code.expected), 0.0)
    assert float(read) == pytest.approx(depth, abs=1e-6)
    assert meaning.expected == pytest.approx(depth, abs=1e-12)
    assert float(channel.volts(code.expected)) == pytest.approx(volts.expected, abs=1e-8)


@given(st.sampled_from(SENSORS), depths, st.floats(1e-3, 1.0))
def test_readings_and_limits_rise_with_depth(sensor, depth, deeper):
    upper = pressure_item(NIT, BOARD, sensor, depth)
    lower = pressure_item(NIT, BOARD, sensor, depth + deeper)
    for one, other in zip(upper.readings, lower.readings, strict=True):
        assert one.minimum <= one.expected <= one.maximum
        assert one.expected < other.expected
        assert one.maximum < other.maximum


@pytest.mark.parametrize("position", SIX_POSITIONS)
def test_an_attitude_comes_back_from_its_volts(rig, position):
    """As a direction: at a pitch of ±90° roll means nothing."""
    angles = [math.radians(angle) for angle in SIX_POSITIONS[position]]
    items = [accelerometer_item(rig, BOARD, axis, *angles) for axis in "xyz"]
    force = accelerometer_conversion(rig).specific_force(
        [item.readings[1].expected for item in items]
    )
    assert np.linalg.norm(force) == pytest.approx(rig.water.gravity.value)
    assert float(pitch(force)) == pytest.approx(angles[1], abs=1e-9)
    if abs(angles[1]) < 1.0:
        turned = float(roll(force)) - angles[0]
        assert math.cos(turned) == pytest.approx(1.0, abs=1e-12)


def volts_at(rig, errors, step) -> dict[str, float]:
    names = tuple(BOARD.channel_names)
    sensors = VirtualSensors(rig, errors, names)
    sensors.move(step)
    return dict(zip(names, sensors.terminal_volts(), strict=True))


def places(rig) -> list[tuple[dict[str, float], list[Item]]]:
    """Where the list has the sensors, and what it says of them there."""
    found = [
        ({"depth_m": depth}, [pressure_item(rig, BOARD, sensor, depth) for sensor in SENSORS])
        for depth in (0.0, 0.7, 2.0)
    ]
    for turned in SIX_POSITIONS.values():
        angles = [math.radians(angle) for angle in turned]
        items = [accelerometer_item(rig, BOARD, axis, *angles) for axis in "xyz"]
        found.append((dict(zip(("roll_deg", "pitch_deg"), turned, strict=True)), items))
    return found


def test_ideal_sensors_of_the_bench_read_what_is_expected(rig):
    for step, items in places(rig):
        volts = volts_at(rig, none(rig), step)
        for item in items:
            assert item.readings[1].expected == pytest.approx(volts[item.what], abs=1e-12)


def test_no_sound_sensor_of_the_bench_lies_outside(rig):
    """Rectangular errors only, so never; the board is ratiometric, which takes the excitation's
    error out of the codes that the limits are about."""
    by_data_sheet = as_recorded(rig)
    for seed in range(60):
        errors = draw(by_data_sheet, seed)
        share = by_data_sheet.board.excitation.value / errors.excitation
        for step, items in places(by_data_sheet):
            volts = volts_at(by_data_sheet, errors, step)
            for item in items:
                limits = item.readings[1]
                read = volts[item.what] * (share if "pressure" in item.what else 1.0)
                assert limits.minimum <= read <= limits.maximum, (seed, step, item.what)


def test_limits_are_no_wider_than_the_errors():
    """All errors at their limits together: the reading is at its limit, to the products of errors
    that the limit rounds up (gain times linearity, below 1 % of the slack)."""
    rig = as_recorded(NIT)
    worst = {
        key: math.prod(f.value for f in term.factors) for key, term in error_terms(rig).items()
    }
    errors = realise(rig, worst, excitation=10.0, noise_scale=0.0)
    read = float(errors.fish_pressure.volts(2.0 * 996.5 * 9.782, drift=1.0))
    limits = pressure_item(rig, BOARD, "fish_pressure", 2.0).readings[1]
    slack = limits.maximum - limits.expected
    assert 0.99 * slack <= read - limits.expected <= slack


def test_only_recorded_calibrations_count():
    assert NIT.calibrations.accelerometer is not None
    assert as_recorded(NIT).calibrations.accelerometer is None
    recorded = replaced(NIT, {"calibrations.fish_pressure.file": "calibrations/fish.yaml"})
    kept = as_recorded(recorded).calibrations
    assert kept.fish_pressure is not None and kept.depressor_pressure is None


def items_of(steps, title) -> tuple[Item, ...]:
    (step,) = [step for step in steps if step.title == title]
    return step.items


def test_the_depths_are_the_ones_asked_for():
    steps = check_list(NIT, BOARD, depths=(0.25, 1.5))
    names = [item.what.split(":")[0] for item in items_of(steps, "Immersed")]
    assert names == ["0.25 m", "0.25 m", "1.5 m", "1.5 m"]
    by_itself = [item.what.split(":")[0] for item in items_of(check_list(NIT, BOARD), "Immersed")]
    assert by_itself[::2] == ["0.4 m", "0.8 m", "1.2 m", "1.6 m", "2 m"]  # of 2.2 m


def test_encoders_count_as_the_rig_says():
    """By hand: 4096 a turn; a wheel of 0.5 m turns twice a metre; crank 0.06 m about 0.2 m."""
    items = {
        item.what: item.readings[0]
        for item in items_of(check_list(NIT, BOARD), "Encoders and crank")
    }
    expected = [reading.expected for reading in items.values()]
    assert expected == pytest.approx([4096.0, 8192.0, 0.2, 0.26, 0.2, 0.14])
    reversed_rig = replaced(NIT, {"sensors.crank_encoder.direction": -1})
    first = items_of(check_list(reversed_rig, BOARD), "Encoders and crank")[0].readings[0]
    assert (first.minimum, first.maximum) == pytest.approx((-4300.8, -3891.2))


def test_the_drives_times_by_hand():
    """30 rpm at 10 rpm/s: 3 s; ten turns 20 s, to the resonator's 0.5 % and a stopwatch's 0.5 s. A
    stop may be shorter, and is at most the ramp and one second, after one of silence. A rate that
    the drive cannot turn is taken at the nearest that it can: 5 rpm."""
    ramp, turns, stop, silent = (
        item.readings[0] for item in items_of(check_list(NIT, BOARD), "Crank drive")
    )
    assert ramp.expected == pytest.approx(3.0)
    assert (stop.expected, stop.minimum, stop.maximum) == (None, 0.0, pytest.approx(4.0))
    assert (turns.minimum, turns.maximum) == pytest.approx((19.4, 20.6))
    assert (silent.expected, silent.minimum, silent.maximum) == (None, 0.0, pytest.approx(5.0))
    slow = replaced(NIT, {"run.crank_rate": 0.1})
    names = [item.what for item in items_of(check_list(slow, BOARD), "Crank drive")]
    assert names[0] == "from rest to 5 rpm"


def test_the_list_is_the_committed_one():
    # Print it anew with: ./towtank checklist nit_calicut_2012 > hardware/rig/checklist.md
    assert markdown(NIT, check_list(NIT, BOARD)) == COMMITTED.read_text("utf-8")


def test_every_row_has_its_columns():
    """As many cells as its table's head, and room to fill in."""
    width = None
    rows = 0
    for line in markdown(NIT, check_list(NIT, BOARD)).splitlines():
        if not line.startswith("|"):
            width = None
            continue
        width = width or line.count("|")
        assert line.count("|") == width
        rows += 1
    assert rows > 50


def test_pages_of_the_rig_link_to_what_there_is():
    for page in COMMITTED.parent.glob("*.md"):
        links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text("utf-8"))
        missing = [link for link in links if not (page.parent / link).exists()]
        assert missing == []
