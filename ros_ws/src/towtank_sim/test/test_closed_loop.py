# SPDX-License-Identifier: Apache-2.0
"""Plant and twin of the same rig, joined by nothing but ideal encoders."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from towtank_rig.conversion import depth_from_pressure, pressure_conversion
from towtank_sim.drive import trial_commands
from towtank_sim.offline import (
    bench_frames,
    encoder_readings,
    simulate_plant,
    simulate_twin,
)
from towtank_sim.protocol_records import CHANNELS
from towtank_sim.smoother import HALF_WIDTH
from towtank_sim.twin import Twin
from towtank_uncertainty import sensor_errors

REST, STEADY = 1.0, 40.0


@pytest.fixture(scope="module")
def history(nit_calicut):
    commands = trial_commands(nit_calicut, REST, STEADY)
    ramp = nit_calicut.run.ramp_time.value
    return simulate_plant(nit_calicut, commands, REST + ramp + STEADY)


@pytest.fixture(scope="module")
def readings(history, nit_calicut):
    return encoder_readings(history, nit_calicut)


@pytest.fixture(scope="module")
def twin(history, readings, nit_calicut):
    return simulate_twin(nit_calicut, history.time, *readings)


def common(history, twin):
    """Index of the plant's states at the twin's instants."""
    return np.searchsorted(history.time, twin.time - 1e-6)


def harmonic(time, values, omega, end):
    """Complex first harmonic over the last eight whole periods, linear drift removed."""
    period = 2 * math.pi / omega
    window = (time >= end - 8 * period) & (time < end)
    t = time[window]
    columns = [np.ones_like(t), t, np.cos(omega * t), np.sin(omega * t)]
    fit, *_ = np.linalg.lstsq(np.stack(columns, axis=-1), values[window], rcond=None)
    return complex(fit[2], -fit[3])


def test_the_start_with_its_slack_line_ends_in_a_steady_tow(history):
    """The fish overtakes its line while the carriage gets going; no blow may grow from that."""
    weight = history.top_tension[0]
    assert history.top_tension.max() < 2.0 * weight
    late = history.time > REST + 16.0
    # Steady: depressor's weight, lines and drag, and the crank's inertia forces of some newtons.
    assert history.top_tension[late].max() < 1.2 * weight
    assert history.top_tension[late].min() > 0.8 * weight
    pitch = 2.0 * np.arctan2(history.fish_quaternion[late, 2], history.fish_quaternion[late, 0])
    assert np.abs(pitch).max() < math.radians(5.0)


def test_twin_states_are_at_the_samples(history, twin):
    assert len(twin.time) == len(history.time) - 2 * HALF_WIDTH
    np.testing.assert_allclose(
        twin.time, history.time[HALF_WIDTH : len(history.time) - HALF_WIDTH], atol=1e-9
    )


def test_twin_heaves_as_the_plant_does(history, twin, nit_calicut):
    """To 1 % in amplitude and 2 degrees in phase, at the depressor and at the fish's port."""
    omega = nit_calicut.run.crank_rate.value
    end = twin.time[-1]
    place = nit_calicut.sensors.fish_pressure.position.value
    for ours, theirs in (
        (twin.depressor_position, history.depressor_position),
        (twin.fish_place(place), history.fish_place(place)),
    ):
        measured = harmonic(twin.time, ours[:, 2], omega, end)
        true = harmonic(history.time, theirs[:, 2], omega, end)
        # The fish's heave is about half a millimetre once the slow swing of the start is over.
        assert abs(true) > 2e-4
        assert abs(measured / true) == pytest.approx(1.0, abs=0.01)
        assert abs(math.degrees(cmath.phase(measured / true))) < 2.0


def test_encoder_counts_do_not_shake_the_lines(history, twin):
    """A count's step of 0.12 mm, taken at face value, would be 20 N in 1.2 m of wire rope."""
    at = common(history, twin)
    noise = twin.top_tension - history.top_tension[at]
    steady = twin.time > REST + 10.0
    print(f"tension noise of the twin: {noise[steady].std():.3f} N")
    assert noise[steady].std() < 1.0
    assert history.top_tension[at][steady].std() > 1.0


def test_lost_samples_are_bridged(history, readings, twin, nit_calicut):
    """One sample in ten lost, and a gap of 0.4 s: the tow point is interpolated."""
    generator = np.random.default_rng(2)
    keep = generator.random(len(history.time)) > 0.1
    keep[(history.time > 15.0) & (history.time < 15.4)] = False
    thinned = simulate_twin(nit_calicut, history.time[keep], readings[0][keep], readings[1][keep])
    both = np.isin(np.round(twin.time * 100), np.round(thinned.time * 100))
    difference = twin.depressor_position[both] - thinned.depressor_position
    # The smoothed tow point is uncertain by about a tenth of a count, 0.02 mm, either way.
    assert np.abs(difference).max() < 2e-4


