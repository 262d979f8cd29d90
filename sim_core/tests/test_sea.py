# SPDX-License-Identifier: Apache-2.0
"""Waves: dispersion, spectrum, and what the same seed gives."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sim_core as sc


@given(frequency=st.floats(0.01, 50.0), depth=st.floats(0.01, 1e4))
def test_dispersion(frequency, depth):
    k = sc.wave_number(frequency, depth=depth)
    assert 9.81 * k * math.tanh(k * depth) == pytest.approx(frequency**2, rel=1e-12)


def test_dispersion_has_its_limits():
    assert sc.wave_number(2.0) == pytest.approx(4.0 / 9.81, rel=1e-15)  # deep
    # Long waves run at √(g d); the next term of the series is (kd)²/6 of that, here 4e-9.
    assert sc.wave_number(1e-3, depth=0.25) == pytest.approx(
        1e-3 / math.sqrt(9.81 * 0.25), rel=1e-8
    )


def test_regular_waves_run_where_they_should():
    sea = sc.regular_waves(height=0.2, period=2.0, direction=0.5, phase=0.3)
    k = sea.wave_numbers()[0]
    time = np.linspace(0.0, 4.0, 9)
    along = 0.7 * math.cos(0.5) + 0.4 * math.sin(0.5)
    expected = 0.1 * np.cos(k * along - np.pi * time + 0.3)
    assert sea.elevation(time, x=0.7, y=0.4) == pytest.approx(expected, abs=1e-14)


def test_waves_rise_from_calm():
    sea = sc.regular_waves(height=0.2, period=2.0, ramp_time=8.0)
    full = sc.regular_waves(height=0.2, period=2.0)
    time = np.array([-1.0, 0.0, 4.0, 8.0, 8.3])
    rise = np.array([0.0, 0.0, 0.5, 1.0, 1.0])
    assert sea.elevation(time) == pytest.approx(rise * full.elevation(time), abs=1e-15)


def jonswap(frequency, peak_period, gamma):
    """Without its scale (DNV-RP-C205, 3.5.5)."""
    r = frequency * peak_period / (2.0 * math.pi)
    width = np.where(r <= 1.0, 0.07, 0.09)
    return r**-5.0 * np.exp(-1.25 * r**-4.0) * gamma ** np.exp(-0.5 * ((r - 1.0) / width) ** 2)


@pytest.mark.parametrize("gamma", [1.0, 3.3])
def test_spectrum_is_jonswap(gamma):
    n = 400
    sea = sc.jonswap_sea(
        significant_height=2.0, peak_period=8.0, gamma=gamma, components=n, seed=3, depth=30.0
    )
    a, w = np.array(sea.amplitude), np.array(sea.frequency)
    assert np.sum(a**2) / 2.0 == pytest.approx(2.0**2 / 16.0, rel=1e-12)
    # Energy below every train against the spectrum's integral: each holds 1/n, half of it below.
    grid = np.linspace(0.5 * 2.0 * math.pi / 8.0, 5.0 * 2.0 * math.pi / 8.0, 200_001)
    s = jonswap(grid, 8.0, gamma)
    below = np.concatenate([[0.0], np.cumsum((s[1:] + s[:-1]) / 2.0)])
    share = np.interp(w, grid, below / below[-1])
    assert share == pytest.approx((np.arange(n) + 0.5) / n, abs=1e-5)  # grid of 1e-4 of the range


def test_variance_in_time_is_that_of_the_spectrum():
    height, duration = 1.5, 3600.0
    sea = sc.jonswap_sea(significant_height=height, peak_period=6.0, components=300, seed=11)
    zeta = sea.elevation(np.arange(0.0, duration, 0.5), x=3.0)
    a, w = np.array(sea.amplitude), np.array(sea.frequency)
    # Over random phases the mean square over T scatters by the beats that T does not average out:
    # each pair adds a_i a_j cos(beat) sinc((ω_i − ω_j) T/2), of variance half its square.
    beat = np.sinc(np.subtract.outer(w, w) * duration / (2.0 * np.pi))
    pairs = np.triu(np.outer(a, a) * beat, 1)
    scatter = math.sqrt(0.5 * np.sum(pairs**2))
    assert scatter < 0.1 * height**2 / 16.0  # the test can fail
    assert abs(np.mean(zeta**2) - height**2 / 16.0) < 3.0 * scatter


def test_the_seed_makes_the_sea():
    def sea(**changes):
        return sc.jonswap_sea(
            **({"significant_height": 1.0, "peak_period": 5.0, "seed": 1} | changes)
        )

    assert sea() == sea()
    assert sea() != sea(seed=2)
    assert sea().frequency == sea(seed=2).frequency
    # Pinned, so that another compiler's sea would be seen
    assert sea(seed=42).phase[0] == pytest.approx(2.0 * math.pi * 0.755155532, abs=1e-8)


def test_spreading():
    sea = sc.jonswap_sea(
        significant_height=1.0,
        peak_period=5.0,
        direction=0.4,
        spreading=4.0,
        components=2000,
        seed=5,
    )
    off = np.array(sea.direction) - 0.4
    assert np.abs(off).max() <= math.pi / 2
    # cos⁴: <sin²> = 1/6 exactly; its scatter over one draw is √(<sin⁴> − 1/36) = √(1/16 − 1/36)
    # = 0.19 (∫ sin⁴ cos⁴ / ∫ cos⁴ = 1/16).
    assert np.mean(np.sin(off) ** 2) == pytest.approx(1.0 / 6.0, abs=4.0 * 0.19 / math.sqrt(2000))
    assert abs(np.mean(np.sin(off))) < 4.0 * math.sqrt(1.0 / 6.0 / 2000)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"depth": 0.0}, "depth"),
        ({"frequency": -1.0}, "frequencies"),
        ({"phase": [1.0, 2.0]}, "one for each of the 1"),
        ({"gravity": math.nan}, "gravity"),
    ],
)
def test_impossible_seas_are_refused(changes, message):
    with pytest.raises(sc.InvalidInput, match=message):
        sc.Sea(**({"amplitude": [0.1], "frequency": 1.0} | changes))
