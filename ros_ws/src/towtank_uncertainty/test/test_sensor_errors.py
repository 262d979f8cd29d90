# SPDX-License-Identifier: Apache-2.0
"""Random sensors: ideal ones invert the conversion, drawn ones scatter as the budget says."""

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_rig import load_rig
from towtank_rig.conversion import (
    depth_from_pressure,
    pitch,
    pressure_from_depth,
    roll,
    rotation,
)
from towtank_rig.loading import replaced
from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget
from towtank_uncertainty.inclination_budget import inclination_budget
from towtank_uncertainty.intervals import half_width
from towtank_uncertainty.ratio_budget import ratio_errors, ratio_relative_uncertainty
from towtank_uncertainty.sensor_errors import add_noise, draw, draw_many, error_terms, none, realise

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
BARE = replaced(RIG, {"calibrations": {}})
RIGS = pytest.mark.parametrize("rig", [RIG, BARE], ids=["calibrated", "data_sheet"])
DRAWS = 1000
# The standard deviation of n draws scatters by σ/√(2n) for a normal distribution, less for flatter
# ones: 2.2 % here. Five of them fail a true statement once in a million.
SPREAD = 5 / math.sqrt(2 * DRAWS)
SENSORS = ("fish_pressure", "depressor_pressure")


def true_amplitude_and_mean(heave):
    """Return the first harmonic's amplitude and the mean of one period of even samples."""
    harmonic = 2.0 * np.fft.rfft(heave)[1] / len(heave)
    return abs(harmonic), float(np.mean(heave))


def read_heave(sensor, rig, depth, speed):
    """Return the depth that the rig's own conversion makes of a sensor's volts, zeroed in air."""
    volts = sensor.volts(pressure_from_depth(depth, rig.water), speed=speed)
    zero = sensor.volts(0.0, drift=0.0)
    pressure = sensor.conversion.pressure(volts) - sensor.conversion.pressure(zero)
    return depth_from_pressure(pressure, rig.water)


PHASE = 2 * math.pi * np.arange(16) / 16


@RIGS
def test_ideal_sensors_invert_the_conversion(rig):
    ideal = none(rig)
    depth = 1.2 + 0.05 * np.sin(PHASE)
    for name in SENSORS:
        sensor = getattr(ideal, name)
        np.testing.assert_allclose(read_heave(sensor, rig, depth, speed=0.0), depth, rtol=1e-13)
        assert sensor.noise == 0.0
    force = rotation(0.1, -0.2, 0.3).T @ np.array([0.0, 0.0, 9.782])
    volts = ideal.accelerometer.volts(force)
    np.testing.assert_allclose(
        ideal.accelerometer.conversion.specific_force(volts), force, atol=1e-14
    )
    assert ideal.accelerometer.noise == 0.0
    assert ideal.excitation == rig.board.excitation.value


def test_a_seed_gives_the_same_sensors_and_another_seed_others():
    assert draw(RIG, 7).terms == draw(RIG, 7).terms
    first, second = draw(RIG, 7).terms, draw(RIG, 8).terms
    # gravity and density have ranges, so every term is drawn
    assert all(first[key] != second[key] for key in first)


@RIGS
def test_every_term_scatters_as_its_standard_uncertainty(rig):
    terms = error_terms(rig)
    drawn = [draw(rig, seed).terms for seed in range(DRAWS)]
    for key, term in terms.items():
        values = np.array([terms_of_draw[key] for terms_of_draw in drawn])
        u = term.standard_uncertainty
        # A product of two rectangular factors has kurtosis 3.24: its deviation scatters 6 % wider.
        assert values.std() == pytest.approx(u, rel=1.1 * SPREAD), key
        assert abs(values.mean()) < 5 * u / math.sqrt(DRAWS), key
        assert u > 0.0, key


