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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sc.Sinusoid(mean=(0, 0, 0), amplitude=1, period=0), "period"),
        (
            lambda: sc.SliderCrank(mean=(0, 0, 0), crank_radius=1, rod_length=0.5, period=1),
            "rod_length",
        ),
        (lambda: sc.SteadyTow(position=(0, 0, math.nan)), "finite"),
        (lambda: sc.TimeSeries([0, 0], np.zeros((2, 3)), np.zeros((2, 3))), "increase"),
        (lambda: sc.TimeSeries([0, 1], np.zeros((3, 3)), np.zeros((2, 3))), "same length"),
    ],
)
def test_refuses_impossible_laws(make, message):
    with pytest.raises(sc.InvalidInput, match=message):
        make()
