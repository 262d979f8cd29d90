# SPDX-License-Identifier: Apache-2.0
"""Board clock to host clock against a simulated truth."""

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.clock import BoardClock, SyncExchange, unwrap

NOMINAL_HZ = 2e6
REQUEST_WIRE_NS, RESPONSE_WIRE_NS = 240_000, 920_000


class Truth:
    """A board whose rate is off by `ppm`, drifting by `drift_ppm_per_s`, behind a slow line."""

    def __init__(self, ppm: float, seed: int, drift_ppm_per_s: float = 0.0, stall_s: float = 0.0):
        self.rate = 1.0 + 1e-6 * ppm
        self.drift = 1e-6 * drift_ppm_per_s
        self.stall_s = stall_s
        self.random = random.Random(seed)

    def ticks(self, t: float) -> int:
        """Board time at host time t, s; the board has run for a day already."""
        return int(NOMINAL_HZ * (86400.0 + self.rate * t + 0.5 * self.drift * t * t))

    def _wait(self) -> float:
        """50 us at best, 100 us more on average, and in 5 % of cases `stall_s`."""
        stalled = self.stall_s if self.random.random() < 0.05 else 0.0
        return 50e-6 + self.random.expovariate(1 / 100e-6) + stalled

    def exchange(self, t: float) -> SyncExchange:
        received = t + REQUEST_WIRE_NS / 1e9 + self._wait()
        sent = received + 30e-6
        back = sent + RESPONSE_WIRE_NS / 1e9 + self._wait()
        return SyncExchange(int(1e9 * t), int(1e9 * back), self.ticks(received), self.ticks(sent))


def run(truth: Truth, seconds: int, tries: int = 3) -> tuple[BoardClock, list[float]]:
    """Four quick rounds, then one a second; errors of the map in s, ten a second after 5 s."""
    clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
    errors = []
    for start in [0.0, 0.25, 0.5, 0.75, *range(1, seconds)]:
        clock.add_round(truth.exchange(start + 0.01 * k) for k in range(tries))
        if start >= 5:
            instants = [start + 0.1 * k for k in range(1, 11)]
            errors += [abs(clock.host_ns(truth.ticks(t)) / 1e9 - t) for t in instants]
    return clock, errors


@pytest.mark.parametrize("stall_s", [0.0, 20e-3])
@pytest.mark.parametrize("drift_ppm_per_s", [-50 / 60, 0.0, 50 / 60])
def test_stated_intervals_hold_the_truth(drift_ppm_per_s, stall_s):
    """At least 95 % of the errors, at the board's worst.

    And the statement is no idle one: two waits of 50 us are a bound of 50 us, the drift's is 83 us,
    and the line's own part a few tens.
    """
    within, stated = [], []
    for seed in range(5):
        truth = Truth(5000.0, seed, drift_ppm_per_s, stall_s)
        clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
        for start in [0.0, 0.25, 0.5, 0.75, *range(1, 60)]:
            clock.add_round(truth.exchange(start + 0.01 * k) for k in range(3))
            stated.append(clock.u95_s)
            for t in (start + 0.1 * k for k in range(1, 11)):
                error_s = clock.host_ns(truth.ticks(t)) / 1e9 - t
                # The slope is not known after one round
                if clock.points >= 4:
                    within.append(abs(error_s) <= stated[-1])
    assert sum(within) / len(within) >= 0.95
    assert 130e-6 < percentile(stated, 0.5) < 200e-6


def percentile(values: list[float], share: float) -> float:
    return sorted(values)[int(share * (len(values) - 1))]