@RIGS
def test_amplitude_depth_and_ratio_scatter_as_the_budget_says(rig):
    speed, amplitude = 1.0, {"fish_pressure": 0.012, "depressor_pressure": 0.055}
    mean = {"fish_pressure": 1.6, "depressor_pressure": 1.2}
    rng = np.random.default_rng(3)
    amplitudes = {name: [] for name in SENSORS}
    means = {name: [] for name in SENSORS}
    for seed in range(DRAWS):
        sensors = draw(rig, seed)
        for name in SENSORS:
            heave = np.sin(PHASE)
            limit = getattr(rig.sensors, name).errors.surge_speed.value
            flow = speed + rng.uniform(-limit, limit) * heave
            depth = mean[name] + amplitude[name] * heave
            read = read_heave(getattr(sensors, name), rig, depth, flow)
            found = true_amplitude_and_mean(read)
            amplitudes[name].append(found[0])
            means[name].append(found[1])
    budgets = {
        name: depth_budget(rig, name, OperatingPoint(mean[name], amplitude[name], speed))
        for name in SENSORS
    }
    for name in SENSORS:
        gains = np.array(amplitudes[name]) / amplitude[name]
        # Second order (products of errors) is below u² ~ (3 %)², a thousandth of u.
        assert gains.std() == pytest.approx(budgets[name].gain, rel=SPREAD + 0.01)
        assert gains.mean() == pytest.approx(1.0, abs=5 * budgets[name].gain / math.sqrt(DRAWS))
        # The flow pressure's mean holds ½·surge² too: u_surge²/U² < 0.1 % of the flow term.
        assert np.std(means[name]) == pytest.approx(budgets[name].depth, rel=SPREAD + 0.01)
    ratios = np.array(amplitudes["fish_pressure"]) / np.array(amplitudes["depressor_pressure"])
    ratios /= amplitude["fish_pressure"] / amplitude["depressor_pressure"]
    u = ratio_relative_uncertainty(budgets["fish_pressure"], budgets["depressor_pressure"])
    assert ratios.std() == pytest.approx(u, rel=SPREAD + 0.01)
    # The binomial scatter of 1000 draws is 0.7 %; three of that.
    u95 = half_width(ratio_errors(budgets["fish_pressure"], budgets["depressor_pressure"]))
    assert np.mean(np.abs(ratios - 1.0) < u95) == pytest.approx(0.95, abs=3 * 0.007)


@RIGS
def test_inclination_scatters_as_the_budget_says(rig):
    attitude = (0.05, 0.15)  # roll, pitch
    force = rotation(*attitude, 0.0).T @ np.array([0.0, 0.0, rig.water.gravity.value])
    read = []
    for seed in range(DRAWS):
        sensor = draw(rig, seed).accelerometer
        felt = sensor.conversion.specific_force(sensor.volts(force))
        read.append((roll(felt), pitch(felt)))
    rolls, pitches = np.array(read).T
    budget = inclination_budget(rig, roll=attitude[0], pitch=attitude[1])
    # Errors of a data-sheet accelerometer reach 0.1 rad: second order is some percent of the first.
    assert pitches.std() == pytest.approx(budget.pitch, rel=SPREAD + 0.03)
    assert rolls.std() == pytest.approx(budget.roll, rel=SPREAD + 0.03)


def test_single_errors_do_what_their_names_say():
    def heave_with(terms):
        sensor = realise(BARE, terms, excitation=10.0, noise_scale=0.0).fish_pressure
        return read_heave(sensor, BARE, 1.0, speed=1.0)

    clean = heave_with({})
    assert clean == pytest.approx(1.0, rel=1e-13)
    for gain in ("span", "amplifier gain", "span over temperature", "hysteresis"):
        assert heave_with({f"fish_pressure/{gain}": 0.02}) == pytest.approx(1.02, rel=1e-12)
    assert heave_with({"shared/reference ratio": -0.01}) == pytest.approx(0.99, rel=1e-12)
    assert heave_with({"shared/water density": 0.001}) == pytest.approx(1.001, rel=1e-12)
    assert heave_with({"depressor_pressure/span": 0.02}) == clean
    # Zeroing takes the constant offset and leaves the drift.
    assert heave_with({"fish_pressure/offset": 0.001}) == pytest.approx(1.0, rel=1e-12)
    weight = 996.5 * 9.782
    drift = heave_with({"fish_pressure/offset over temperature": 1e-6})
    assert drift - 1.0 == pytest.approx(1e-6 * 50_000 / 0.040 / weight, rel=1e-9)
    flow = heave_with({"fish_pressure/flow pressure": 0.1})
    assert flow - 1.0 == pytest.approx(0.1 * 0.5 / 9.782, rel=1e-9)


