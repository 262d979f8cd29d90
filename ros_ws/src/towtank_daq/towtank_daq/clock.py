# SPDX-License-Identifier: Apache-2.0
"""The board's clock mapped to the host's.

Why this works
--------------
The board stamps each scan by its own timer, whose edges are exact but whose rate is a cheap
resonator's: off by up to 5000 ppm, drifting with temperature. The host's CLOCK_MONOTONIC is the
master, but the host sees the board only through a serial line, a driver and a scheduler, which
delay by fractions of a millisecond to many milliseconds. So the arrival of a scan says little of
when it was taken, while the board's own stamp says it to a tick, in an unknown clock. What is left
is to learn the line `host = offset + slope * ticks`.

About once a second the host asks the board for its time. In such an exchange the host notes when
it sent (s) and when the answer had come (r), the board when it had received the request (R) and
when it sent the answer (S). Causality gives hard bounds: s <= R and S <= r, so the exchange places
the middle of (R, S) at the middle of (s, r) with an error of at most half of the round trip
(r - s) - (S - R). The time that the bytes need on the wire is known and taken off first; what is
left are waits, which are never negative, and mostly short with a long tail. Therefore of several
tries the one with the shortest round trip counts, and a round with an unusually long one (the host
was held up) gets little weight, by its own bound: a uniform error of +-half of the excess over the
shortest round trip known has a standard deviation of excess / sqrt(12).

Through these points goes a weighted regression whose weights also decay with age, so that the line
follows the resonator's drift: with a decay time T a drift of d s/s^2 leaves an error of d T^2 at
the line's young end (50 ppm a minute and 10 s: 83 us), while some T points average out the jitter.
Until enough points are there, a prior holds the slope near its nominal value, with the resonator's
tolerance as its standard deviation.

A board that is emulated on a busy computer has one more fault: its time stands still while its
process is held up, and then catches up in a hurry. An answer that comes faster than the wire could
carry it gives such a board away and is not used. What slips through makes the board seem late,
never early: so the regression starts below all points, and gives one that lies s standard
deviations above the line the weight 1 / (1 + (s/4)^2) (Cauchy's), but one below it full weight.

The map's stated 95 % interval has three parts: that of the line at its young end, from the points'
weights; the wait that is left in the shortest round trip, which may lie all on one side of the
exchange (half of it, as a bound); and a drift that the line follows with a delay, as fast as a
resonator that warms up may have it (50 ppm a minute, as a bound). The bounded parts stay the same
for as long as a run lasts, so they are added whole: the interval holds also where they are worst.

The same idea (shortest round trip, decaying regression) carries Klipper's clock synchronisation
and, without the regression, Cristian's algorithm (Distributed Computing 3, 146-158, 1989).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from towtank_rig.quantity import NORMAL_95

_DECAY_S = 10.0
_POINTS = 60  # at one a second the oldest has decayed to exp(-6)
SLOPE_TOLERANCE = 5e-3
"""Of the board's resonator; taken as the standard deviation of its relative error."""

_LARGEST_DRIFT = 50e-6 / 60.0  # s/s^2
_FLOOR_S = 20e-6  # jitter of the best round trips: scheduling and interrupts on both sides
_ROBUST_SIGMAS = 4.0
_ROBUST_STEPS = 15  # more than it takes to settle below a microsecond


