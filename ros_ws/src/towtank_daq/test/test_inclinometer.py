# SPDX-License-Identifier: Apache-2.0
"""Codes to specific force, pitch and roll."""

import math
from pathlib import Path

import pytest
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
    """A scan under a specific force in fish axes, m/s^2: unipolar codes of 1.65 V + S f at 2.5 V.

    The scale ends at 2.5 V, 1.29 g above zero.
    """
    force = [round(2**24 * (1.65 + VOLTS_PER_FORCE * f) / 2.5) for f in (x, y, z)]
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
    """One code is 2.2 um/s^2: below 1e-6 rad for these attitudes."""
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
    assert 0.0055 < reading.pitch_uncertainty < 0.0062
    assert 0.0055 < reading.roll_uncertainty < 0.0062


def test_roll_is_less_certain_when_pitched_up(inclinometer, rig):
    g = rig.water.gravity.value
    level = inclinometer.process(attitude(0.0, 0.0, g), ALL_VALID)
    steep = inclinometer.process(attitude(-1.2, 0.0, g), ALL_VALID)
    assert steep.roll_uncertainty > 1.5 * level.roll_uncertainty
