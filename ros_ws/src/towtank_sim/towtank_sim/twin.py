# SPDX-License-Identifier: Apache-2.0
"""The twin: the simulated tow behind the measured carriage and crank."""

from __future__ import annotations

import math

from towtank_rig import Rig

from towtank_sim.drive import DriveState
from towtank_sim.smoother import DriveSample, DriveSmoother
from towtank_sim.tow import Tow
from towtank_sim.tow_point import TowPoint

LONGEST_GAP_NS = 500_000_000
"""Lost samples are bridged up to this time, ns."""

# Between samples the tow point is given at least this often; at a crank of 1 Hz the cubic between
# two such points is right to (2π·0.015)⁴/384 = 2e-7 of the amplitude.
_LONGEST_STEP_NS = 15_000_000
# At a higher heave speed (m/s) the tow does not begin: a steady tow put in motion with a jerk
# would ring for seconds.
_STARTING_HEAVE_SPEED = 0.02


class Twin:
    """Follows samples of crank angle and carriage position, a fixed lag behind them.

    The tow starts as a steady tow at the carriage's speed, at rest if it stands, as soon as the
    tow point heaves slowly enough. After a gap longer than LONGEST_GAP_NS, when time goes back, or
    when the positions are not known (NaN) and may have got another origin since, the twin's past
    is worth nothing: it starts anew in the same way, and `interruption` says why and when. The
    states of the first half minute after that hold the transient of a start.

    segments: of all lines, see `towtank_sim.model.segment_counts`; step: longest time step, s.
    """

    def __init__(self, rig: Rig, segments: int, step: float) -> None:
        self.tow = Tow(rig, segments, step)
        self._tow_point = TowPoint(rig)
        self._smoother = DriveSmoother()
        self._newest: int | None = None
        self._last: DriveSample | None = None
        self._last_heave_speed = math.inf
        self._start = 0
        self._running = False
        self.interruptions = 0
        self.interruption = ""

    @property
    def running(self) -> bool:
        """True while the tow follows the samples."""
        return self._running

    def follow(self, stamp: int, crank_angle: float, carriage_position: float) -> int | None:
        """Take a sample; step the tow to the sample that lies half a window back.

        stamp: instant of sampling, ns; crank_angle: rad; carriage_position: m.
        Returns the instant (ns) of the tow's new state, or None if there is none. A sample that
        comes twice counts as lost.
        """
        if not (math.isfinite(crank_angle) and math.isfinite(carriage_position)):
            if self._newest is not None:
                self._interrupt("the positions of crank and carriage are not known", stamp)
                self._newest = None
            return None
        if self._newest is not None:
            if stamp == self._newest:
                return None
            if stamp < self._newest:
                self._interrupt(f"time went back by {(self._newest - stamp) * 1e-9:.3f} s", stamp)
            elif stamp - self._newest > LONGEST_GAP_NS:
                self._interrupt(
                    f"no samples of crank and carriage for {(stamp - self._newest) * 1e-9:.3f} s",
                    stamp,
                )
        self._newest = stamp
        sample = self._smoother.push(stamp, crank_angle, carriage_position)
        if sample is None:
            return None
        if self._running:
            self._step(sample)
        else:
            self._try_to_start(sample)
        self._last = sample
        return sample.stamp if self._running else None

    def _interrupt(self, cause: str, stamp: int) -> None:
        self._smoother.clear()
        self._last_heave_speed = math.inf
        self._running = False
        self.interruptions += 1
        self.interruption = f"{cause}, at {stamp * 1e-9:.3f} s"

    def _try_to_start(self, sample: DriveSample) -> None:
        position, velocity = self._tow_point.at(_drive_state(sample))
        heave_speed = velocity[2]
        turning = heave_speed * self._last_heave_speed < 0.0
        self._last_heave_speed = heave_speed
        if turning or abs(heave_speed) <= _STARTING_HEAVE_SPEED:
            self.tow.start(position, (velocity[0], 0.0, 0.0))
            self._start = sample.stamp
            self._running = True

    def _step(self, sample: DriveSample) -> None:
        """Step to `sample`, in several steps where samples were lost before it."""
        last = self._last
        assert last is not None
        steps = math.ceil((sample.stamp - last.stamp) / _LONGEST_STEP_NS)
        for i in range(1, steps):
            between = last.stamp + (sample.stamp - last.stamp) * i // steps
            self._step_to(between, _interpolate(last, sample, i / steps))
        self._step_to(sample.stamp, _drive_state(sample))

    def _step_to(self, stamp: int, drive: DriveState) -> None:
        self.tow.step_to((stamp - self._start) * 1e-9, *self._tow_point.at(drive))


def _drive_state(sample: DriveSample) -> DriveState:
    return DriveState(
        sample.crank_angle, sample.crank_rate, sample.carriage_position, sample.carriage_speed
    )


def _interpolate(a: DriveSample, b: DriveSample, fraction: float) -> DriveState:
    """The cubic through both samples' values and slopes, at `fraction` of the way."""
    interval = (b.stamp - a.stamp) * 1e-9
    crank = _hermite(a.crank_angle, a.crank_rate, b.crank_angle, b.crank_rate, interval, fraction)
    carriage = _hermite(
        a.carriage_position,
        a.carriage_speed,
        b.carriage_position,
        b.carriage_speed,
        interval,
        fraction,
    )
    return DriveState(*crank, *carriage)


def _hermite(
    p0: float, v0: float, p1: float, v1: float, interval: float, u: float
) -> tuple[float, float]:
    """Value and slope of the cubic Hermite interpolant."""
    m0, m1, rise = v0 * interval, v1 * interval, p1 - p0
    b = 3 * rise - 2 * m0 - m1
    c = m0 + m1 - 2 * rise
    return p0 + u * (m0 + u * (b + u * c)), (m0 + u * (2 * b + 3 * u * c)) / interval