def unwrap(value: int, bits: int, near: int) -> int:
    """The number closest to `near` whose lowest `bits` bits are those of `value`."""
    span = 1 << bits
    return near + (value - near + span // 2) % span - span // 2


@dataclass(frozen=True, slots=True)
class SyncExchange:
    """One question for the board's time. Host times in ns, board times in unwrapped ticks."""

    sent_ns: int
    """Host, just before the request was written."""
    received_ns: int
    """Host, just after the last byte of the answer was read."""
    board_received: int
    board_sent: int


@dataclass(frozen=True, slots=True)
class _Point:
    """A place where the two clocks met."""

    host_ns: int
    ticks: int
    round_trip_s: float


class BoardClock:
    """Estimates and applies the line from board ticks to host time.

    nominal_hz: ticks a second by the board's data sheet.
    request_wire_ns, response_wire_ns: time that the request's and the answer's bytes spend on the
    serial line, ns.
    """

    def __init__(self, nominal_hz: float, request_wire_ns: int = 0, response_wire_ns: int = 0):
        self._nominal_hz = nominal_hz
        self._request_wire_ns = request_wire_ns
        self._response_wire_ns = response_wire_ns
        self._points: deque[_Point] = deque(maxlen=_POINTS)
        self._host_ns = 0
        self._ticks = 0
        self._ns_per_tick = 1e9 / self._nominal_hz
        self.residual_s = math.nan
        """Weighted RMS distance of the points from the line, s."""
        self.u95_s = math.nan
        """Half-width of the 95 % interval of a host time that host_ns() gives in the run, s."""

    @property
    def points(self) -> int:
        """Rounds that the line rests on."""
        return len(self._points)

    @property
    def rate_ppm(self) -> float:
        """How much faster than nominal the board's clock runs, parts per million."""
        return 1e6 * (1e9 / self._nominal_hz / self._ns_per_tick - 1.0)

    @property
    def round_trip_s(self) -> float:
        """Round trip of the last round less the bytes' time on the wire, s."""
        return self._points[-1].round_trip_s if self._points else math.nan

    def add_round(self, tries: Iterable[SyncExchange]) -> None:
        """Learn from one round of exchanges that were made shortly after each other.

        A round of exchanges that are all too fast to be true teaches nothing.
        """
        possible = [p for p in map(self._point, tries) if p.round_trip_s > -_FLOOR_S]
        if possible:
            self._points.append(min(possible, key=lambda p: p.round_trip_s))
            self._fit()

    def host_ns(self, ticks: int) -> int:
        """The host's time at a board time, ns of CLOCK_MONOTONIC."""
        return self._host_ns + round((ticks - self._ticks) * self._ns_per_tick)

    def ticks(self, host_ns: int) -> int:
        """The board's time at a host time, in unwrapped ticks."""
        return self._ticks + round((host_ns - self._host_ns) / self._ns_per_tick)

    def _point(self, exchange: SyncExchange) -> _Point:
        start = exchange.sent_ns + self._request_wire_ns
        end = exchange.received_ns - self._response_wire_ns
        board_s = (exchange.board_sent - exchange.board_received) / self._nominal_hz
        return _Point(
            host_ns=(start + end) // 2,
            ticks=(exchange.board_received + exchange.board_sent) // 2,
            round_trip_s=(end - start) / 1e9 - board_s,
        )

    def _fit(self) -> None:
        # Everything relative to the youngest point, in seconds, so that floats keep nanoseconds:
        # x is board time at the nominal rate, y by how much the host's clock has gained on it.
        young = self._points[-1]
        shortest = min(p.round_trip_s for p in self._points)
        rows = []
        for p in self._points:
            x = (p.ticks - young.ticks) / self._nominal_hz
            y = (p.host_ns - young.host_ns) / 1e9 - x
            variance = _FLOOR_S**2 + (p.round_trip_s - shortest) ** 2 / 12.0
            rows.append((x, y, variance, math.exp(x / _DECAY_S) / variance))
        slope = self._ns_per_tick * self._nominal_hz / 1e9 - 1.0
        offset = min(y - slope * x for x, y, *_ in rows)
        for _ in range(_ROBUST_STEPS):
            offset, slope, line_variance = _line(
                (x, y, w * _trust(y - offset - slope * x, variance)) for x, y, variance, w in rows
            )
        self._ticks = young.ticks
        self._host_ns = young.host_ns + round(1e9 * offset)
        self._ns_per_tick = 1e9 * (1.0 + slope) / self._nominal_hz
        one_sided_s = max(shortest, 0.0) / 2.0
        followed_late_s = _LARGEST_DRIFT * _DECAY_S**2
        self.u95_s = NORMAL_95 * math.sqrt(line_variance) + one_sided_s + followed_late_s
        squares = sum(w * (y - offset - slope * x) ** 2 for x, y, _, w in rows)
        self.residual_s = math.sqrt(squares / sum(w for *_, w in rows))


def _line(rows: Iterable[tuple[float, float, float]]) -> tuple[float, float, float]:
    """Offset, slope and the offset's variance of the weighted least-squares line through (x, y,
    weight), with the prior on the slope."""
    s0 = s1 = t0 = t1 = 0.0
    s2 = SLOPE_TOLERANCE**-2
    for x, y, w in rows:
        s0 += w
        s1 += w * x
        s2 += w * x * x
        t0 += w * y
        t1 += w * x * y
    det = s0 * s2 - s1 * s1
    return (t0 * s2 - t1 * s1) / det, (t1 * s0 - t0 * s1) / det, s2 / det


def _trust(late_s: float, variance: float) -> float:
    """Factor of a point's weight by how late it puts the board against the line."""
    if late_s <= 0.0:
        return 1.0
    return 1.0 / (1.0 + late_s * late_s / (_ROBUST_SIGMAS**2 * variance))
