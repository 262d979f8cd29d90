# SPDX-License-Identifier: Apache-2.0
"""Codes to specific force, pitch and roll."""

import math
from pathlib import Path

import pytest
from towtank_daq.encoder import Drive
from towtank_daq.inclinometer import Inclinometer
from towtank_rig import load_rig

RIG = Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
ALL_VALID = 0x3F
VOLTS_PER_FORCE = 0.067301  # Vdd/5 per g at 3.3 V


@pytest.fixture(scope="module")
def rig():
    return load_rig(RIG)


@pytest.fixture(scope="module")
def inclinometer(rig, description):
    return Inclinometer(rig, description)


def codes(x: float, y: float, z: float) -> list[int]:
    """A scan under a specific force in fish axes, m/s^2: unipolar codes of 1.65 V + S f at 3.3 V.

    The scale ends at 3.3 V, 2.5 g above zero.
    """
    force = [round(2**24 * (1.65 + VOLTS_PER_FORCE * f) / 3.3) for f in (x, y, z)]
    return [0, 0, *force, 0]


def attitude(pitch: float, roll: float, g: float) -> list[int]:
    """At rest: the specific force is g upwards, seen from the tilted fish (REP-103)."""
    return codes(
        -g * math.sin(pitch),
        g * math.cos(pitch) * math.sin(roll),
        g * math.cos(pitch) * math.cos(roll),
    )


@pytest.mark.parametrize("pitch", [-1.2, -0.2, 0.0, 0.1, 0.9])
@pytest.mark.parametrize("roll", [-2.0, 0.0, 0.3])
def test_attitude_at_rest(inclinometer, rig, pitch, roll):
    """One code is 2.9 um/s^2: below 1e-6 rad for these attitudes."""
    reading = inclinometer.process(attitude(pitch, roll, rig.water.gravity.value), ALL_VALID)
    assert reading.pitch == pytest.approx(pitch, abs=2e-6)
    assert reading.roll == pytest.approx(roll, abs=2e-6)
    assert reading.valid


def test_heave_acceleration_of_a_level_fish_does_not_tilt_it(inclinometer, rig):
    """0.06 g of heave, as the thesis's crank gives: an arc tangent does not feel it."""
    g = rig.water.gravity.value
    reading = inclinometer.process(codes(0.0, 0.0, 1.06 * g), ALL_VALID)
    assert (reading.pitch, reading.roll) == pytest.approx((0.0, 0.0), abs=2e-6)
    assert reading.specific_force[2] == pytest.approx(1.06 * g, abs=1e-5)


def test_force_far_from_gravity_means_no_attitude(inclinometer):
    assert not inclinometer.process(codes(0.0, 0.0, 5.0), ALL_VALID).valid


def test_saturated_axis_is_not_valid(inclinometer, rig):
    scan = attitude(0.0, 0.0, rig.water.gravity.value)
    scan[3] = 0
    assert not inclinometer.process(scan, ALL_VALID).valid


@pytest.mark.parametrize("channel", [2, 3, 4])
def test_missing_axis(inclinometer, rig, channel):
    scan = attitude(0.0, 0.0, rig.water.gravity.value)
    reading = inclinometer.process(scan, ALL_VALID & ~(1 << channel))
    assert not reading.valid
    assert math.isnan(reading.pitch)
    assert math.isnan(reading.specific_force[0])


def test_missing_other_channels_do_not_matter(inclinometer, rig):
    assert inclinometer.process(attitude(0.0, 0.0, rig.water.gravity.value), 0b011100).valid


def test_uncertainty_is_that_of_the_calibration(inclinometer, rig):
    """Six positions on a plate: alignment 0.010 rad and zero 3 mV (0.0045 rad) at 95 %, which
    is 0.0056 rad standard; drift and noise add a little."""
    reading = inclinometer.process(attitude(0.0, 0.0, rig.water.gravity.value), ALL_VALID)
    assert 0.0055 < reading.pitch_uncertainty.combined < 0.0062
    assert 0.0055 < reading.roll_uncertainty.combined < 0.0062


def test_roll_is_less_certain_when_pitched_up(inclinometer, rig):
    g = rig.water.gravity.value
    level = inclinometer.process(attitude(0.0, 0.0, g), ALL_VALID)
    steep = inclinometer.process(attitude(-1.2, 0.0, g), ALL_VALID)
    assert steep.roll_uncertainty.type_b > 1.5 * level.roll_uncertainty.type_b


def test_parts_of_the_uncertainty(inclinometer, rig):
    """Noise of 160 and 35 µV over 0.0673 V/(m/s²) is 2.434 mm/s², 0.249 mrad."""
    level = inclinometer.process(attitude(0.0, 0.0, rig.water.gravity.value), ALL_VALID)
    pitch = level.pitch_uncertainty
    assert pitch.type_a == pytest.approx(0.249e-3, rel=0.005)
    assert pitch.combined == pytest.approx(math.hypot(pitch.type_a, pitch.type_b), rel=1e-12)
    assert pitch.u95 == pytest.approx(1.96 * pitch.combined, rel=0.02)  # normal parts dominate
    covariance = level.force_covariance
    # 10 mrad and 3 mV of 95 % on each axis, 0.03 % of 1.65 V as a limit on all of them together, a
    # sensitivity of 0.5 % on the one that feels g, drift beside
    assert math.sqrt(covariance[0]) == pytest.approx(math.hypot(0.050, 0.023, 0.004), abs=0.001)
    assert math.sqrt(covariance[8]) > math.sqrt(covariance[0])
    assert covariance[1] == covariance[3] > 0.9 * 0.0042**2


def test_pitch_is_less_certain_under_way(inclinometer, rig):
    scan = attitude(0.0, 0.0, rig.water.gravity.value)
    still = inclinometer.process(scan, ALL_VALID)
    crank = inclinometer.process(scan, ALL_VALID, Drive(math.pi, 1.0, 0.0))
    ramp = inclinometer.process(scan, ALL_VALID, Drive(0.0, 0.5, 0.25))
    assert still.pitch_uncertainty.u95 < crank.pitch_uncertainty.u95 < ramp.pitch_uncertainty.u95
    # 0.25 m/s² within ±, over √3 and g
    added = ramp.pitch_uncertainty.type_b**2 - still.pitch_uncertainty.type_b**2
    assert math.sqrt(added) == pytest.approx(0.25 / math.sqrt(3) / 9.782, rel=1e-3)
    assert crank.roll_uncertainty == still.roll_uncertainty


@pytest.mark.parametrize("drive", [Drive(math.nan, 1.0, 0.0), Drive(0.0, 1.0, math.nan)])
def test_uncertainty_of_the_angles_under_an_unknown_motion_is_not_told(inclinometer, rig, drive):
    scan = attitude(0.0, 0.0, rig.water.gravity.value)
    unknown = inclinometer.process(scan, ALL_VALID, drive)
    still = inclinometer.process(scan, ALL_VALID)
    assert math.isnan(unknown.pitch_uncertainty.u95) and math.isnan(unknown.roll_uncertainty.u95)
    assert (unknown.pitch, unknown.roll, unknown.valid) == (still.pitch, still.roll, True)
    assert unknown.force_covariance == still.force_covariance