def test_a_long_gap_starts_anew_from_a_steady_tow(history, readings, nit_calicut):
    twin = Twin(nit_calicut, segments=20, step=0.005)
    samples = np.column_stack((history.time, *readings)).tolist()
    first = [s for s in samples if s[0] < 12.0]
    second = [s for s in samples if 12.6 < s[0] < 14.0]

    def follow(rows):
        states = [(twin.follow(round(t * 1e9), a, x), twin.tow) for t, a, x in rows]
        return [state for state, _ in states if state is not None]

    assert len(follow(first)) > 1000
    assert twin.interruptions == 0
    states = follow(second)
    assert twin.interruptions == 1
    assert twin.interruption.startswith("no samples of crank and carriage for 0.610 s")
    assert twin.running
    # Not before the window is full again, nor before the crank stands at a dead centre: at
    # 0.5 Hz that is at most a second.
    assert states[0] >= round((second[0][0] + HALF_WIDTH * 0.01) * 1e9) - 1
    assert states[0] < round((second[0][0] + HALF_WIDTH * 0.01 + 1.0) * 1e9)
    assert twin.tow.depressor().velocity[0] == pytest.approx(1.0, abs=0.1)


def test_time_that_goes_back_starts_anew(history, readings, nit_calicut):
    twin = Twin(nit_calicut, segments=20, step=0.005)
    rows = np.column_stack((history.time, *readings)).tolist()[:60]
    for t, a, x in rows + rows:
        twin.follow(round(t * 1e9), a, x)
    assert twin.interruptions == 1
    assert twin.interruption.startswith("time went back by 0.590 s")
    assert twin.running


def test_positions_that_were_lost_start_anew(history, readings, nit_calicut):
    """Of one unknown sample too: what comes after it counts from another origin, here 3 m ahead."""
    twin = Twin(nit_calicut, segments=20, step=0.005)
    rows = np.column_stack((history.time, *readings)).tolist()[:200]
    for number, (t, a, x) in enumerate(rows):
        x = math.nan if number in (100, 101) else x + 3.0 * (number > 101)
        state = twin.follow(round(t * 1e9), a, x)
        if 100 <= number < 102 + 2 * HALF_WIDTH:
            assert state is None
    assert twin.interruptions == 1
    assert twin.interruption == "the positions of crank and carriage are not known, at 1.000 s"
    assert twin.running
    assert twin.tow.depressor().position[0] == pytest.approx(3.0, abs=1.0)


def test_doubled_samples_count_as_lost(history, readings, nit_calicut):
    twin = Twin(nit_calicut, segments=20, step=0.005)
    rows = np.column_stack((history.time, *readings)).tolist()[:100]
    states = []
    for t, a, x in rows:
        stamp = round(t * 1e9)
        states += [twin.follow(stamp, a, x), twin.follow(stamp, a, x)]
    states = [state for state in states if state is not None]
    assert states == [round(t * 1e9) for t, _, _ in rows[HALF_WIDTH:-HALF_WIDTH]]


# --------------------------------------------------------------------------- offline chain


def test_offline_frames_hold_the_plants_depths(history, nit_calicut):
    frames = bench_frames(history, nit_calicut, sensor_errors.none(nit_calicut), start_ns=10**9)
    assert len(frames) == len(history.time)
    volts = [np.frombuffer(frame, dtype="<f8", count=len(CHANNELS), offset=16) for frame in frames]
    times = [int.from_bytes(frame[8:16], "little", signed=True) for frame in frames]
    np.testing.assert_allclose(times, 1e9 + history.time * 1e9, atol=1.0)
    conversion = pressure_conversion(nit_calicut, "fish_pressure")
    pressure = conversion.pressure(np.array(volts)[:, CHANNELS.index("fish_pressure")])
    place = nit_calicut.sensors.fish_pressure.position.value
    np.testing.assert_allclose(
        depth_from_pressure(pressure, nit_calicut.water),
        -history.fish_place(place)[:, 2],
        atol=1e-9,
    )


def test_offline_runs_are_the_same_each_time(nit_calicut):
    commands = trial_commands(nit_calicut, 0.2, 1.0)
    one, other = (simulate_plant(nit_calicut, commands, 3.0) for _ in range(2))
    np.testing.assert_array_equal(one.fish_position, other.fish_position)


def test_output_rate_thins_the_same_run(nit_calicut):
    commands = trial_commands(nit_calicut, 0.2, 1.0)
    fine = simulate_plant(nit_calicut, commands, 1.0)
    coarse = simulate_plant(nit_calicut, commands, 1.0, output_rate=20.0)
    np.testing.assert_array_equal(coarse.fish_position, fine.fish_position[::5])
    with pytest.raises(ValueError, match="30 Hz"):
        simulate_plant(nit_calicut, commands, 1.0, output_rate=30.0)
