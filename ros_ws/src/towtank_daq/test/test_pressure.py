# SPDX-License-Identifier: Apache-2.0
"""Codes to pressure and depth, and zeroing."""

import math
import random
from pathlib import Path

import pytest
from towtank_daq.encoder import Drive
from towtank_daq.pressure import PressureSensor, ZeroingError
from towtank_rig import load_rig
from towtank_rig.loading import replaced

RIG = Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
ALL_VALID = 0x3F


@pytest.fixture(scope="module")
def rig():
    return load_rig(RIG)


@pytest.fixture
def sensor(rig, description):
    return PressureSensor(rig, description, "depressor_pressure", zero_scans=200)


def code_of(bridge_volts: float) -> int:
    """Hand formula: INA128 gain 35.96, bipolar AD7124 code at 2.5 V."""
    return round(2**23 * (35.96 * bridge_volts / 2.5 + 1))


def codes(depth: float, rig, noise: float = 0.0) -> list[int]:
    """A scan with the depressor at `depth` (m): 40 mV at 50 kPa, rho g of the rig."""
    pressure = rig.water.density.value * rig.water.gravity.value * depth
    scan = [0] * 6
    scan[1] = code_of(0.040 * (pressure + noise) / 50_000)
    return scan


def at_rest(sensor, rig, depth: float, scans: int = 200, scatter_m: float = 0.0) -> None:
    source = random.Random(1)
    for _ in range(scans):
        sensor.process(codes(depth + source.gauss(0.0, scatter_m), rig), ALL_VALID)


def test_known_depth(sensor, rig):
    """One code is 35.96^-1 * 2.5 V / 2^23 = 8.3 nV, 1.06 um of water."""
    reading = sensor.process(codes(1.5, rig), ALL_VALID)
    assert reading.depth == pytest.approx(1.5, abs=1e-6)
    weight = rig.water.density.value * rig.water.gravity.value
    assert reading.pressure == pytest.approx(1.5 * weight, abs=0.01)
    assert reading.valid


def test_own_channel_is_read(rig, description):
    fish = PressureSensor(rig, description, "fish_pressure", zero_scans=200)
    scan = codes(1.5, rig)
    scan[0] = code_of(0.0)
    assert fish.process(scan, ALL_VALID).depth == pytest.approx(0.0, abs=1e-6)


def test_scan_without_this_conversion(sensor, rig):
    reading = sensor.process(codes(1.5, rig), ALL_VALID & ~0b10)
    assert not reading.valid
    assert math.isnan(reading.depth)
    assert math.isnan(reading.pressure)


@pytest.mark.parametrize("code", [0, 2**24 - 1, code_of(0.0405), code_of(-0.0025)])
def test_beyond_scale_or_range_is_not_valid(sensor, code):
    assert not sensor.process([0, code, 0, 0, 0, 0], ALL_VALID).valid


def test_zeroing_makes_depth_relative(sensor, rig):
    before = sensor.process(codes(1.25, rig), ALL_VALID)
    assert math.isnan(sensor.zero_depth)
    at_rest(sensor, rig, 1.2, scatter_m=0.0001)
    message = sensor.zero()
    after = sensor.process(codes(1.25, rig), ALL_VALID)
    assert sensor.zeroed
    # the mean of 200 samples that scatter by 0.1 mm: 0.007 mm; four of these
    assert after.depth == pytest.approx(0.05, abs=0.00003)
    assert after.pressure == before.pressure
    assert after.depth_uncertainty < before.depth_uncertainty
    assert sensor.zero_depth == pytest.approx(1.2, abs=0.00003)
    assert message.startswith("zero at 1.2")
    assert "200 scans" in message


def test_second_zeroing_replaces_the_first(sensor, rig):
    at_rest(sensor, rig, 1.2)
    sensor.zero()
    at_rest(sensor, rig, 0.7)
    sensor.zero()
    assert sensor.process(codes(0.7, rig), ALL_VALID).depth == pytest.approx(0.0, abs=2e-6)


def test_gain_errors_act_on_the_way_from_the_place_of_zeroing(sensor, rig):
    """The calibrated span's 0.5 % (95 %) on 0.5 m: 1.3 mm; the flow of a trial, Cp within ± 0.3,
    8.9 mm; less than a millimetre of all else. On the whole 1.7 m the span made 4.3 mm."""
    at_rest(sensor, rig, 1.2)
    sensor.zero()
    reading = sensor.process(codes(1.7, rig), ALL_VALID, Drive(0.0, 1.0, 0.0))
    known = math.hypot(0.005 * 0.5 / 1.96, 0.3 * 0.5 / 9.782 / math.sqrt(3))
    assert known < reading.depth_uncertainty < math.hypot(known, 0.001)


def test_too_few_scans_to_zero(sensor, rig):
    at_rest(sensor, rig, 1.2, scans=199)
    assert not sensor.can_be_zeroed
    with pytest.raises(ZeroingError, match="only 199 of 200 good scans have come: wait"):
        sensor.zero()


