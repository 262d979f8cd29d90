# SPDX-License-Identifier: Apache-2.0
"""The heave ratio of a window: known answers, windows, refusals, uncertainty."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom
from towtank_compare.harmonic import AnalysisError
from towtank_compare.heave import HeaveSamples, analyse_window
from towtank_compare.kinematics import bow_up_pitch, place_height
from towtank_compare.series import Series
from towtank_rig import load_rig
from towtank_rig.conversion import depth_from_pressure, pressure_from_depth
from towtank_rig.loading import replaced
from towtank_uncertainty.combination import combine
from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget
from towtank_uncertainty.intervals import Normal, Rectangular, half_width
from towtank_uncertainty.ratio_budget import ratio_errors, ratio_relative_uncertainty
from towtank_uncertainty.sensor_errors import draw

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
START_NS = 1_750_000_000_000_000_000
START_MS = START_NS // 1_000_000
CRANK_HZ = 0.5
FISH, DEPRESSOR, LAG = 0.012, 0.055, -0.8
"""Amplitudes in m, and the fish's phase after the depressor's, rad."""


def stamps(duration_s: float, rate_hz: float = 100, offset_ns: int = 0) -> np.ndarray:
    return START_NS + offset_ns + np.arange(0, int(duration_s * 1e9), int(1e9 / rate_hz))


def make_samples(
    source="measured",
    duration_s=40.0,
    noise_m=0.0,
    seed=0,
    crank_hz=CRANK_HZ,
    fish_m=FISH,
    depressor_m=DEPRESSOR,
):
    """Heave of both bodies on drifting means; pressure samples fall between crank samples."""
    rng = np.random.default_rng(seed)

    def heave(amplitude, phase, offset_ns, mean):
        t_ns = stamps(duration_s, offset_ns=offset_ns)
        t = (t_ns - START_NS) * 1e-9
        values = mean + 1e-4 * t + amplitude * np.cos(2 * np.pi * crank_hz * t + phase)
        return Series.of(t_ns, values + noise_m * rng.standard_normal(len(t)))

    crank_ns = stamps(duration_s)
    crank = Series.of(crank_ns, 100.0 + 2 * np.pi * crank_hz * (crank_ns - START_NS) * 1e-9)
    return HeaveSamples(
        source,
        crank,
        fish=heave(fish_m, 0.3 + LAG, 546_000, -1.2),
        depressor=heave(depressor_m, 0.3, 1_638_000, -0.9),
    )


def test_amplitudes_ratio_and_phase_are_those_of_the_motion():
    """Exact up to rounding: the crank's angle is linear between its samples."""
    result = analyse_window(make_samples("twin"), RIG, START_MS, START_MS + 40_000)
    assert result.fish.amplitude == pytest.approx(FISH, rel=1e-9)
    assert result.depressor.amplitude == pytest.approx(DEPRESSOR, rel=1e-9)
    assert result.ratio == pytest.approx(FISH / DEPRESSOR, rel=1e-9)
    assert result.phase == pytest.approx(LAG, abs=1e-9)
    assert result.depressor.phase == pytest.approx(
        math.remainder(0.3 - 100.0, 2 * math.pi), abs=1e-9
    )
    assert result.crank_frequency_hz == pytest.approx(CRANK_HZ, rel=1e-9)
    assert result.periods == 20
    assert result.ratio_uncertainty is None and result.budget is None


def test_phase_is_wrapped():
    samples = make_samples("twin")
    turned = dataclasses.replace(
        samples, fish=Series(samples.fish.stamp_ns, -samples.fish.values - 2.4)
    )
    result = analyse_window(turned, RIG, START_MS, START_MS + 40_000)
    assert result.phase == pytest.approx(LAG + math.pi, abs=1e-9)
    assert -math.pi < result.phase <= math.pi


def test_a_crank_that_runs_backwards_gives_the_same():
    samples = make_samples("twin")
    backwards = dataclasses.replace(
        samples, crank=Series(samples.crank.stamp_ns, -samples.crank.values)
    )
    result = analyse_window(backwards, RIG, START_MS, START_MS + 40_000)
    assert result.ratio == pytest.approx(FISH / DEPRESSOR, rel=1e-9)
    assert result.phase == pytest.approx(LAG, abs=1e-9)


