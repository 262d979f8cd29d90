# SPDX-License-Identifier: Apache-2.0
"""Position and velocity from counts, against motions that are known."""

import math
import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.encoder import DriveWatch, Encoder, VelocityFilter
from towtank_rig import load_rig
from towtank_rig.conversion import crank_zero

PERIOD_NS = 10_000_000
STEP = 2 * math.pi / 4096


@given(
    st.floats(-10, 10),
    st.floats(-10, 10),
    st.floats(-10, 10),
    st.sets(st.integers(0, 40), max_size=10),
)
def test_velocity_of_a_parabola_is_exact(x0, v, a, lost):
    """Also with scans missing; the fit is a parabola, so only rounding (1e-13 / 0.01 s) is left."""
    velocity = VelocityFilter(0.2)
    stamps = [PERIOD_NS * k for k in range(41) if k not in lost]
    for stamp in stamps:
        t = stamp * 1e-9
        got = velocity.update(stamp, x0 + v * t + 0.5 * a * t * t)
    assert got == pytest.approx(v + a * t, abs=1e-9)


def test_velocity_under_jerk():
    """The parabola misses j T^2 / 10 of a cubic (20 intervals instead of a continuum: -15 %)."""
    velocity = VelocityFilter(0.2)
    jerk = 6.0
    for k in range(100):
        got = velocity.update(PERIOD_NS * k, (0.01 * k) ** 3)
    error = 3 * 0.99**2 - got
    assert error == pytest.approx(jerk * 0.2**2 / 10, rel=0.15)


def test_quantisation_noise_of_velocity():
    """Uniform quantisation error, white because of the dither: 4.4 steps a second rms, +-15 %."""
    velocity = VelocityFilter(0.2)
    source = random.Random(1)
    values = []
    for k in range(4000):
        values.append(velocity.update(PERIOD_NS * k, source.uniform(-0.5, 0.5)))
    settled = values[21:]
    rms = math.sqrt(sum(x * x for x in settled) / len(settled))
    assert rms == pytest.approx(4.4, rel=0.15)


def test_first_count_is_the_origin():
    encoder = Encoder(STEP)
    for k in range(11):
        position, velocity = encoder.update(PERIOD_NS * k, 1_000_000 + 10 * k)
        assert position == pytest.approx(10 * STEP * k)
    assert velocity == pytest.approx(1000 * STEP)


def test_zero_makes_a_new_origin_without_a_jump_in_velocity():
    encoder = Encoder(STEP)
    for k in range(30):
        encoder.update(PERIOD_NS * k, 100 * k)
    encoder.zero()
    for k in (30, 31):
        position, velocity = encoder.update(PERIOD_NS * k, 100 * k)
        assert position == pytest.approx(100 * STEP * (k - 30))
        assert velocity == pytest.approx(10_000 * STEP)


def test_position_is_lost_with_the_epoch_until_it_is_zeroed():
    """Counts begin anew at a steady speed; the velocity is good again with half a window."""
    encoder = Encoder(STEP, start=0.5)
    for k in range(30):
        position, _ = encoder.update(PERIOD_NS * k, 100 * k, epoch=4)
    assert (position, encoder.lost) == (pytest.approx(0.5 + 2900 * STEP), False)
    after = [encoder.update(PERIOD_NS * (32 + k), 100 * k, epoch=5) for k in range(12)]
    assert all(math.isnan(position) for position, _ in after) and encoder.lost
    assert all(math.isnan(velocity) for _, velocity in after[:10])
    assert [velocity for _, velocity in after[10:]] == pytest.approx([10_000 * STEP] * 2)
    encoder.zero()
    position, velocity = encoder.update(PERIOD_NS * 44, 1200, epoch=5)
    assert (position, velocity) == (0.5, pytest.approx(10_000 * STEP))
    assert not encoder.lost


def test_zeroing_while_the_board_is_down_does_not_hide_the_break():
    encoder = Encoder(STEP)
    encoder.update(0, 0, epoch=1)
    encoder.zero()
    assert math.isnan(encoder.update(PERIOD_NS * 50, 7, epoch=2)[0])
    assert encoder.update(PERIOD_NS * 51, 9, epoch=2)[0] == 0.0


def test_drive_in_a_new_epoch():
    """No speed is made of counts of two epochs, though their scans lie 10 ms apart."""
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    watch = DriveWatch(rig)
    for k in range(50):
        watch.update(PERIOD_NS * k, 20 * k, 80 * k, 1)
    drives = [watch.update(PERIOD_NS * k, 20 * (k - 50), 80 * (k - 50), 2) for k in range(50, 100)]
    assert all(math.isnan(drive.carriage_speed) for drive in drives[:10])
    assert all(drive.carriage_speed == pytest.approx(0.9766, abs=1e-3) for drive in drives[10:])


