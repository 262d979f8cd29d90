# SPDX-License-Identifier: GPL-3.0-or-later
"""Codes and their timing: closed forms, the sequence that SYNC starts, the front end's poles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from probe_link import (
    ACCELEROMETER,
    AVSS,
    BIPOLAR,
    INTERNAL_REFERENCE,
    MILLISECOND,
    QUIET_VOLTS,
    SECOND,
    SETTLED_S,
)
from scipy.signal import lsim

TICK_S = 0.5e-6
# The probe polls RDY̅ about every 4 µs and reads the counter before the level: 10 µs covers
# both, and the few cycles between the SYNC edge and the tick noted for it.
POLLING_S = 10e-6

BRIDGE = (0, 1, BIPOLAR)  # AIN0 − AIN1, reference REFIN1
EXCITATION = (7, AVSS, INTERNAL_REFERENCE)

GAIN_BRIDGE = 35.96
POLE_BRIDGE_HZ = 40.7


def bipolar_code(ratio: float) -> float:
    return min(max(2**23 * (ratio + 1), 0), 2**24 - 1)


def unipolar_code(ratio: float) -> float:
    return min(max(2**24 * ratio, 0), 2**24 - 1)


def settle(probe, volts) -> None:
    """Constant inputs for long enough that every pole has forgotten what was before."""
    start = probe.board.now_ns
    probe.push(start + MILLISECOND, volts)
    probe.push(start + 10 * SECOND, volts)


@pytest.mark.parametrize("seed", range(4))
def test_codes_follow_the_closed_form(open_probe, seed):
    random = np.random.default_rng(seed)
    bridge = random.uniform(-0.003, 0.045)  # above the amplifier's guaranteed swing
    accelerometer = random.uniform(0.0, 2.49)
    excitation = random.uniform(9.0, 12.0)
    probe = open_probe()
    settle(probe, (bridge, 0.0, accelerometer, 1.65, 2.31, excitation))
    probe.set_up_scan(BRIDGE, ACCELEROMETER, EXCITATION)
    _, conversions = probe.convert(3)
    assert all(c.crc_good for c in conversions)
    assert [c.status & 0x0F for c in conversions] == [0, 1, 2]
    expected = [
        bipolar_code(GAIN_BRIDGE * bridge / (excitation / 4)),
        unipolar_code(accelerometer / 2.5),
        unipolar_code(0.2 * excitation / 2.5),
    ]
    # Rounding to the nearest code is half a code; rounding in the arithmetic another trifle.
    for conversion, code in zip(conversions, expected, strict=True):
        assert abs(conversion.code - code) <= 0.51


def test_codes_clip_at_both_ends(open_probe):
    probe = open_probe()
    settle(probe, (0.0, 0.0, 3.0, -0.04, 2.31, 10.0))
    probe.set_up_scan((5, AVSS, INTERNAL_REFERENCE), ACCELEROMETER)
    _, (low, high) = probe.convert(2)
    assert (low.code, high.code) == (0, 0xFFFFFF)
    assert probe.board.counters()["conversions_out_of_range"] == 0


AIN_BUFFERS = 0b11 << 5
REF_BUFP, REF_BUFM = 1 << 8, 1 << 7


def out_of_range(probe, volts, config, excitation=10.0, pins=(4, AVSS)):
    """The code of one conversion of accel_x or other pins, and whether it was out of range."""
    settle(probe, (0.0, 0.0, volts, 1.65, 2.31, excitation))
    probe.set_up_scan((*pins, config))
    before = probe.board.counters()["conversions_out_of_range"]
    _, (conversion,) = probe.convert(1)
    return conversion.code, probe.board.counters()["conversions_out_of_range"] > before


@pytest.mark.parametrize(
    ("volts", "config", "seen", "out"),
    [
        (0.02, INTERNAL_REFERENCE, 0.02, False),
        (0.02, INTERNAL_REFERENCE | 1 << 6, 0.1, True),  # below a buffer's range
        (0.02, INTERNAL_REFERENCE | 1 << 6 | 1, 0.02, False),  # with a gain: rail to rail
        (1.65, INTERNAL_REFERENCE | AIN_BUFFERS, 1.55, True),  # the other side is AVSS
        (-0.3, INTERNAL_REFERENCE | BIPOLAR, -0.05, True),
        (3.28, BIPOLAR | 3 << 3, 3.28, False),  # against AVDD
        (3.28, BIPOLAR | 3 << 3 | 1 << 6, 3.2, True),
    ],
)
def test_inputs_beyond_their_limits_are_not_seen(open_probe, volts, config, seen, out):
    code, was_out = out_of_range(open_probe(), volts, config)
    reference = 3.3 if config >> 3 & 3 == 3 else 2.5
    ratio = seen * (1 << (config & 7)) / reference
    expected = bipolar_code(ratio) if config & BIPOLAR else unipolar_code(ratio)
    assert abs(code - expected) <= 0.51
    assert was_out == out


@pytest.mark.parametrize(
    ("buffers", "excitation", "reference", "out"),
    [
        (REF_BUFP, 10.0, 2.5, False),
        (REF_BUFP | REF_BUFM, 10.0, 2.4, True),  # REFIN1− is AVSS, a buffer stops 0.1 V above
        (0, 13.0, 3.25, False),
        (REF_BUFP, 13.0, 3.2, True),
        (REF_BUFP, 4.0, 1.0, False),
    ],
)
def test_references_beyond_their_limits_are_not_seen(
    open_probe, buffers, excitation, reference, out
):
    code, was_out = out_of_range(open_probe(), 0.5, BIPOLAR | buffers, excitation)
    assert abs(code - bipolar_code(0.5 / reference)) <= 0.51
    assert was_out == out


def test_a_reference_below_the_least_is_no_reference(open_probe):
    """Half of it: as much beside the truth as half of the model's example for none at all."""
    code, was_out = out_of_range(open_probe(), 0.1, BIPOLAR | REF_BUFP, excitation=2.0)
    assert was_out
    assert abs(code - bipolar_code(0.1 / (0.5 * 0.95))) <= 0.51


