# SPDX-License-Identifier: Apache-2.0
"""The harmonic fit on motions whose first harmonic is known."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter
from scipy.special import stdtrit
from scipy.stats import binom
from towtank_compare.harmonic import AnalysisError, fit_first_harmonic

PERIODS = 5
RATE_HZ = 100
CRANK_HZ = 0.5
TIME = np.arange(0, PERIODS / CRANK_HZ, 1 / RATE_HZ)
ANGLE = 2 * np.pi * CRANK_HZ * TIME


def fit(values, angle=ANGLE, periods=PERIODS):
    return fit_first_harmonic(values, angle, float(angle[0]), periods)


def motion(amplitude, phase, angle=ANGLE):
    return amplitude * np.cos(angle + phase)


def test_a_motion_of_the_model_is_recovered_to_rounding():
    """Drift, first and higher harmonics lie in the model's space: nothing is left over.
    Rounding: 1e-16 of values of order 1, times a condition below 10."""
    values = 1.3 + 0.2 * TIME - 0.01 * TIME**2 + motion(0.05, 0.7)
    values += motion(0.02, -1.0, 2 * ANGLE) + motion(0.01, 2.0, 3 * ANGLE)
    harmonic = fit(values)
    assert harmonic.amplitude == pytest.approx(0.05, abs=1e-14)
    assert harmonic.phase == pytest.approx(0.7, abs=1e-12)
    assert harmonic.residual_rms < 1e-14
    assert harmonic.variance < 1e-28


def test_a_crank_of_uneven_speed_smears_nothing():
    angle = ANGLE + 0.3 * np.sin(0.4 * TIME)
    periods = int((angle[-1] - angle[0]) / (2 * np.pi))
    inside = angle <= angle[0] + 2 * np.pi * periods
    harmonic = fit(motion(0.05, 0.7, angle)[inside], angle[inside], periods=periods)
    assert harmonic.amplitude == pytest.approx(0.05, abs=1e-14)


@pytest.mark.parametrize("periods", [3, 5, 10, 20])
@pytest.mark.parametrize("phase", np.linspace(0, 2 * np.pi, 6, endpoint=False))
def test_a_dying_swing_leaks_little(periods, phase):
    """The fish's slow swing after the start, 40 mm with a period of five crank periods, beside a
    harmonic of 0.5 mm. A cubic spline with knots h apart misses a line of frequency w by about
    (w h)^4/384 of it, here 0.65 %, 0.26 mm; what of that lies at the crank frequency over three
    whole periods and more is less than half."""
    time = np.arange(0, periods / CRANK_HZ, 1 / RATE_HZ)
    angle = 2 * np.pi * CRANK_HZ * time
    swing = 40.0 * np.exp(-time / 15.0) * np.cos(2 * np.pi * time / 10.0 + phase)
    harmonic = fit(0.5 * np.cos(angle + 0.7) + swing, angle, periods)
    assert abs(harmonic.value - cmath.rect(0.5, 0.7)) < 0.13
    if periods == 10:  # the figure that the module's text gives
        assert abs(harmonic.value - cmath.rect(0.5, 0.7)) < 0.025


def test_gaps_change_nothing_but_the_uncertainty():
    rng = np.random.default_rng(1)
    kept = rng.random(len(TIME)) > 0.3
    kept[200:330] = False  # and a hole of 1.3 s, more than half a period
    harmonic = fit(motion(0.05, 0.7)[kept], ANGLE[kept])
    assert harmonic.amplitude == pytest.approx(0.05, abs=1e-14)
    assert harmonic.samples == kept.sum()


@given(
    phase=st.floats(-3, 3),
    drift=st.tuples(*[st.floats(-1, 1)] * 3),
    scale=st.floats(0.01, 100),
    shift=st.floats(-3, 3),
    seed=st.integers(0, 1000),
)
def test_drift_scale_and_phase_act_as_they_should(phase, drift, scale, shift, seed):
    """Adding drift changes nothing, scaling the heave scales amplitude and uncertainty, starting
    the crank elsewhere turns the phase. Tolerances: rounding of values up to 100."""
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(len(TIME))
    values = motion(0.05, phase) + noise
    base = fit(values)

    drifted = fit(values + drift[0] + drift[1] * TIME + drift[2] * TIME**2)
    assert abs(drifted.value - base.value) < 1e-12
    assert drifted.variance == pytest.approx(base.variance, rel=1e-6)

    scaled = fit(scale * values)
    assert scaled.amplitude == pytest.approx(scale * base.amplitude, rel=1e-10)
    assert scaled.variance == pytest.approx(scale**2 * base.variance, rel=1e-9)
    assert scaled.effective_samples == pytest.approx(base.effective_samples, rel=1e-9)

    turned = fit(values, angle=ANGLE - shift)
    assert abs(turned.value - base.value * cmath.rect(1, shift)) < 1e-12


def white(rng, n):
    return rng.standard_normal(n)


def red(rng, n):
    """First-order autoregressive noise, correlation 0.9 from sample to sample."""
    settling = 100  # 0.9^100: the start is forgotten
    innovations = math.sqrt(1 - 0.9**2) * rng.standard_normal(n + settling)
    return lfilter([1], [1, -0.9], innovations)[settling:]


@pytest.mark.parametrize("noise", [white, red])
@pytest.mark.parametrize("periods", [2, 5, 20])
def test_the_stated_interval_covers_the_truth(noise, periods):
    """In 400 runs the 95 % interval of the amplitude misses between the 0.01 % and the 99.99 %
    point of the binomial distribution of 5 %. Red noise is allowed a true level down to 92 %: its
    spectrum slopes over the band in which it is measured."""
    runs = 400
    time = np.arange(0, periods / CRANK_HZ, 1 / 20)
    angle = 2 * np.pi * CRANK_HZ * time
    rng = np.random.default_rng(periods)
    missed = 0
    for _ in range(runs):
        values = 0.05 * np.cos(angle + 0.7) + 1e-3 * noise(rng, len(time))
        harmonic = fit(values, angle, periods)
        u95 = stdtrit(harmonic.dof, 0.975) * math.sqrt(harmonic.variance)
        missed += abs(harmonic.amplitude - 0.05) > u95
    worst = 0.08 if noise is red else 0.05
    assert binom.ppf(1e-4, runs, 0.05) <= missed <= binom.ppf(1 - 1e-4, runs, worst)


def test_white_noise_counts_every_sample_and_red_noise_few():
    """The spectrum of first-order noise with correlation r is, at ω rad per sample,
    (1 − r²)/(1 − 2r cos ω + r²) times that of white noise of the same variance: the inverse share
    of the samples counts. The figure for one run scatters as the inverse of a chi-squared variable
    with 34 degrees of freedom: biased by 2/34 = 6 %, and the mean of 50 runs by a standard
    deviation of √(2/34/50) = 3.4 %."""
    time = np.arange(0, 40, 0.02)
    angle = 2 * np.pi * CRANK_HZ * time
    rng = np.random.default_rng(0)
    fits = {
        noise: [fit(noise(rng, len(time)), angle, 20) for _ in range(50)] for noise in (white, red)
    }
    shares = {
        noise: np.mean([f.effective_samples / f.samples for f in runs])
        for noise, runs in fits.items()
    }
    spectrum = (1 - 0.9**2) / (1 - 2 * 0.9 * math.cos(2 * math.pi * CRANK_HZ * 0.02) + 0.9**2)
    assert shares[white] == pytest.approx(1, rel=0.2)
    assert shares[red] == pytest.approx(1 / spectrum, rel=0.2)
    assert fits[white][0].dof > 25


def test_too_few_samples_are_refused():
    with pytest.raises(AnalysisError, match="only 39 samples in 5 crank periods, 40 are needed"):
        fit(motion(1, 0)[:39], ANGLE[:39])


def test_one_period_is_refused():
    with pytest.raises(AnalysisError, match="only 1 whole crank periods"):
        fit(motion(1, 0), periods=1)


def test_a_gap_that_hides_the_harmonic_is_refused():
    """Samples only around one phase of each period tell nothing of amplitude and drift."""
    kept = (ANGLE % (2 * np.pi)) < 0.6
    with pytest.raises(AnalysisError, match="gaps"):
        fit(motion(1, 0)[kept], ANGLE[kept])


def test_a_sample_that_is_not_a_number_is_refused():
    values = motion(1, 0)
    values[7] = np.nan
    with pytest.raises(AnalysisError, match="not a number"):
        fit(values)
