# SPDX-License-Identifier: Apache-2.0
"""Shaft position and velocity from quadrature counts.

The position is the count itself, times its step: no filter, no delay, off by at most one step.

The velocity comes from a parabola laid by least squares through the positions of the last
`window_s` seconds, by its slope at the youngest one. A parabola's end slope has no delay for
constant acceleration; a jerk j leaves an error of j T^2 / 10. A crank and a carriage turn evenly,
so little else is asked of it. Quantisation to a step q passes into it as noise of standard
deviation (q / sqrt(12)) sqrt(192 / n) / T, with n positions in the window: 4.4 q a second at
100 Hz and T = 0.2 s. Real instants are used, so lost scans and uneven stamps do no harm.

A velocity is known once the positions span half the window; until then, at the start and after a
gap, it is NaN. With half a window the noise is 2.8 times as strong, and with less it soon is no
measurement.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder, crank_zero

WINDOW_S = 0.2

_ACCELERATION_WINDOW_S = 0.5
"""Two speeds this far apart make an acceleration; noise of 0.5 mm/s in each makes 1.5 mm/s^2."""


class VelocityFilter:
    """Slope at the youngest of the positions in a sliding window of time."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_ns = round(1e9 * window_s)
        self._samples: deque[tuple[int, float]] = deque()

    def update(self, stamp_ns: int, position: float) -> float:
        """Velocity after one more position, position units per second; stamps must increase.

        NaN as long as the positions span less than half the window.
        """
        samples = self._samples
        samples.append((stamp_ns, position))
        while stamp_ns - samples[0][0] > self._window_ns:
            samples.popleft()
        if stamp_ns - samples[0][0] < self._window_ns / 2:
            return math.nan
        return self._end_slope()

    def reset(self) -> None:
        """Forget all positions: those that come have no known relation to them."""
        self._samples.clear()

    def _end_slope(self) -> float:
        """Slope at the end of the least-squares parabola; the chord's with only two samples."""
        count = len(self._samples)
        if count < 3:
            return self._chord()
        # In windows of time from the youngest position on, where the slope is the linear term: sums
        # of powers of time, and of those with the position, in one pass, for it runs at each scan
        last_ns, last = self._samples[-1]
        per_ns = 1.0 / self._window_ns
        t1 = t2 = t3 = t4 = p0 = p1 = p2 = 0.0
        for stamp, position in self._samples:
            t = (stamp - last_ns) * per_ns
            tt = t * t
            p = position - last
            t1 += t
            t2 += tt
            t3 += tt * t
            t4 += tt * tt
            p0 += p
            p1 += t * p
            p2 += tt * p
        minor = t1 * t4 - t2 * t3
        determinant = count * (t2 * t4 - t3 * t3) - t1 * minor + t2 * (t1 * t3 - t2 * t2)
        slope = count * (p1 * t4 - p2 * t3) - p0 * minor + t2 * (t1 * p2 - t2 * p1)
        return slope / determinant * per_ns * 1e9

    def _chord(self) -> float:
        (start_ns, start), (end_ns, end) = self._samples
        return (end - start) / ((end_ns - start_ns) * 1e-9)


class Origin(NamedTuple):
    """The count at a shaft's origin, None where that is lost, and the epoch that it belongs to,
    None before the first count."""

    counts: int | None
    epoch: int | None


class Encoder:
    """One shaft: counts to position and velocity.

    step: position per count, with the sign of the encoder's direction (rad or m per count).
    start: position at the origin (rad or m).

    From a change of the counts' epoch on the position is not known (NaN) until it is zeroed again.
    """

    def __init__(self, step: float, window_s: float = WINDOW_S, start: float = 0.0) -> None:
        self._step = step
        self._start = start
        self._origin: int | None = None
        self._epoch: int | None = None
        self._to_zero = True
        self._velocity = VelocityFilter(window_s)

    @property
    def lost(self) -> bool:
        """Whether the position is not known any more."""
        return self._origin is None and self._epoch is not None

    @property
    def origin(self) -> Origin:
        return Origin(self._origin, self._epoch)

    def restore(self, origin: Origin) -> None:
        """Go on from an origin, in place of the next count's."""
        self._origin, self._epoch = origin
        self._to_zero = False

    def zero(self) -> None:
        """Make the next count the origin."""
        self._to_zero = True

    def update(self, stamp_ns: int, count: int, epoch: int = 0) -> tuple[float, float]:
        """Position and velocity; the first count is the origin."""
        if self._epoch not in (None, epoch):
            # Its first position is not known in any case, so that a break shows in the record
            self._origin = None
            self._velocity.reset()
        elif self._to_zero:
            self._origin = count
            self._to_zero = False
        self._epoch = epoch
        position = math.nan
        if self._origin is not None:
            position = self._start + self._step * (count - self._origin)
        # From the counts, which go on evenly where the position gets a new origin
        return position, self._step * self._velocity.update(stamp_ns, count)


class Drive(NamedTuple):
    """How the drive moves the tow: rad/s, m/s, m/s^2, and where it is: rad, m.

    NaN where that is not known.
    """

    crank_rate: float
    carriage_speed: float
    carriage_acceleration: float
    crank_angle: float = math.nan
    carriage_position: float = math.nan


AT_REST = Drive(0.0, 0.0, 0.0)
UNKNOWN = Drive(math.nan, math.nan, math.nan)


class DriveWatch:
    """How crank and carriage move, from the counts that come with every scan.

    The encoders' node tells it, and it acts on the other sensors. At the start, after a gap and in
    a new epoch of the counts, the speeds are not known for half a velocity's window, the
    acceleration for a quarter of a second more: no speed from before a gap counts.
    """

    def __init__(self, rig: Rig, window_s: float = WINDOW_S) -> None:
        self._crank = Encoder(crank_encoder(rig).per_count, window_s, crank_zero(rig))
        self._carriage = Encoder(carriage_encoder(rig).per_count, window_s)
        self._speeds: deque[tuple[int, float]] = deque()

    def update(
        self, stamp_ns: int, crank_count: int, carriage_count: int, count_epoch: int = 0
    ) -> Drive:
        """The drive after one more scan; stamps must increase."""
        angle, crank_rate = self._crank.update(stamp_ns, crank_count, count_epoch)
        position, speed = self._carriage.update(stamp_ns, carriage_count, count_epoch)
        return Drive(crank_rate, speed, self._acceleration(stamp_ns, speed), angle, position)

    def zero(self) -> None:
        """Make the next counts the origins."""
        self._crank.zero()
        self._carriage.zero()

    @property
    def origins(self) -> tuple[Origin, Origin]:
        """Of crank and carriage."""
        return self._crank.origin, self._carriage.origin

    def restore(self, crank: Origin, carriage: Origin) -> None:
        """Go on from these origins, in place of the next counts'."""
        self._crank.restore(crank)
        self._carriage.restore(carriage)

    @property
    def lost(self) -> bool:
        """Whether the positions are not known any more."""
        return self._crank.lost

    def _acceleration(self, stamp_ns: int, speed: float) -> float:
        speeds = self._speeds
        if math.isnan(speed):
            speeds.clear()
            return math.nan
        speeds.append((stamp_ns, speed))
        while len(speeds) > 2 and stamp_ns - speeds[1][0] >= 1e9 * _ACCELERATION_WINDOW_S:
            speeds.popleft()
        first_ns, first = speeds[0]
        elapsed_s = (stamp_ns - first_ns) * 1e-9
        if elapsed_s <= _ACCELERATION_WINDOW_S / 2:
            return math.nan
        return (speed - first) / elapsed_s