@pytest.mark.parametrize("bridge", [-0.05, -0.0033])
def test_amplifier_ends_at_its_guaranteed_swing(open_probe, bridge):
    probe = open_probe()
    settle(probe, (bridge, 0.0, 1.65, 1.65, 2.31, 10.0))
    probe.set_up_scan(BRIDGE)
    _, (conversion,) = probe.convert(1)
    assert conversion.code == pytest.approx(bipolar_code((1.4 - 1.516) / 2.5), abs=0.51)


def test_internal_reference_must_be_switched_on(open_probe):
    probe = open_probe()
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(ACCELEROMETER)
    probe.write((0x01, 2), 1 << 10 | 2 << 6)  # ADC_CONTROL without REF_EN
    _, (conversion,) = probe.convert(1)
    assert conversion.code == 0xFFFFFF  # divided by no reference


def test_housekeeping_sources(open_probe):
    probe = open_probe()
    probe.set_up_scan(
        (16, AVSS, BIPOLAR | INTERNAL_REFERENCE), (20, 21, BIPOLAR | INTERNAL_REFERENCE)
    )
    _, (temperature, supply) = probe.convert(2)
    # The data sheet's formula at 25 °C, and a sixth of 3.3 V; half a code by rounding.
    assert (temperature.code - 2**23) / 13584 - 272.5 == pytest.approx(25.0, abs=0.5 / 13584)
    assert abs(supply.code - bipolar_code(3.3 / 6 / 2.5)) <= 0.51


@pytest.mark.parametrize("ppm", [0.0, 50_000.0, -50_000.0])
def test_sync_starts_a_sequence_of_settled_conversions(open_probe, ppm):
    probe = open_probe(adc_clock_ppm=ppm)
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(BRIDGE, ACCELEROMETER, EXCITATION)
    start, conversions = probe.convert(7)
    period = SETTLED_S / (1 + ppm * 1e-6)
    assert [c.status & 0x0F for c in conversions] == [0, 1, 2, 0, 1, 2, 0]
    for i, conversion in enumerate(conversions):
        assert (conversion.ticks - start) * TICK_S == pytest.approx((i + 1) * period, abs=POLLING_S)


@pytest.mark.parametrize("goes_on", [False, True])
def test_sync_begins_the_sequence_anew_or_lets_it_go_on(open_probe, goes_on):
    probe = open_probe(sync_goes_on=goes_on)
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(BRIDGE, ACCELEROMETER, EXCITATION)
    channels = [[c.status & 0x0F for c in probe.convert(4)[1]] for _ in range(3)]
    for first, *rest in channels:
        assert rest == [(first + i) % 3 for i in (1, 2, 3)]
    # How far the sequence comes before the probe holds it is the probe's; it is no whole round.
    assert ({first for first, *_ in channels} != {0}) == goes_on


def test_ready_stays_high_while_sync_is_low_and_after_the_read(open_probe):
    probe = open_probe()
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(BRIDGE)
    probe.tell(b"c\x00")
    probe.board.run_until(probe.board.now_ns + 20 * MILLISECOND)
    assert probe.ask(b"v", 1) == b"\x01"
    probe.tell(b"y\x01")
    probe.board.run_until(probe.board.now_ns + 20 * MILLISECOND)
    assert probe.ask(b"v", 1) == b"\x00"
    probe.tell(b"c\x01")
    assert probe.ask(b"v", 1) == b"\x01"  # CS high: pulled up
    probe.tell(b"y\x00")
    probe.tell(b"c\x00")
    assert probe.ask(b"v", 1) == b"\x01"


def test_an_unread_result_is_replaced_with_a_pulse_on_ready(open_probe):
    probe = open_probe()
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(BRIDGE, ACCELEROMETER)
    probe.tell(b"c\x00")
    (before,) = np.frombuffer(probe.ask(b"i", 2), "<u2")
    conversions_before = probe.board.counters()["conversions"]
    probe.tell(b"y\x01")
    probe.board.run_until(probe.board.now_ns + 20 * MILLISECOND)
    probe.tell(b"y\x00")
    (after,) = np.frombuffer(probe.ask(b"i", 2), "<u2")
    # Each result gives a falling edge, read or not.
    conversions = probe.board.counters()["conversions"] - conversions_before
    assert conversions >= 18
    assert after - before == conversions