@pytest.mark.parametrize("ppm", [-5000.0, 0.0, 5000.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rate_and_offset_are_found(ppm, seed):
    """The shortest of three tries has two waits of 50 us plus the least of three sums of two
    exponentials: its asymmetry is about 50 us rms, ten weighted rounds average it to about
    25 us, and extrapolation over a second adds little. 95 % below 100 us leaves a factor 2."""
    clock, errors = run(Truth(ppm, seed), 60)
    assert percentile(errors, 0.95) < 100e-6
    # 50 us rms over a base of about 10 s: 5 ppm rms; within four standard deviations
    assert clock.rate_ppm == pytest.approx(ppm, abs=20.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_follows_drift_through_stalls(seed):
    """50 ppm a minute costs 83 us at the young end; 20 ms stalls hit 5 % of all waits."""
    truth = Truth(5000.0, seed, drift_ppm_per_s=50 / 60, stall_s=20e-3)
    _, errors = run(truth, 120)
    assert percentile(errors, 0.95) < 200e-6
    assert max(errors) < 1e-3


def test_a_stalled_round_hardly_moves_the_line():
    truth = Truth(1000.0, 7)
    clock, _ = run(truth, 30)
    before = clock.host_ns(truth.ticks(31.0))
    late = truth.exchange(30.0)
    clock.add_round(
        [
            SyncExchange(
                late.sent_ns, late.received_ns + 500_000_000, late.board_received, late.board_sent
            )
        ]
    )
    # Weight of a 500 ms excess against one good round: (20 us / 144 ms)^2; shift below 1 us
    assert abs(clock.host_ns(truth.ticks(31.0)) - before) < 10_000


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_board_whose_time_stands_still_now_and_then(seed):
    """Emulated on a busy computer: in one round of four the board is 5 to 30 ms behind, without a
    sign of it in the round trip. All stamps stay within what good rounds alone would give."""
    truth = Truth(2000.0, seed)
    clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
    errors = []
    for start in [0.0, 0.15, 0.3, 0.45, *range(1, 60)]:
        tries = [truth.exchange(start + 0.01 * k) for k in range(3)]
        if truth.random.random() < 0.25 and start != 0.0:
            behind = round(NOMINAL_HZ * truth.random.uniform(5e-3, 30e-3))
            tries = [
                replace(
                    t, board_received=t.board_received - behind, board_sent=t.board_sent - behind
                )
                for t in tries
            ]
        clock.add_round(tries)
        if start >= 5:
            errors += [abs(clock.host_ns(truth.ticks(start + 0.5)) / 1e9 - start - 0.5)]
    assert max(errors) < 150e-6


def test_answer_faster_than_the_wire_is_not_used():
    truth = Truth(0.0, 1)
    clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
    slow = truth.exchange(0.0)
    fast = replace(slow, received_ns=slow.sent_ns + 300_000)
    clock.add_round([fast])
    assert clock.points == 0
    clock.add_round([fast, slow])
    assert clock.points == 1
    assert clock.round_trip_s > 0


def test_first_round_alone_is_good_at_once():
    """With one round the slope is nominal: right now exact, a second later off by the ppm."""
    truth = Truth(5000.0, 1)
    clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
    clock.add_round([truth.exchange(0.0)])
    assert clock.host_ns(truth.ticks(0.0)) == pytest.approx(0, abs=1_000_000)
    assert clock.host_ns(truth.ticks(1.0)) == pytest.approx(1e9, abs=6_000_000)


def test_wire_times_are_taken_off():
    """Without waits the map is exact although the answer is four times as long as the request."""
    clock = BoardClock(NOMINAL_HZ, REQUEST_WIRE_NS, RESPONSE_WIRE_NS)
    for second in range(3):
        sent = second * 10**9
        received = 2_000_000 * second + REQUEST_WIRE_NS // 500
        clock.add_round(
            [SyncExchange(sent, sent + REQUEST_WIRE_NS + RESPONSE_WIRE_NS, received, received)]
        )
    assert clock.host_ns(10_000_000) == pytest.approx(5e9, abs=500)
    assert clock.round_trip_s == 0.0


def test_inverse_map():
    clock, _ = run(Truth(-5000.0, 3), 10)
    assert clock.ticks(clock.host_ns(123_456_789_012)) == pytest.approx(123_456_789_012, abs=1)


@given(st.integers(0, 2**63), st.integers(-(2**31) + 1, 2**31 - 1))
def test_unwrap_32_bits(value, drift):
    assert unwrap(value & 0xFFFFFFFF, 32, value + drift) == value


@given(st.integers(0, 2**40), st.integers(-(2**15) + 1, 2**15 - 1))
def test_unwrap_16_bits(value, drift):
    assert unwrap(value & 0xFFFF, 16, value + drift) == value