def test_accelerometers_volts_are_shares_of_its_supply():
    force = [1.0, -2.0, 9.0]
    slipped = realise(RIG, {"accelerometer/supply ratio": 0.002}, 10.0, 0.0).accelerometer
    assert slipped.volts(force) == pytest.approx(
        1.002 * none(RIG).accelerometer.volts(force), rel=1e-14
    )


def test_linearity_error_is_greatest_in_the_middle_and_zero_at_the_ends():
    terms = {"fish_pressure/linearity": 0.0025}
    sensor = realise(BARE, terms, excitation=10.0, noise_scale=0.0).fish_pressure
    pressures = np.array([0.0, 12_500.0, 25_000.0, 50_000.0])
    error = sensor.conversion.pressure(sensor.volts(pressures)) - pressures
    assert error == pytest.approx([0.0, 0.75 * 125.0, 125.0, 0.0], abs=1e-9)


def test_true_excitation_scales_the_bridge():
    sensor = none(RIG).fish_pressure
    at_nominal = sensor.volts(20_000.0)
    assert sensor.volts(20_000.0, excitation=10.1) == pytest.approx(1.01 * at_nominal, rel=1e-15)


def test_excitation_is_drawn_from_its_range():
    rig = replaced(RIG, {"board.excitation": {"value": "10 V", "range": [9.8, 10.2]}})
    drawn = np.array([draw(rig, seed).excitation for seed in range(100)])
    assert 9.8 <= drawn.min() < 9.9 and 10.1 < drawn.max() <= 10.2
    assert draw(RIG, 1).excitation == 10.0


def test_noise_is_white_with_the_stated_deviation():
    rng = np.random.default_rng(5)
    volts = add_noise(np.zeros(20_000), 2.0e-6, rng)
    assert volts.std() == pytest.approx(2.0e-6, rel=5 / math.sqrt(2 * 20_000))
    neighbours = np.corrcoef(volts[1:], volts[:-1])[0, 1]
    assert abs(neighbours) < 5 / math.sqrt(20_000)
    assert draw(RIG, 1).fish_pressure.noise == RIG.sensors.fish_pressure.errors.noise.value


def test_unknown_error_terms_are_refused():
    with pytest.raises(KeyError, match="fish_pressure/spam"):
        realise(RIG, {"fish_pressure/spam": 1.0}, excitation=10.0, noise_scale=0.0)


@RIGS
def test_many_sensors_at_once_are_as_many_single_ones(rig):
    many = draw_many(rig, np.random.default_rng(6), 5)
    force = rotation(0.1, -0.2, 0.3).T @ np.array([0.0, 0.0, 9.782])
    pressures = pressure_from_depth(np.linspace(0.2, 1.8, 5), rig.water)
    axes = many.accelerometer.volts(force)
    bridges = many.fish_pressure.volts(pressures, speed=1.0)
    assert axes.shape == (5, 3) and bridges.shape == (5,)
    for k in range(5):
        terms = {key: float(values[k]) for key, values in many.terms.items()}
        one = realise(rig, terms, rig.board.excitation.value, 1.0)
        np.testing.assert_allclose(axes[k], one.accelerometer.volts(force), rtol=1e-14)
        assert bridges[k] == pytest.approx(one.fish_pressure.volts(pressures[k], 1.0), rel=1e-13)