def ticks_at_power_on(probe) -> float:
    """Board ticks at true time 0, by an encoder edge at a known instant."""
    # 4096 counts a revolution: angle crosses count 1 halfway between these two samples.
    count = 2 * math.pi / 4096
    start = probe.board.now_ns + MILLISECOND
    probe.push(start, crank=0.0)
    probe.push(start + 2 * MILLISECOND, crank=2 * count * (1 - 1e-9))
    probe.board.run_until(start + 3 * MILLISECOND)
    edge_s = start * 1e-9 + MILLISECOND * 1e-9
    return probe.last_crank_edge() - edge_s / TICK_S


def test_conversion_has_the_value_in_the_middle_of_its_interval(open_probe):
    probe = open_probe()
    zero = ticks_at_power_on(probe)
    # A ramp that has outlasted the pole lags it by exactly its time constant.
    slope = 1.0  # V/s
    start = probe.board.now_ns + MILLISECOND
    volts = [(0.0, 0.0, 0.5 + slope * t, 1.65, 2.31, 10.0) for t in (0.0, 1.9)]
    probe.push(start, volts[0], crank=0.002)
    probe.push(start + 1_900 * MILLISECOND, volts[1], crank=0.002)
    probe.set_up_scan(ACCELEROMETER, EXCITATION)
    probe.board.run_until(start + 1_000 * MILLISECOND)  # 90 time constants of 11 ms
    rise, conversions = probe.convert(5)
    tau = 1 / (2 * math.pi * 14.47)
    for i in (0, 2, 4):
        middle_s = (rise - zero) * TICK_S + (i + 0.5) * SETTLED_S
        expected = 0.5 + slope * (middle_s - start * 1e-9 - tau)
        # 10 µs of interrupt latency and of the instant noted for SYNC, at 1 V/s.
        assert conversions[i].code / 2**24 * 2.5 == pytest.approx(expected, abs=slope * 10e-6)


def test_pole_is_exact_between_sparse_frames(open_probe):
    probe = open_probe()
    zero = ticks_at_power_on(probe)
    random = np.random.default_rng(7)
    start = probe.board.now_ns + MILLISECOND
    times = start + 10 * MILLISECOND * np.arange(60)  # 10 ms apart, 2.5 time constants
    # Half of it below −3.2 mV, where the amplifier's output ends at 1.4 V, and through that limit.
    bridge = random.uniform(-0.05, 0.045, times.size)
    lowest = (1.4 - 1.516) / GAIN_BRIDGE
    for time, volts in zip(times, bridge, strict=True):
        probe.push(int(time), (volts, 0.0, 1.65, 1.65, 2.31, 10.0), crank=0.002)
    probe.set_up_scan(BRIDGE, EXCITATION)
    probe.board.run_until(int(times[20]))
    for _ in range(20):
        rise, conversions = probe.convert(1)
        middle_s = (rise - zero) * TICK_S + 0.5 * SETTLED_S
        # An independent solution: SciPy's, for an input that is linear between the instants given.
        grid = np.sort(np.append(times * 1e-9, middle_s))
        tau = 1 / (2 * math.pi * POLE_BRIDGE_HZ)
        u = np.interp(grid, times * 1e-9, bridge)
        fine = np.linspace(grid[0], middle_s, 20_001)
        u = np.maximum(np.interp(fine, grid, u), lowest)
        y = lsim(([1.0], [tau, 1.0]), u, fine, X0=[u[0] * tau])[1]
        measured = (conversions[0].code / 2**23 - 1) * 2.5 / GAIN_BRIDGE
        # The output moves by at most 0.08 V/τ = 20 V/s: 10 µs of doubt about the instant are
        # 0.2 mV; the grid of 0.03 ms adds a tenth of that.
        assert measured == pytest.approx(y[-1], abs=0.3e-3)


def test_noise_is_white_and_has_its_sigma(open_probe):
    sigma = 1e-3
    probe = open_probe(noise_volts=sigma, seed=5)
    settle(probe, QUIET_VOLTS)
    probe.set_up_scan(ACCELEROMETER)
    volts = []
    for _ in range(40):
        volts += [c.code / 2**24 * 2.5 for c in probe.convert(16)[1]]
    n = len(volts)
    deviations = np.array(volts) - 1.65
    # Four standard errors each: of the mean, of the standard deviation, of the lag-1 correlation.
    assert abs(deviations.mean()) < 4 * sigma / math.sqrt(n)
    assert abs(deviations.std() / sigma - 1) < 4 / math.sqrt(2 * n)
    assert abs(np.corrcoef(deviations[1:], deviations[:-1])[0, 1]) < 4 / math.sqrt(n)