def test_bad_scans_do_not_count_for_zeroing(sensor, rig):
    at_rest(sensor, rig, 1.2, scans=199)
    sensor.process(codes(1.2, rig), 0)
    assert not sensor.can_be_zeroed


def test_moving_sensor_is_not_zeroed(sensor, rig):
    """Heave of 1 mm at 0.5 Hz: 0.7 mm rms, against some 0.1 mm of noise."""
    for k in range(200):
        depth = 1.2 + 0.001 * math.sin(math.pi * 0.01 * k)
        sensor.process(codes(depth, rig), ALL_VALID)
    with pytest.raises(ZeroingError, match=r"scatters by 0\.7\d mm .* bring the sensor to rest"):
        sensor.zero()
    assert not sensor.zeroed


def test_noisy_sensor_is_not_zeroed(sensor, rig):
    at_rest(sensor, rig, 1.2, scatter_m=0.001)
    with pytest.raises(ZeroingError, match="check its wiring"):
        sensor.zero()


def test_uncertainty_before_zeroing_covers_the_offset(sensor, rig):
    """The data sheet's +-1 mV is 127 mm of water, evenly distributed: 74 mm standard; twice
    +-0.5 % of span, 26 mm, and the slope come on top."""
    reading = sensor.process(codes(1.0, rig), ALL_VALID)
    assert math.hypot(74, 15, 15) < 1e3 * reading.depth_uncertainty < 80
    weight = rig.water.density.value * rig.water.gravity.value
    # The pressure itself does not feel what the water weighs: 0.5 mm of 77
    as_pressure = weight * reading.depth_uncertainty
    assert as_pressure > reading.pressure_uncertainty == pytest.approx(as_pressure, rel=1e-3)
    # One limit dominates: more than 0.95 of it, less than 1.96 standard uncertainties
    assert 0.95 * 0.127 < reading.depth_u95 < 1.9 * reading.depth_uncertainty


def test_type_a_is_the_scatter_at_rest(sensor, rig):
    """The rig's noise until then: sensor 0.5 µV and board 0.56 µV, 0.096 mm."""
    before = sensor.process(codes(1.0, rig), ALL_VALID)
    assert before.depth_type_a == pytest.approx(0.096e-3, rel=0.01)
    at_rest(sensor, rig, 1.2, scatter_m=0.0002)
    sensor.zero()
    after = sensor.process(codes(1.25, rig), ALL_VALID)
    # 200 samples tell a scatter to 5 %; three of that
    assert after.depth_type_a == pytest.approx(0.2e-3, rel=0.15)
    assert after.depth_uncertainty == pytest.approx(
        math.hypot(after.depth_type_a, after.depth_type_b), rel=1e-12
    )


def test_uncertainty_grows_with_the_way_from_the_place_of_zeroing(sensor, rig):
    """0.5 % of 95 % of the span: 0.26 % of the way."""
    at_rest(sensor, rig, 1.2)
    sensor.zero()
    assert sensor.zero_depth == pytest.approx(1.2, abs=1e-5)
    here, below = (sensor.process(codes(depth, rig), ALL_VALID) for depth in (1.2, 1.8))
    assert here.depth_type_b < 0.5e-3
    assert below.depth_type_b == pytest.approx(0.0026 * 0.6, rel=0.2)


def test_flow_past_the_port_is_taken_out_and_makes_depth_uncertain(rig, description):
    changed = replaced(rig, {"sensors.depressor_pressure.flow_coefficient": {"value": 0.2}})
    sensor = PressureSensor(changed, description, "depressor_pressure", zero_scans=10)
    dynamic = 0.5 * changed.water.density.value  # Pa at 1 m/s
    scan = codes(1.2, changed, noise=0.2 * dynamic)
    at_rest(sensor, changed, 1.2, scans=10)
    sensor.zero()
    towed = sensor.process(scan, ALL_VALID, Drive(0.0, 1.0, 0.0))
    still = sensor.process(scan, ALL_VALID)
    assert towed.depth == pytest.approx(0.0, abs=3e-6)
    assert still.depth == pytest.approx(0.2 * 0.5 / 9.782, abs=3e-6)
    assert towed.pressure == still.pressure
    # Cp is known to 0.3 / √3
    added = towed.depth_type_b**2 - still.depth_type_b**2
    assert math.sqrt(added) == pytest.approx(0.3 / math.sqrt(3) * 0.5 / 9.782, rel=1e-3)


def test_a_depth_without_a_known_speed_is_not_told(sensor, rig):
    """What the flow adds is not known then; the pressure is, as well as at rest."""
    unknown = Drive(math.nan, math.nan, math.nan)
    towed = sensor.process(codes(1.2, rig), ALL_VALID, unknown)
    still = sensor.process(codes(1.2, rig), ALL_VALID)
    assert not towed.valid
    assert all(math.isnan(v) for v in (towed.depth, towed.depth_uncertainty, towed.depth_u95))
    assert towed.pressure == still.pressure
    assert towed.pressure_uncertainty == still.pressure_uncertainty
    for _ in range(199):
        sensor.process(codes(1.2, rig), ALL_VALID, unknown)
    assert not sensor.can_be_zeroed
