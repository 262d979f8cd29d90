# SPDX-License-Identifier: Apache-2.0
"""Ramps of the virtual carriage and crank."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_sim.drive import Drive, DriveError, SpeedRamp, drive_command

speeds = st.floats(0.0, 5.0)
rates = st.floats(-10.0, 10.0)
ramps = st.floats(0.5, 20.0)


def commanded(drive: Drive, time: float, carriage: float, crank: float, ramp: float) -> None:
    drive.command_carriage(time, carriage, ramp)
    drive.command_crank(time, crank, ramp)


def test_standing_drive_stays():
    state = Drive().at(1e6)
    assert (state.crank_angle, state.crank_rate) == (0.0, 0.0)
    assert (state.carriage_position, state.carriage_speed) == (0.0, 0.0)


def test_ramp_reaches_the_speed_over_half_the_distance():
    drive = Drive()
    commanded(drive, 2.0, 1.0, math.pi, 4.0)
    # A ramp is odd about its middle, so it covers half of what full speed would.
    end = drive.at(6.0)
    assert end.carriage_speed == 1.0
    assert end.crank_rate == math.pi
    assert end.carriage_position == pytest.approx(2.0, abs=1e-14)
    assert end.crank_angle == pytest.approx(2.0 * math.pi, abs=1e-14)
    later = drive.at(16.0)
    assert later.carriage_position == pytest.approx(12.0, abs=1e-13)
    assert later.carriage_speed == 1.0


def test_stop_ends_at_rest():
    drive = Drive()
    commanded(drive, 0.0, 1.0, 3.0, 2.0)
    commanded(drive, 10.0, 0.0, 0.0, 2.0)
    stopped, later = drive.at(12.0), drive.at(1000.0)
    assert stopped.carriage_speed == 0.0
    assert stopped.crank_rate == 0.0
    assert stopped.carriage_position == pytest.approx(10.0, abs=1e-13)
    assert later.carriage_position == stopped.carriage_position
    assert later.crank_angle == stopped.crank_angle


@given(v0=rates, v1=rates, v2=rates, first=ramps, second=ramps, share=st.floats(0.0, 1.5))
def test_speed_and_acceleration_never_jump(v0, v1, v2, first, second, share):
    """Also where a command comes in the middle of a ramp, and where a ramp ends."""
    ramp = SpeedRamp(speed=v0, target=v1, duration=first)
    changeover = share * first
    after = ramp.then(changeover, v2, second)
    assert after.at(changeover) == pytest.approx(ramp.at(changeover), abs=1e-9)
    end = changeover + second
    assert after.at(end) == pytest.approx(after.at(math.nextafter(end, 0.0)), abs=1e-9)
    assert after.at(end)[1:] == pytest.approx((v2, 0.0), abs=1e-9)


@given(v0=rates, a0=rates, v1=rates, duration=ramps)
def test_position_is_the_integral_of_the_speed(v0, a0, v1, duration):
    ramp = SpeedRamp(0.0, duration, 0.0, v0, a0, v1)
    # Gauss-Legendre with 12 nodes over a cosine of half a period and a cubic: exact to rounding.
    nodes, weights = np.polynomial.legendre.leggauss(12)
    for end in (0.3 * duration, duration):
        times = end / 2 * (nodes + 1)
        integral = end / 2 * sum(w * ramp.at(t)[1] for w, t in zip(weights, times, strict=True))
        assert ramp.at(end)[0] == pytest.approx(integral, abs=1e-9)


@given(v0=rates, a0=rates, v1=rates, duration=ramps, share=st.floats(0.01, 0.99))
def test_acceleration_is_the_slope_of_the_speed(v0, a0, v1, duration, share):
    ramp = SpeedRamp(0.0, duration, 0.0, v0, a0, v1)
    step = 1e-4 * duration
    difference = ramp.at(share * duration + step)[1] - ramp.at(share * duration - step)[1]
    # Central difference: the error is step²/6 of the third derivative of the speed,
    # at most 20·π³/2/T³ + 6·|a0|/T² here.
    bound = step**2 / 6 * (10 * math.pi**3 / duration**3 + 60 / duration**2) + 1e-9
    assert ramp.at(share * duration)[2] == pytest.approx(difference / (2 * step), abs=bound)


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ((math.nan, 0.0, 1.0), "carriage_speed"),
        ((-1.0, 0.0, 1.0), "carriage_speed"),
        ((21.0, 0.0, 1.0), "carriage_speed"),
        ((1.0, math.inf, 1.0), "crank_rate"),
        ((1.0, 51.0, 1.0), "crank_rate"),
        ((1.0, 1.0, 0.0), "ramp_time"),
        ((1.0, 1.0, -3.0), "ramp_time"),
    ],
)
def test_impossible_commands_are_refused_by_name(values, name):
    with pytest.raises(DriveError) as caught:
        drive_command(*values)
    assert str(caught.value).startswith(name)
    assert "\n" not in str(caught.value)
