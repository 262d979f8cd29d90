# SPDX-License-Identifier: Apache-2.0
"""Smoothing of encoder samples."""

import math

import numpy as np
import pytest
from towtank_sim.smoother import HALF_WIDTH, DriveSmoother

PERIOD_NS = 10_000_000
CRANK_COUNT = 2 * math.pi / 4096  # rad
CARRIAGE_COUNT = 0.5 / 4096  # m


def smooth(stamps, crank, carriage):
    smoother = DriveSmoother()
    samples = (
        smoother.push(int(stamp), float(a), float(x))
        for stamp, a, x in zip(stamps, crank, carriage, strict=True)
    )
    return [sample for sample in samples if sample is not None]


def columns(samples):
    """Seconds, crank angle, crank rate, carriage position, carriage speed."""
    return np.array(
        [
            (s.stamp * 1e-9, s.crank_angle, s.crank_rate, s.carriage_position, s.carriage_speed)
            for s in samples
        ]
    ).T


def quantised(values, count):
    return np.floor(values / count) * count


def weights():
    """Effective weights of value and slope (1/s) at even spacing: answers to unit samples."""
    stamps = np.arange(2 * HALF_WIDTH + 1) * PERIOD_NS
    answers = [smooth(stamps, unit, 0 * unit)[0] for unit in np.eye(len(stamps))]
    return (
        np.array([a.crank_angle for a in answers]),
        np.array([a.crank_rate for a in answers]),
    )


def test_lag_is_half_a_window():
    samples = smooth(np.arange(50) * PERIOD_NS, np.zeros(50), np.zeros(50))
    assert len(samples) == 50 - 2 * HALF_WIDTH
    assert samples[0].stamp == HALF_WIDTH * PERIOD_NS


def test_parabolas_pass_unchanged_at_uneven_spacing_and_with_losses():
    generator = np.random.default_rng(1)
    stamps = np.arange(200) * PERIOD_NS + generator.integers(-1_000_000, 1_000_000, 200)
    stamps = stamps[generator.random(200) > 0.3]
    t = stamps * 1e-9
    crank, carriage = 2.0 + 3.0 * t - 0.7 * t**2, 40.0 + 1.0 * t + 0.2 * t**2
    time, angle, rate, position, speed = columns(smooth(stamps, crank, carriage))
    np.testing.assert_allclose(angle, 2.0 + 3.0 * time - 0.7 * time**2, atol=1e-11)
    np.testing.assert_allclose(rate, 3.0 - 1.4 * time, atol=1e-10)
    np.testing.assert_allclose(position, 40.0 + time + 0.2 * time**2, atol=1e-11)
    np.testing.assert_allclose(speed, 1.0 + 0.4 * time, atol=1e-10)


def test_quantisation_is_held_below_its_bounds():
    """A rocking crank, θ = sin 3t: no count pattern repeats, every speed occurs."""
    value_weights, slope_weights = weights()
    t = np.arange(3000) * PERIOD_NS * 1e-9
    time, angle, rate, position, speed = columns(
        smooth(
            np.arange(3000) * PERIOD_NS,
            quantised(np.sin(3 * t), CRANK_COUNT),
            quantised(0.9 * t, CARRIAGE_COUNT),
        )
    )
    # Rounding down puts the samples half a count low; the rest is at most half a count either way,
    # and the fit adds it up with its weights.
    count_bound = 0.5 * np.abs(value_weights).sum()
    rate_bound = 0.5 * np.abs(slope_weights).sum()
    # A parabola misses a sine's third and fourth derivatives by at most (h = 0.1 s, factor from
    # the moments of the kernel below 1): h⁴/24·3⁴ in value, h²/6·3³ in slope.
    value_bias, slope_bias = 0.1**4 / 24 * 81, 0.1**2 / 6 * 27
    assert np.abs(angle - np.sin(3 * time) + CRANK_COUNT / 2).max() <= (
        count_bound * CRANK_COUNT + value_bias
    )
    assert np.abs(rate - 3 * np.cos(3 * time)).max() <= rate_bound * CRANK_COUNT + slope_bias
    assert np.abs(position - 0.9 * time + CARRIAGE_COUNT / 2).max() <= count_bound * CARRIAGE_COUNT
    assert np.abs(speed - 0.9).max() <= rate_bound * CARRIAGE_COUNT


def test_tow_point_is_not_shaken():
    """30 rpm and 0.06 m: the tow point's speed errs by well under 1 mm/s of 188 mm/s.

    Differences of raw samples would err by up to a count per period: 9 mm/s in heave, 12 mm/s
    along the run.
    """
    radius, crank_rate = 0.06, math.pi
    t = np.arange(6000) * PERIOD_NS * 1e-9
    time, angle, rate, _, speed = columns(
        smooth(
            np.arange(6000) * PERIOD_NS,
            quantised(crank_rate * t, CRANK_COUNT),
            quantised(t, CARRIAGE_COUNT),
        )
    )
    heave_error = radius * rate * np.cos(angle) - radius * crank_rate * np.cos(
        crank_rate * time - CRANK_COUNT / 2
    )
    # The errors of the samples are spread evenly over a count and differ from sample to sample,
    # so their standard deviation, count/√12, passes the fit as √Σw²; patterns of counts that
    # beat with the sampling may stand out by a factor of a few.
    independent = math.sqrt((weights()[1] ** 2).sum()) / math.sqrt(12)
    assert heave_error.std() < 3 * independent * CRANK_COUNT * radius < 1e-3
    assert (speed - 1.0).std() < 3 * independent * CARRIAGE_COUNT < 1e-3
    print(f"tow-point speed noise: heave {heave_error.std():.2e}, run {(speed - 1).std():.2e} m/s")


def test_far_down_the_tank_no_digits_are_lost():
    stamps = 1_700_000_000_000_000_000 + np.arange(21) * PERIOD_NS
    position = 1e4 + np.arange(21) * 0.01
    sample = smooth(stamps, position, position)[0]
    # Differences of values near 1e4 hold 2e-12.
    assert sample.carriage_position == pytest.approx(position[10], abs=1e-11)
    assert sample.carriage_speed == pytest.approx(1.0, abs=1e-9)
