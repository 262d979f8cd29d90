# SPDX-License-Identifier: Apache-2.0
"""Judging sensors by their codes: thresholds that follow from the rig, and what they let pass.

The faults themselves go through the virtual board in tests/test_sensor_faults.py.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_daq.health_limits import (
    Limits,
    accelerometer_limits,
    excitation_range,
    pressure_limits,
)
from towtank_daq.noise import is_still, slow_wander, wander_margin, white_noise
from towtank_daq.sensor_health import ADVICE, AccelerometerHealth, ChannelWatch, PressureHealth
from towtank_interfaces.msg import SensorHealth
from towtank_node.health import Health
from towtank_rig import load_rig
from towtank_rig.conversion import pressure_from_depth
from towtank_rig.loading import replaced
from towtank_uncertainty import sensor_errors

RIG = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
ALL_VALID = 0x3F


def test_flags_are_those_of_the_message():
    assert {flag.name: flag.value for flag in Health} == {
        name: getattr(SensorHealth, name) for name in Health.__members__
    }
    assert set(ADVICE) == set(Health)
    assert (Health.OPEN | Health.NOISE).names == ["open", "noise"]


def test_white_noise_is_found_under_motion_and_jumps():
    """4000 samples of deviation 3 on a heave of 3000 with a period of 200 samples, and a jump: the
    estimate scatters by 1.166·1.52/√4000 = 2.8 %; three of that. The motion passes as
    (2 sin(π/200))³/√40 of 3000: 0.0018."""
    rng = np.random.default_rng(1)
    k = np.arange(4000)
    codes = 3000 * np.sin(2 * math.pi * k / 200) + rng.normal(0, 3, 4000) + 1e5 * (k > 2000)
    assert white_noise(codes) == pytest.approx(3.0, rel=0.09)


@pytest.mark.parametrize("rate", [80.0, 100.0, 200.0])
def test_slow_wander_is_the_amplitude_of_folded_hum(rate):
    """Hum at the scan rate plus 0.3 Hz: 0.3 Hz. Means over half a second leave sinc(0.15), 0.963,
    of it, the straight line takes a trifle; a drift is no wander."""
    time = np.arange(round(20 * rate)) / rate
    hum = 3.0 * np.sin(2 * math.pi * (rate + 0.3) * time)
    assert slow_wander(hum + 1000.0 - 0.5 * time, rate) == pytest.approx(0.963 * 3.0, rel=0.03)
    # Hum that folds to a quarter of the rate: a mean over half a second leaves the sidelobes of
    # 0.5 s · rate/4 periods, less than 1/(10 π) of it at 80 scans a second.
    other = 3.0 * np.sin(2 * math.pi * (1.25 * rate + 0.3) * time)
    assert slow_wander(other, rate) < 3.0 / (10 * math.pi)
    assert math.isnan(slow_wander(hum[: round(2 * rate)], rate))


def test_slow_wander_of_white_noise_stays_within_its_margin():
    rng = np.random.default_rng(4)
    for _ in range(50):
        found = slow_wander(rng.standard_normal(1000), 100.0)
        assert found < math.sqrt(2 / 50) * (1 + wander_margin(1000, 100.0))


def test_a_channel_that_only_makes_noise_is_still():
    rng = np.random.default_rng(2)
    noise = rng.normal(0, 100, (200, 200))
    assert all(is_still(row, 100.0) for row in noise)
    # A heave of three deviations' amplitude, 4.5 times the noise's variance, is a motion
    motion = noise + 300 * np.sin(2 * math.pi * np.arange(200) / 200)
    assert not any(is_still(row, 100.0) for row in motion)
    assert is_still(np.full(200, 5.0), 100.0)
    # Noise in which a motion would drown is another fault
    assert not any(is_still(10 * row, 100.0) for row in noise)


def test_limits_hold_every_sensor_that_the_rig_allows(description):
    """Codes of 500 random sensors, from the surface to the tank's floor at full speed, and of
    accelerometers in any attitude."""
    rng = np.random.default_rng(3)
    drawn = sensor_errors.draw_many(RIG, rng, 500)
    for sensor in ("fish_pressure", "depressor_pressure"):
        limits = pressure_limits(RIG, description, sensor)
        adc = description.adc_channel(sensor, RIG.board.excitation.value)
        for depth in (0.0, RIG.tank.depth.value):
            volts = getattr(drawn, sensor).volts(pressure_from_depth(depth, RIG.water), 1.0)
            codes = adc.codes(volts)
            assert limits.low <= codes.min() and codes.max() <= limits.high
    direction = rng.standard_normal((500, 3))
    force = RIG.water.gravity.value * direction / np.linalg.norm(direction, axis=1)[:, np.newaxis]
    for axis, volts in zip("xyz", drawn.accelerometer.volts(force).T, strict=True):
        limits = accelerometer_limits(RIG, description, axis)
        codes = description.adc_channel(f"accel_{axis}", 10.0).codes(volts)
        assert limits.low <= codes.min() and codes.max() <= limits.high


def test_limits_are_no_wider_than_errors_at_their_limits(description):
    """Hand figures: 2.2 m are 17.16 mV, ± 1.47 mV of offsets and drifts and 0.8 % of gain; flow at
    1 m/s with Cp 0.1 is 0.04 mV."""
    limits = pressure_limits(RIG, description, "fish_pressure")
    adc = description.adc_channel("fish_pressure", 10.0)
    assert float(adc.volts(limits.high)) == pytest.approx(18.8e-3, abs=0.15e-3)
    assert float(adc.volts(limits.low)) == pytest.approx(-1.51e-3, abs=0.02e-3)


def test_excitation_range_is_the_rigs_or_the_boards(description):
    assert excitation_range(RIG, description) == (9.5, 10.5)
    rig = replaced(RIG, {"board.excitation": {"value": "10 V", "range": [9.9, 10.2]}})
    assert excitation_range(rig, description) == (9.9, 10.2)


@pytest.fixture
def watch(description):
    """A channel with noise of 20 codes, between 1000 and 9000; nothing between −50 and 50."""
    limits = Limits(low=1000, high=9000, short=(-50.0, 50.0), noise=20.0, least_noise=20.0)
    return ChannelWatch(description.adc_channel("accel_x", 10.0), limits, block=100)


def test_equal_codes_are_stuck_when_they_are_no_chance(watch):
    """Two of a noise of 20 codes are equal once in 2√π·20 = 71 times: 1e-12 are 7.5 such pairs."""
    told = [watch.update(5000) for _ in range(12)]
    first = next(i for i, flags in enumerate(told) if Health.STUCK in flags)
    assert first + 1 == 1 + math.ceil(12 / math.log10(2 * math.sqrt(math.pi) * 20))
    assert Health.STUCK not in watch.update(5001)


def test_missing_conversions_break_the_count(watch):
    told = [watch.update(code) for code in [5000] * 6 + [None] + [5000] * 6]
    assert not any(told)


def test_noise_within_expectation_is_no_fault_and_six_times_of_it_is(watch):
    """100 blocks each. The margin of five deviations, of 18 % each at 97 differences, is 90 %: a
    limit of 38, which is 3.8 deviations of the estimate below a noise of 120."""
    rng = np.random.default_rng(4)
    for deviation, expected in ((20.0, False), (120.0, True)):
        codes = np.round(rng.normal(5000, deviation, 10_000)).astype(int)
        told = [Health.NOISE in watch.update(code) for code in codes.tolist()]
        assert all(flag == expected for flag in told[200:])
        watch.update(None)


def test_a_pressure_sensor_that_stands_while_the_crank_turns_is_stuck(description):
    """Noise without motion over two turns of 4096 counts in 200 scans each; then motion."""
    rng = np.random.default_rng(5)
    health = PressureHealth(RIG, description, "fish_pressure")
    told = []
    for k in range(800):
        swing = 20_000 * math.sin(2 * math.pi * k / 200) if k >= 420 else 0.0
        code = 9_500_000 + round(rng.normal(0, 90) + swing)
        told.append(health.update([code, 0, 0, 0, 0, 13_421_773], ALL_VALID, 4096 * k // 200))
    assert Health.STUCK not in told[150]
    assert Health.STUCK in told[250] and Health.STUCK in told[405]
    assert told[-1] == 0


def test_counts_that_begin_anew_are_no_turn_of_the_crank(description):
    """It stands at rest, where a sensor shows but noise, while the board is reset."""
    rng = np.random.default_rng(5)
    health = PressureHealth(RIG, description, "fish_pressure")
    for k in range(400):
        codes = [9_500_000 + round(rng.normal(0, 90)), 0, 0, 0, 0, 13_421_773]
        crank, epoch = (100_000, 1) if k < 200 else (0, 2)
        assert health.update(codes, ALL_VALID, crank, epoch) == 0


def test_excitation_out_of_range_concerns_the_bridges(description):
    health = PressureHealth(RIG, description, "fish_pressure")
    adc = description.adc_channel("excitation", 10.0)

    def flags(volts, mask=ALL_VALID):
        return health.update([9_500_000, 0, 0, 0, 0, int(adc.codes(volts))], mask, 0)

    assert Health.EXCITATION not in flags(9.6)
    assert Health.EXCITATION in flags(9.4)
    assert Health.EXCITATION in flags(10.6)
    assert Health.EXCITATION not in flags(0.0, mask=0x1F)


def test_axes_of_an_accelerometer_are_told_together(description):
    health = AccelerometerHealth(RIG, description)
    level = [round(2**24 * volts / 3.3) for volts in (1.65, 1.65, 2.31)]
    assert health.update([0, 0, *level, 0], ALL_VALID) == 0
    assert health.update([0, 0, 0, *level[1:], 0], ALL_VALID) == Health.SHORT | Health.SATURATED
    top = 2**24 - 1
    assert health.update([0, 0, *level[:2], top, 0], ALL_VALID) & Health.SATURATED