def test_only_samples_inside_the_window_count():
    samples = make_samples("measured", noise_m=1e-3)
    t0, t1 = START_MS + 10_003, START_MS + 21_007
    inside = dataclasses.replace(
        samples,
        **{
            name: getattr(samples, name).between(t0 * 1_000_000, t1 * 1_000_000)
            for name in ("crank", "fish", "depressor")
        },
    )
    assert analyse_window(samples, RIG, t0, t1) == analyse_window(inside, RIG, t0, t1)


def test_the_order_of_the_samples_does_not_matter():
    """Bit for bit: a bag may hold them in another order than they were received in."""
    samples = make_samples("measured", noise_m=1e-3)
    order = np.random.default_rng(3).permutation(len(samples.fish))
    shuffled = dataclasses.replace(
        samples, fish=Series.of(samples.fish.stamp_ns[order], samples.fish.values[order])
    )
    window = (START_MS + 5_000, START_MS + 15_000)
    assert analyse_window(samples, RIG, *window) == analyse_window(shuffled, RIG, *window)


@pytest.mark.parametrize(("duration_ms", "periods"), [(10_000, 5), (9_970, 5), (9_950, 4)])
def test_whole_periods_are_used(duration_ms, periods):
    """At 2 s a period, a window that lacks less than 40 ms counts as whole."""
    samples = make_samples("twin")
    result = analyse_window(samples, RIG, START_MS, START_MS + duration_ms)
    assert result.periods == periods
    assert result.used_to_s <= periods / CRANK_HZ + 0.01


def test_lost_samples_are_bridged():
    """A tenth of the scans and a hole of 2.5 s: more than a period."""
    samples = make_samples("measured", noise_m=1e-4)
    rng = np.random.default_rng(5)
    kept = rng.random(4000) > 0.1
    kept[1000:1250] = False
    lossy = HeaveSamples(
        "measured",
        *(
            Series(series.stamp_ns[kept], series.values[kept])
            for series in (samples.crank, samples.fish, samples.depressor)
        ),
    )
    result = analyse_window(lossy, RIG, START_MS, START_MS + 40_000)
    # Noise of 0.1 mm over 3300 samples leaves 0.1 mm·√(2/3300) = 2.5 µm; five times that.
    assert result.fish.amplitude == pytest.approx(FISH, abs=12e-6)
    assert 2.5 < result.fish.largest_gap_s < 2.7
    assert result.fish.samples < 3400


def test_the_scatters_interval_covers_the_truth():
    """The scatter's own interval (the sensors' systematic part put to nothing) misses the truth in
    200 runs no more and no less often than 5 % allow, between the 0.01 % and 99.99 % points."""
    runs, missed = 200, {"ratio": 0, "fish": 0, "depressor": 0, "phase": 0}
    calm = replaced(
        RIG, {f"sensors.{body}_pressure.errors.surge_speed": 0.0 for body in ("fish", "depressor")}
    )
    for seed in range(runs):
        samples = make_samples("measured", duration_s=10.0, noise_m=3e-4, seed=seed)
        result = analyse_window(samples, calm, START_MS, START_MS + 10_000)

        # Student's factor for the scatter alone is that of the phase, which in calm flow has no
        # other part
        factor = result.phase_uncertainty.coverage_factor
        for what, value, truth, uncertainty in (
            ("ratio", result.ratio, FISH / DEPRESSOR, result.ratio_uncertainty),
            ("fish", result.fish.amplitude, FISH, result.fish.uncertainty),
            ("depressor", result.depressor.amplitude, DEPRESSOR, result.depressor.uncertainty),
        ):
            missed[what] += abs(value - truth) > factor * uncertainty.type_a
        missed["phase"] += abs(result.phase - LAG) > result.phase_uncertainty.u95
    for what, count in missed.items():
        assert binom.ppf(1e-4, runs, 0.05) <= count <= binom.ppf(1 - 1e-4, runs, 0.05), what


def test_surge_makes_the_phase_uncertain():
    """Cp·ρ·U·dU of both ports over the pressure of their heave, as an angle."""
    result = analyse_window(make_samples("measured", 20.0), RIG, START_MS, START_MS + 20_000)
    effects = []
    for body, amplitude in (("fish", FISH), ("depressor", DEPRESSOR)):
        errors = getattr(RIG.sensors, f"{body}_pressure").errors
        cp = errors.flow_coefficient.standard_uncertainty  # its value is 0
        surge = errors.surge_speed.standard_uncertainty
        speed, gravity = RIG.run.carriage_speed.value, RIG.water.gravity.value
        effects.append(cp * speed * surge / gravity / amplitude)
    # The amplitudes of the fit are the true ones to 1e-4 without noise.
    assert result.phase_uncertainty.type_b == pytest.approx(math.hypot(*effects), rel=1e-3)