def test_direction_is_the_sign_of_the_step():
    encoder = Encoder(-STEP)
    encoder.update(0, 0)
    assert encoder.update(PERIOD_NS, 1)[0] == -STEP


def test_positions_older_than_the_window_are_forgotten():
    """After a gap longer than the window the old speed must not leak into the new one."""
    velocity = VelocityFilter(0.2)
    for k in range(20):
        velocity.update(PERIOD_NS * k, 5.0 * k)
    after = [velocity.update(PERIOD_NS * k, 0.01 * k) for k in range(100, 111)]
    assert all(math.isnan(value) for value in after[:10])
    assert after[10] == pytest.approx(1.0)


@pytest.mark.parametrize("rate_hz", [10, 100, 200])
def test_no_velocity_is_made_up_at_the_start_and_after_a_gap(rate_hz):
    """A carriage at a steady 1 m/s, and 2 s without scans: a velocity is right or not there. Half a
    window's noise is 12 steps a second at 100 Hz (rms), less at 200; three of these."""
    step = 1e-4
    encoder = Encoder(step)
    resumed, half_window = 3 * rate_hz, rate_hz // 10
    unknown = []
    for k in (*range(rate_hz), *range(resumed, resumed + rate_hz)):
        _, velocity = encoder.update(round(1e9 * k / rate_hz), math.floor(k / rate_hz / step))
        if math.isnan(velocity):
            unknown.append(k)
        else:
            assert velocity == pytest.approx(1.0, abs=36 * step)
    assert unknown == [*range(half_window), *range(resumed, resumed + half_window)]


def test_drive_that_speeds_up_evenly():
    """Crank at 3 rad/s, carriage from rest with 0.25 m/s². The velocity's end slope is exact but
    for steps of 1.5 mrad and 0.12 mm: noise of 4.4 of them a second."""
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    watch = DriveWatch(rig)
    for k in range(200):
        t = 0.01 * k
        crank, wheel = 3.0 * t / (2 * math.pi), 0.125 * t**2 / 0.5  # turns
        drive = watch.update(10_000_000 * k, math.floor(4096 * crank), math.floor(4096 * wheel))
    assert drive.crank_rate == pytest.approx(3.0, abs=0.03)
    assert drive.carriage_speed == pytest.approx(0.25 * 1.99, abs=0.002)
    # Two speeds half a second apart
    assert drive.carriage_acceleration == pytest.approx(0.25, abs=0.01)


def test_drive_at_rest():
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    watch = DriveWatch(rig)
    drives = [watch.update(10_000_000 * k, 7, -9) for k in range(100)]
    start = crank_zero(rig)
    assert all(drive == (0.0, 0.0, 0.0, start, 0.0) for drive in drives[36:])


def test_drive_tells_where_crank_and_carriage_are():
    """The node of the encoders has its positions from here: a quarter of a turn, 512 counts of
    0.5 m / 4096; zeroed, both begin anew."""
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    watch = DriveWatch(rig)
    watch.update(0, 7, -9)
    drive = watch.update(PERIOD_NS, 7 + 1024, -9 + 512)
    assert drive.crank_angle == pytest.approx(crank_zero(rig) + math.pi / 2)
    assert drive.carriage_position == pytest.approx(0.0625)
    watch.zero()
    drive = watch.update(2 * PERIOD_NS, 2000, 3000)
    assert (drive.crank_angle, drive.carriage_position) == (crank_zero(rig), 0.0)
    assert not watch.lost
    assert math.isnan(watch.update(3 * PERIOD_NS, 5, 5, 1).crank_angle)
    assert watch.lost


def test_drive_is_not_known_at_the_start_and_after_a_gap():
    """Steady at 1 m/s throughout: speeds take 0.1 s to be known, the acceleration 0.25 s more, and
    what is told is never more than noise beside the truth."""
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    watch = DriveWatch(rig)
    scans = [*range(100), *range(300, 400)]
    drives = {k: watch.update(10_000_000 * k, 20 * k, math.floor(81.92 * k)) for k in scans}
    for start in (0, 300):
        for k in range(start, start + 100):
            crank_rate, speed, acceleration = drives[k][:3]
            assert math.isnan(speed) == math.isnan(crank_rate) == (k < start + 10)
            assert math.isnan(acceleration) == (k <= start + 35)
            if k >= start + 10:
                assert speed == pytest.approx(1.0, abs=0.005)
            if k > start + 35:
                assert acceleration == pytest.approx(0.0, abs=0.02)
