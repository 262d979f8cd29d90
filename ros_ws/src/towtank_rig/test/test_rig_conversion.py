# SPDX-License-Identifier: Apache-2.0
"""Conversions: known answers, and there and back again."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_rig import RigError, load_rig
from towtank_rig.conversion import (
    Channel,
    accelerometer_conversion,
    calibrated_channel,
    carriage_encoder,
    crank_encoder,
    depth_conversion,
    depth_from_pressure,
    flow_pressure,
    pitch,
    pressure_conversion,
    pressure_from_depth,
    roll,
    rotation,
)
from towtank_rig.loading import replaced

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
BRIDGE = Channel(gain=40.37, offset=0.0, reference_volts=2.5, bipolar=True)
SINGLE = Channel(gain=1.0, offset=0.0, reference_volts=2.5, bipolar=False)
SHIFTED = Channel(gain=0.2, offset=0.1, reference_volts=2.5, bipolar=False, pga=1.0, bits=16)
G = RIG.water.gravity.value

angles = st.floats(-1.4, 1.4)


def test_codes_of_the_data_sheet():
    # AD7124: bipolar 2^23 (V G/Vref + 1), unipolar 2^24 V G/Vref.
    assert BRIDGE.codes(0.0) == 2**23
    assert BRIDGE.codes(1.25 / 40.37) == 2**23 + 2**22
    assert SINGLE.codes(1.25) == 2**23
    assert SHIFTED.codes(0.0) == round(0.1 / 2.5 * 2**16)


@pytest.mark.parametrize("channel", [BRIDGE, SINGLE, SHIFTED])
@given(share=st.floats(0.0, 1.0))
def test_volts_to_code_and_back_differ_by_half_a_step(channel, share):
    low, high = channel.volts([1, 2**channel.bits - 2])
    volts = low + share * (high - low)
    # Half a step, and the rounding of doubles of the size of the scale.
    tolerance = 0.5 * channel.resolution + 4e-16 * abs(high - low) / channel.gain
    assert abs(channel.volts(channel.codes(volts)) - volts) <= tolerance


@pytest.mark.parametrize("channel", [BRIDGE, SINGLE, SHIFTED])
@given(data=st.data())
def test_code_to_volts_and_back_is_exact(channel, data):
    code = data.draw(st.integers(0, 2**channel.bits - 1))
    assert channel.codes(channel.volts(code)) == code


def test_scale_ends_saturate():
    volts = np.array([-1.0, 0.0, 1.0])
    codes = BRIDGE.codes(volts)
    assert codes.tolist() == [0, 2**23, 2**24 - 1]
    assert BRIDGE.saturated(codes).tolist() == [True, False, True]


def test_full_scale_pressure_gives_the_span():
    conversion = pressure_conversion(RIG, "fish_pressure")
    assert conversion.volts(50_000.0) == pytest.approx(0.040, rel=1e-15)
    assert conversion.pressure(0.020) == pytest.approx(25_000.0, rel=1e-15)


@given(pressure=st.floats(-1e4, 2e5), excitation=st.floats(2.0, 16.0))
def test_code_of_a_ratiometric_bridge_does_not_feel_the_excitation(pressure, excitation):
    at_nominal = pressure_conversion(RIG, "fish_pressure").volts(pressure)
    # The true bridge and the true reference both follow the true excitation.
    true = Channel(gain=40.37, offset=0.0, reference_volts=excitation / 4, bipolar=True)
    code = true.codes(at_nominal * excitation / 10.0)
    assert abs(code - BRIDGE.codes(at_nominal)) <= 1  # a rounding at the edge of a step


def test_board_at_half_the_excitation_halves_the_volts_of_the_same_pressure():
    full = pressure_conversion(RIG, "fish_pressure")
    half = pressure_conversion(replaced(RIG, {"board.excitation": 5.0}), "fish_pressure")
    pressures = np.linspace(0.0, 5e4, 11)
    np.testing.assert_allclose(half.volts(pressures), full.volts(pressures) / 2, rtol=1e-15)
    np.testing.assert_allclose(half.pressure(half.volts(pressures)), pressures, rtol=1e-14)


def test_calibration_takes_the_place_of_the_data_sheet():
    calibrated = replaced(
        RIG,
        {
            "calibrations.fish_pressure.span": 0.0395,
            "calibrations.fish_pressure.offset": 0.0002,
            "calibrations.fish_pressure.afe_gain": 40.5,
        },
    )
    conversion = pressure_conversion(calibrated, "fish_pressure")
    assert conversion.pressure(0.0397) == pytest.approx(50_000.0, rel=1e-12)
    assert calibrated_channel(calibrated, "fish_pressure", BRIDGE).gain == 40.5
    assert calibrated_channel(calibrated, "depressor_pressure", BRIDGE) == BRIDGE
    bare = replaced(RIG, {"calibrations": {}, "sensors.fish_pressure.span": 0.041})
    assert pressure_conversion(bare, "fish_pressure").span == 0.041


@given(depth=st.floats(0.0, 5.0))
def test_depth_to_pressure_and_back(depth):
    pressure = pressure_from_depth(depth, RIG.water)
    assert pressure == pytest.approx(996.5 * 9.782 * depth, rel=1e-15)
    assert depth_from_pressure(pressure, RIG.water) == pytest.approx(depth, rel=1e-15)


def test_no_hydrostatic_pressure_in_air():
    assert pressure_from_depth([-0.2, 0.0], RIG.water).tolist() == [0.0, 0.0]


def test_flow_pressure_at_one_metre_a_second_is_51_mm_of_water():
    head = flow_pressure(1.0, 1.0, RIG.water)
    assert float(depth_from_pressure(head, RIG.water)) == pytest.approx(0.5 / 9.782, rel=1e-15)


@given(roll_angle=angles, pitch_angle=angles, yaw=st.floats(-3.0, 3.0), scale=st.floats(0.1, 4.0))
def test_attitude_is_exact_whatever_scales_gravity(roll_angle, pitch_angle, yaw, scale):
    # Heave acceleration of the tank's vertical only scales the specific force.
    force = rotation(roll_angle, pitch_angle, yaw).T @ np.array([0.0, 0.0, scale * G])
    # Near ±80° the other components are a sixth of g: six roundings.
    assert pitch(force) == pytest.approx(pitch_angle, abs=1e-14)
    assert roll(force) == pytest.approx(roll_angle, abs=1e-14)


def test_sense_of_pitch_and_roll():
    # At rest an accelerometer feels its support, upwards. Nose down: upwards is towards the tail.
    assert pitch([-0.1, 0.0, 9.8]) > 0.0
    # Starboard down: upwards is towards port.
    assert roll([0.0, 0.1, 9.8]) > 0.0


def test_surge_acceleration_reads_as_pitch():
    # A carriage that starts with 0.5 m/s² looks like a nose raised by 2.9°.
    assert math.degrees(float(pitch([0.5, 0.0, 9.81]))) == pytest.approx(-2.92, abs=0.01)


@given(st.lists(st.floats(-15.0, 15.0), min_size=3, max_size=3))
def test_specific_force_to_volts_and_back(force):
    mounted = accelerometer_conversion(MOUNTED)
    assert mounted.specific_force(mounted.volts(force)) == pytest.approx(force, abs=1e-12)


MOUNTED = replaced(
    RIG,
    {
        "sensors.accelerometer.mounting.roll": 0.5,
        "sensors.accelerometer.mounting.pitch": -0.2,
        "sensors.accelerometer.mounting.yaw": 0.3,
        "calibrations.accelerometer.y.sensitivity": 0.066,
        "calibrations.accelerometer.misalignment": {
            name: f"{0.01 * number} rad"
            for number, name in enumerate(("xy", "xz", "yx", "yz", "zx", "zy"), start=-2)
        },
    },
)


def test_misaligned_axis_feels_what_lies_across_it():
    """Axis x leans by 0.02 towards z: level, it feels 0.02 g, which is no pitch."""
    path = "calibrations.accelerometer.misalignment"
    leaning = {name: "0 rad" for name in ("xy", "xz", "yx", "yz", "zx", "zy")} | {"xz": "0.02 rad"}
    conversion = accelerometer_conversion(replaced(RIG, {path: leaning}))
    level = conversion.volts([0.0, 0.0, 10.0])
    assert level[0] - conversion.zero_g[0] == pytest.approx(0.2 * conversion.sensitivity[0])
    assert pitch(conversion.specific_force(level)) == pytest.approx(0.0, abs=1e-12)


def test_mounting_turns_sensor_axes_to_fish_axes():
    # A sensor turned a quarter about z points its x to port: what it feels along x is the fish's y.
    turned = accelerometer_conversion(
        replaced(RIG, {"sensors.accelerometer.mounting.yaw": math.pi / 2})
    )
    assert turned.specific_force([1.65 + 0.067301, 1.65, 1.65]) == pytest.approx(
        [0.0, 1.0, 0.0], abs=1e-12
    )
    upside_down = accelerometer_conversion(
        replaced(RIG, {"sensors.accelerometer.mounting.roll": math.pi})
    )
    level = upside_down.volts([0.0, 0.0, 9.80665])
    # One g is Vdd/5 = 0.66 V; the sensitivity in the file has five digits.
    assert level == pytest.approx([1.65, 1.65, 1.65 - 0.66], abs=1e-5)


def test_arrays_of_samples_convert_like_single_ones():
    conversion = accelerometer_conversion(RIG)
    forces = np.random.default_rng(1).normal(0.0, 5.0, (4, 7, 3))
    volts = conversion.volts(forces)
    assert volts.shape == forces.shape
    np.testing.assert_allclose(volts[2, 3], conversion.volts(forces[2, 3]), rtol=1e-15)
    assert pitch(forces).shape == roll(forces).shape == (4, 7)


def test_encoders_of_the_rig():
    assert crank_encoder(RIG).value(4096) == pytest.approx(2 * math.pi, rel=1e-15)
    assert carriage_encoder(RIG).value(8192) == pytest.approx(1.0, rel=1e-15)
    assert carriage_encoder(RIG).shaft_angle(0.25) == pytest.approx(math.pi, rel=1e-15)


@given(count=st.integers(-(2**40), 2**40), direction=st.sampled_from([1, -1]))
def test_counts_to_angle_and_back(count, direction):
    encoder = crank_encoder(TURNED[direction])
    middle = encoder.value(count + 0.5)  # between two edges
    assert encoder.counts(middle) == count
    # 2^40 counts are 1.7e9 rad: a rounding is 2e-7 rad there.
    assert encoder.shaft_angle(middle) == pytest.approx(
        direction * float(middle), rel=1e-15, abs=1e-15
    )


TURNED = {sign: replaced(RIG, {"sensors.crank_encoder.direction": sign}) for sign in (1, -1)}


CALIBRATION = "calibrations.fish_pressure"
bends = st.floats(-0.004, 0.004)


@given(share=st.floats(-0.2, 1.2), quadratic=bends, cubic=bends)
def test_pressure_through_a_polynomial_and_back(share, quadratic, cubic):
    """Bends of a tenth of the span, forty times a sensor's: Newton's steps leave nothing."""
    changes = {"quadratic": f"{quadratic} V", "cubic": f"{cubic} V"}
    rig = replaced(RIG, {f"{CALIBRATION}.{key}": value for key, value in changes.items()})
    bridge = pressure_conversion(rig, "fish_pressure")
    pressure = share * bridge.full_scale
    assert bridge.pressure(bridge.volts(pressure)) == pytest.approx(pressure, abs=1e-9 * 50_000)


def test_polynomial_of_the_calibration():
    rig = replaced(
        RIG, {f"{CALIBRATION}.quadratic": "0.0004 V", f"{CALIBRATION}.cubic": "-0.0001 V"}
    )
    bridge = pressure_conversion(rig, "fish_pressure")
    half = 0.5 * 0.040 + 0.25 * 0.0004 - 0.125 * 0.0001
    assert bridge.volts(25_000.0) == pytest.approx(half, rel=1e-12)
    assert bridge.volts([0.0, 50_000.0]) == pytest.approx([0.0, 0.0403], abs=1e-15)


def test_temperature_of_the_water_shifts_a_calibrated_sensor():
    """27 °C in the tank, 20 °C at the calibration: 7 K."""
    rig = replaced(
        RIG,
        {
            f"{CALIBRATION}.temperature": "20 degC",
            f"{CALIBRATION}.span_temperature": "2e-4 1/K",
            f"{CALIBRATION}.offset_temperature": "-1e-5 V/K",
        },
    )
    bridge = pressure_conversion(rig, "fish_pressure")
    assert bridge.volts(0.0) == pytest.approx(-7e-5, rel=1e-12)
    assert bridge.volts(50_000.0) - bridge.volts(0.0) == pytest.approx(0.040 * 1.0014, rel=1e-12)
    # The other sensor has its own calibration
    assert pressure_conversion(rig, "depressor_pressure").volts(0.0) == 0.0


def test_polynomial_that_does_not_rise_is_refused():
    with pytest.raises(RigError, match=r"quadratic: the volts do not rise .*; correct it or cubic"):
        replaced(RIG, {f"{CALIBRATION}.quadratic": "-0.03 V"})


def test_coefficient_of_temperature_needs_its_temperature():
    with pytest.raises(RigError, match=r"without the temperature .* add '<number> degC'"):
        replaced(RIG, {f"{CALIBRATION}.span_temperature": "2e-4 1/K"})


def test_pressure_of_the_flow_is_taken_out_of_the_depth():
    rig = replaced(RIG, {"sensors.fish_pressure.flow_coefficient": "0.1"})
    conversion = depth_conversion(rig, "fish_pressure", BRIDGE)
    at_port = pressure_from_depth(1.0, rig.water) + flow_pressure(0.1, 1.5, rig.water)
    codes = BRIDGE.codes(conversion.bridge.volts(at_port))
    pressure = conversion.pressure(codes)
    # Half a code is 3.7 nV, 4.6 mPa
    assert pressure == pytest.approx(at_port, abs=0.005)
    assert conversion.depth(pressure, 1.5) == pytest.approx(1.0, abs=1e-6)
    assert conversion.depth(pressure, 0.0) - 1.0 == pytest.approx(0.1 * 1.5**2 / 2 / G, abs=1e-6)
