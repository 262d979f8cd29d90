# SPDX-License-Identifier: Apache-2.0
"""Laws of motion: velocity and acceleration are the derivatives of the position."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sim_core as sc

LAWS = {
    "tow": sc.SteadyTow(position=(1, 2, 3), velocity=(1, 0.5, 0), run_up_time=4),
    "sinusoid": sc.Sinusoid(
        mean=(0, 0, -2), velocity=(1, 0, 0), amplitude=0.1, period=1.6, phase=0.3, ramp_time=3,
        run_up_time=2,
    ),
    "slider crank": sc.SliderCrank(
        mean=(0, 0, -2), velocity=(1, 0, 0), crank_radius=0.1, rod_length=0.35, period=1.6, phase=1,
        ramp_time=3,
    ),
    "stop": sc.EmergencyStop(
        position=(1, 2, 3), velocity=(1, 0.5, 0), stop_time=4, stopping_time=4, run_up_time=3
    ),
    "turn": sc.Turn(
        position=(1, 2, 3), velocity=(1, 0.5, 0), start_time=2, angle=-1.8, radius=2.5,
        entry_time=2, run_up_time=2,
    ),
    "heave on a turn": sc.Turn(
        position=(1, 2, 3), velocity=(1, 0, 0), start_time=1, angle=7, radius=1, entry_time=2
    ) + sc.Sinusoid(mean=(0, 0, 0), amplitude=0.1, period=3),
}  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
@given(t=st.floats(0.01, 10))
def test_derivatives(name, t):
    law, h = LAWS[name], 1e-4
    before, now, after = law(t - h), law(t), law(t + h)
    # central differences: h²/6 times the third derivative (ω³ A = 6 m/s³, ramps up to 60/T³)
    assert (after.position - before.position) / (2 * h) == pytest.approx(now.velocity, abs=1e-6)
    assert (after.velocity - before.velocity) / (2 * h) == pytest.approx(now.acceleration, abs=1e-5)


def test_slider_crank_after_its_ramp():
    """z = −r cos θ + l (1 − √(1 − (r/l)² sin²θ)), θ = phase + 2π (t − ramp/2)/T."""
    law, t = LAWS["slider crank"], 7.7
    theta = 1 + 2 * math.pi * (t - 1.5) / 1.6
    z = -0.1 * math.cos(theta) + 0.35 * (1 - math.sqrt(1 - (0.1 / 0.35 * math.sin(theta)) ** 2))
    assert law(t).position == pytest.approx([t, 0, -2 + z], abs=1e-12)


def test_run_up_ends_at_full_speed():
    sample = LAWS["tow"](6.0)
    assert sample.velocity == pytest.approx([1, 0.5, 0])
    assert sample.position == pytest.approx([1 + 4.0, 2 + 2.0, 3])  # half of the run-up is lost
    assert LAWS["tow"](0.0).velocity == pytest.approx([0, 0, 0])


@given(st.floats(-2, 12))
def test_turn_is_at_constant_speed(t):
    assert np.linalg.norm(LAWS["turn"](2 + abs(t)).velocity) == pytest.approx(math.hypot(1, 0.5))


def test_one_circle_at_six_knots():
    """Without easements the ship is back where it turned, and goes on; half-way it is a diameter
    to port."""
    speed = 6 * 1852 / 3600
    law = sc.Turn(
        position=(0, 0, 0),
        velocity=(speed, 0, 0),
        start_time=10,
        angle=2 * math.pi,
        circle_time=600,
    )
    radius = speed * 600 / (2 * math.pi)
    assert law(310).position == pytest.approx([10 * speed, 2 * radius, 0])
    assert law(310).velocity == pytest.approx([-speed, 0, 0])
    assert law(400).acceleration @ law(400).velocity == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(law(400).acceleration) == pytest.approx(speed**2 / radius)
    assert law(620).position == pytest.approx([20 * speed, 0, 0], abs=1e-9)


def test_turn_with_easements_ends_on_its_course():
    """The heading changes by the angle asked for; the track is symmetric about its middle, so that
    the ends are as far along the bisector of the courses."""
    angle, entry, radius = 4.0, 3.0, 10.0
    law = sc.Turn(
        position=(0, 0, 0), velocity=(2, 0, 0), start_time=0, angle=angle, radius=radius,
        entry_time=entry,
    )  # fmt: skip
    duration = angle * radius / 2 + entry
    end = law(duration)
    assert end.velocity == pytest.approx([2 * math.cos(angle), 2 * math.sin(angle), 0])
    chord, half = end.position, angle / 2  # the chord of a symmetric track has the mean direction
    assert chord[0] * math.sin(half) - chord[1] * math.cos(half) == pytest.approx(0, abs=1e-12)
    after = law(duration + 5).position
    assert after == pytest.approx(end.position + 5 * end.velocity)
    # against a quadrature of the velocity: the trapezoidal rule on 1e5 intervals is good to 1e-9
    t = np.linspace(0, duration, 100_001)
    v = np.array([law(s).velocity for s in t])
    assert np.trapezoid(v, t, axis=0) == pytest.approx(end.position, abs=1e-8)


def test_stop_takes_the_distance_asked_for():
    law = sc.EmergencyStop(
        position=(0, 0, 0), velocity=(2, 0, 0), stop_time=5, stopping_distance=30
    )
    assert law(5).position == pytest.approx([10, 0, 0])
    assert law(5 + 2 * 30 / 2).position == pytest.approx([40, 0, 0])
    assert law(99).position == pytest.approx([40, 0, 0])
    assert law(99).velocity.tolist() == [0, 0, 0]
    sudden = sc.EmergencyStop(position=(0, 0, 0), velocity=(2, 0, 0), stop_time=5, stopping_time=0)
    assert sudden(4.999).velocity == pytest.approx([2, 0, 0])
    assert sudden(5.001).velocity.tolist() == [0, 0, 0]
    assert sudden(9).position == pytest.approx([10, 0, 0])


def test_times_before_the_start():
    assert sc.SteadyTow(position=(0, 0, 0), velocity=(2, 0, 0))(-1.5).position[0] == -3.0
    assert LAWS["tow"](-1.0).position.tolist() == [1, 2, 3]


def test_time_series_is_exact_on_cubics():
    t = np.array([0.0, 0.3, 1.0, 1.2])
    position = np.column_stack([t**3, t**2, 1 - t])
    velocity = np.column_stack([3 * t**2, 2 * t, -np.ones_like(t)])
    law = sc.TimeSeries(t, position, velocity)
    for s in (0.1, 0.77, 1.2):
        sample = law(s)
        assert sample.position == pytest.approx([s**3, s**2, 1 - s], abs=1e-14)
        assert sample.velocity == pytest.approx([3 * s**2, 2 * s, -1], abs=1e-13)
        if s < 1.2:
            assert sample.acceleration == pytest.approx([6 * s, 2, 0], abs=1e-11)
    assert law(2.2).position == pytest.approx([1.2**3 + 3 * 1.2**2, 1.2**2 + 2.4, -1.2])


def turn(**given):
    return sc.Turn(**{"position": (0, 0, 0), "velocity": (1, 0, 0), "start_time": 0, **given})


def stop(**given):
    return sc.EmergencyStop(position=(0, 0, 0), velocity=(1, 0, 0), **given)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sc.Sinusoid(mean=(0, 0, 0), amplitude=1, period=0), "period"),
        (
            lambda: sc.SliderCrank(mean=(0, 0, 0), crank_radius=1, rod_length=0.5, period=1),
            "rod_length",
        ),
        (lambda: sc.SteadyTow(position=(0, 0, math.nan)), "finite"),
        (lambda: turn(angle=0.1, radius=1, entry_time=3), "shorten entry_time"),
        (lambda: turn(angle=1, radius=1, circle_time=3), "either radius or circle_time"),
        (lambda: turn(angle=1, radius=1, velocity=(1, 0, 0.1)), "level"),
        (lambda: turn(angle=1, radius=0), "radius"),
        (lambda: turn(angle=1, radius=math.nan), "finite"),
        (lambda: stop(stop_time=1), "either stopping_time or stopping_distance"),
        (lambda: stop(stop_time=1, stopping_time=-1), "stopping_time"),
        (lambda: stop(stop_time=1, stopping_time=1, run_up_time=2), "run-up"),
        (lambda: sc.TimeSeries([0, 0], np.zeros((2, 3)), np.zeros((2, 3))), "increase"),
        (lambda: sc.TimeSeries([0, 1], np.zeros((3, 3)), np.zeros((2, 3))), "same length"),
    ],
)
def test_refuses_impossible_laws(make, message):
    with pytest.raises(sc.InvalidInput, match=message):
        make()