def test_motion_that_both_bodies_share_does_not_widen_the_ratio():
    """Slow changes of amplitude in proportion, as those of the carriage's speed make, leave the
    ratio as it is: noise that is the first harmonic itself times a random factor."""
    samples = make_samples("measured", duration_s=20.0)
    t = samples.fish.seconds_since(START_NS)
    rng = np.random.default_rng(2)
    factor = 1 + 0.02 * np.interp(t, np.arange(0, 21), rng.standard_normal(21))
    together = HeaveSamples(
        "measured",
        samples.crank,
        Series(samples.fish.stamp_ns, FISH * factor * np.cos(np.pi * t + 0.3 + LAG)),
        Series(samples.fish.stamp_ns, DEPRESSOR * factor * np.cos(np.pi * t + 0.3)),
    )
    result = analyse_window(together, RIG, START_MS, START_MS + 20_000)
    apart = math.hypot(
        result.fish.uncertainty.type_a / result.fish.amplitude,
        result.depressor.uncertainty.type_a / result.depressor.amplitude,
    )
    assert apart > 1e-3
    assert result.ratio_uncertainty.type_a / result.ratio < 0.25 * apart


def test_the_sensors_budget_is_the_rigs():
    result = analyse_window(make_samples(), RIG, START_MS, START_MS + 40_000)
    speed = RIG.run.carriage_speed.value
    fish, depressor = (
        depth_budget(RIG, sensor, OperatingPoint(-motion.mean, motion.amplitude, speed))
        for sensor, motion in (
            ("fish_pressure", result.fish),
            ("depressor_pressure", result.depressor),
        )
    )
    assert result.fish.uncertainty.type_b == pytest.approx(fish.gain * FISH, rel=1e-6)
    relative = ratio_relative_uncertainty(fish, depressor)
    assert result.ratio_uncertainty.type_b == pytest.approx(relative * result.ratio, rel=1e-6)
    expanded = half_width(ratio_errors(fish, depressor))
    assert result.u95 == pytest.approx(expanded * result.ratio, rel=1e-3)


def test_the_budget_holds_where_the_sensors_are_and_not_where_heave_counts_from():
    """Zeroed at 0.9 m, 1.2 m above the fish: a bend that is flat in the middle of the fitted 20 kPa
    (1.03 m) is felt by its slope at 2.1 m."""
    zeroed = dataclasses.replace(make_samples(), zero_depths=(0.9, 0.6))
    result = analyse_window(zeroed, RIG, START_MS, START_MS + 40_000)
    speed = RIG.run.carriage_speed.value
    at = OperatingPoint(0.9 - result.fish.mean, result.fish.amplitude, speed, 0.9)
    fish = depth_budget(RIG, "fish_pressure", at)
    assert result.fish.uncertainty.type_b == pytest.approx(fish.gain * FISH, rel=1e-6)
    plain = analyse_window(make_samples(), RIG, START_MS, START_MS + 40_000)
    assert result.fish.uncertainty.type_b > plain.fish.uncertainty.type_b
    assert result.ratio == plain.ratio


def test_u95_covers_the_errors_of_sensors_drawn_from_the_budget():
    """300 pairs of sensors with errors drawn from the rig's tolerances read the same motion. The
    interval misses the true ratio and amplitudes as often as 5 % allows, between the 0.01 % and
    99.99 % points. Surge past the ports is left out of the budget: this motion has none."""
    still = replaced(
        RIG, {f"sensors.{body}_pressure.errors.surge_speed": 0.0 for body in ("fish", "depressor")}
    )
    runs, missed = 300, {"ratio": 0, "fish": 0, "depressor": 0}
    clean = make_samples("measured", duration_s=10.0)

    def read(sensor, heave, rng):
        pressure = pressure_from_depth(-heave.values, RIG.water)
        volts = sensor.volts(pressure, speed=1.0)
        volts = volts + sensor.noise * rng.standard_normal(len(volts))
        depth = depth_from_pressure(sensor.conversion.pressure(volts), RIG.water)
        return Series(heave.stamp_ns, -depth)

    for seed in range(runs):
        sensors, rng = draw(still, seed), np.random.default_rng(seed)
        samples = HeaveSamples(
            "measured",
            clean.crank,
            read(sensors.fish_pressure, clean.fish, rng),
            read(sensors.depressor_pressure, clean.depressor, rng),
        )
        result = analyse_window(samples, still, START_MS, START_MS + 10_000)
        missed["ratio"] += abs(result.ratio - FISH / DEPRESSOR) > result.u95
        missed["fish"] += abs(result.fish.amplitude - FISH) > result.fish.uncertainty.u95
        missed["depressor"] += (
            abs(result.depressor.amplitude - DEPRESSOR) > result.depressor.uncertainty.u95
        )
    for what, count in missed.items():
        assert binom.ppf(1e-4, runs, 0.05) <= count <= binom.ppf(1 - 1e-4, runs, 0.05), what


def test_combination_follows_the_gum():
    """Examples from GUM table G.2: t₉₅ of 4 degrees of freedom is 2.776; with an equal type B part
    the effective number is 4·(√2)⁴ = 16, t₉₅ = 2.120."""
    assert combine(1.0, 4, ()).u95 == pytest.approx(2.776, abs=5e-4)
    assert combine(1.0, 4, (Normal(1.0),)).u95 == pytest.approx(2.120 * math.sqrt(2), abs=1e-3)
    assert combine(0.0, 4, (Normal(1.0),)).u95 == pytest.approx(1.95996, abs=1e-4)


def test_combination_knows_that_limits_are_limits():
    """An error anywhere within ± 1 never leaves it, and 95 % of it lie within ± 0.95."""
    assert combine(0.0, 4, (Rectangular(1.0),)).u95 == pytest.approx(0.95, abs=1e-3)
    assert combine(0.01, 4, (Rectangular(1.0),)).u95 == pytest.approx(0.95, abs=1e-3)
    assert combine(0.0, 4, ()).u95 == 0.0


def test_peak_to_peak_stands_beside():
    """Half the range of a sinusoid is its amplitude (sampled 200 times a period: to 1 − cos(π/200)
    = 1.2e-4); the drift of 1e-4 m/s over 32 s adds 1.6 mm of half range at most."""
    result = analyse_window(make_samples(), RIG, START_MS, START_MS + 40_000)
    assert 0 <= result.peak_to_peak.fish - FISH * (1 - 2e-4) <= 1.6e-3
    assert 0 <= result.peak_to_peak.depressor - DEPRESSOR * (1 - 2e-4) <= 1.6e-3
    assert result.peak_to_peak.ratio > result.ratio


@pytest.mark.parametrize(
    ("change", "duration_ms", "reason"),
    [
        ({}, 3_900, r"only 1\.9\d crank periods in the window, 2 are needed"),
        ({"crank_hz": 1e-4}, 40_000, "the crank does not turn"),
        ({"duration_s": 0.001}, 40_000, "no crank angles"),
        ({"depressor_m": 0.0}, 40_000, "does not heave"),
    ],
)
def test_a_window_without_a_result_is_refused_with_the_reason(change, duration_ms, reason):
    samples = make_samples("twin", **change)
    with pytest.raises(AnalysisError, match=reason):
        analyse_window(samples, RIG, START_MS, START_MS + duration_ms)


def test_a_body_without_samples_is_named():
    samples = dataclasses.replace(make_samples(), fish=Series.of([], []))
    with pytest.raises(AnalysisError, match="heave of the fish: only 0 samples"):
        analyse_window(samples, RIG, START_MS, START_MS + 40_000)


def test_a_crank_that_turns_back_is_refused():
    samples = make_samples()
    angle = samples.crank.values.copy()
    angle[2000:] = 2 * angle[2000] - angle[2000:] / 2 - angle[2000] / 2
    with pytest.raises(AnalysisError, match="turns back"):
        analyse_window(
            dataclasses.replace(samples, crank=Series(samples.crank.stamp_ns, angle)),
            RIG,
            START_MS,
            START_MS + 40_000,
        )


def test_place_height_turns_with_the_body():
    """Pitch of +90° about +y (bow down) takes the x axis to −z and the z axis to +x; roll of +90°
    about +x takes y to +z."""
    half = math.sqrt(0.5)
    bow_down, rolled = np.array([[0, half, 0, half]]), np.array([[half, 0, 0, half]])
    z = np.array([-2.0])
    assert place_height(z, bow_down, (0.65, 0, 0)) == pytest.approx(-2.65)
    assert place_height(z, bow_down, (0, 0, 0.1)) == pytest.approx(-2.0)
    assert place_height(z, rolled, (0, 0.05, 0)) == pytest.approx(-1.95)
    small = np.array([[0, math.sin(0.05), 0, math.cos(0.05)]])
    assert bow_up_pitch(small) == pytest.approx(-0.1)
