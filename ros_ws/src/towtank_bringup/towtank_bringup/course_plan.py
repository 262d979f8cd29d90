# SPDX-License-Identifier: Apache-2.0
"""A course that fits its tank: from rest to rest, with as long a log as there is room for.

A run is the ramp up, a wait until the encoders have said for a while that carriage and crank are
steady, the settling, the log, and the ramp down. The tow settles from where it hung at rest and
swings slowly about its depth, which costs more of a log than the noise of a shorter one: so the
settling comes first, and is cut, down to the low end of its range in the rig file, only for a log
that would hold too few periods of the crank. How much a settling leaves in the heave ratio
prints `towtank bench settling`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from towtank_compare.harmonic import MIN_PERIODS
from towtank_rig import Rig

STEADY_TOLERANCE = 0.03
"""Carriage and crank count as steady within this fraction of their set values."""
STEADY_TIME_S = 1.0
"""So long they must have been steady."""
NOTICED_S = 0.5
"""What comes between a steady run or the end of the log and what is done about it, at most."""
REACTION_S = 2.0
"""A person at the carriage takes so long to stop it when told."""

LONGEST_DURATION_S = 40.0
"""Logged where no duration is asked for and the tank has room for it."""
SHORTEST_DURATION_S = 5.0
WANTED_PERIODS = 5
"""So many crank periods make a scatter of four segments, which is worth a shorter settling."""

_A_DAY_S = 86_400.0
_ROUNDING_M = 1e-9


class PlanError(ValueError):
    """The trial cannot be as wished; the message names the cause and the mend."""


@dataclass(frozen=True)
class Course:
    """What the carriage and the crank do. Times in s, lengths in m, speeds in m/s and rad/s.

    waiting_time: at full speed before the settling and after the log, until it is noticed or done.
    room: of the tank, for the way from rest to rest.
    """

    duration: float
    carriage_speed: float
    crank_rate: float
    ramp_time: float
    settle_time: float
    waiting_time: float
    room: float

    @property
    def run_length(self) -> float:
        """Way of the carriage from rest to rest, m (a ramp counts half)."""
        return self.carriage_speed * (
            self.ramp_time + self.waiting_time + self.settle_time + self.duration
        )

    @property
    def fits(self) -> bool:
        """Whether the carriage has room for it."""
        return self.run_length <= self.room + _ROUNDING_M

    @property
    def crank_periods(self) -> float:
        """Periods of the crank in the log."""
        return self.duration * self.crank_rate / (2.0 * math.pi)

    @property
    def shortest_duration(self) -> float:
        """The shortest log that the analysis makes a heave ratio of, s."""
        return max(SHORTEST_DURATION_S, self._lasting(MIN_PERIODS))

    def _lasting(self, periods: int) -> float:
        """Time for whole periods of a crank that turns as slowly as still counts as steady, s."""
        return periods * 2.0 * math.pi / (self.crank_rate * (1.0 - STEADY_TOLERANCE))

    def after(self, way: float) -> Course:
        """The course from here on, where the carriage has run `way` (m) until it was steady.

        The log is cut to what room is left; PlanError if that is too short.
        """
        if self.carriage_speed == 0.0:
            return self
        left = (self.room - way) / self.carriage_speed
        # Behind the steady run: settling, log, what is left of the waiting, and half the ramp down
        waiting = self.waiting_time - STEADY_TIME_S - NOTICED_S
        other = self.settle_time + waiting + self.ramp_time / 2.0
        duration = min(self.duration, _tenths(left - other))
        if duration < self.shortest_duration:
            raise PlanError(
                f"the carriage had run {way:.1f} m before carriage and crank were steady: the "
                f"{self.room:g} m of the tank do not hold the rest of the run: stop it, start the "
                "crank before the carriage, and start anew"
            )
        return replace(self, duration=duration)


def plan_course(
    rig: Rig, duration: float | None = None, *, attended: bool, beyond_tank: bool = False
) -> Course:
    """The course that the rig file describes.

    duration: of the log, s; None for what fits, at most LONGEST_DURATION_S. attended: a person
    drives the carriage, who needs time to react. beyond_tank: the tank's length does not count,
    which is for a virtual one. Raises PlanError if the run does not fit, or the log is too short.
    """
    crank_rate, speed = rig.run.crank_rate.value, rig.run.carriage_speed.value
    if crank_rate == 0.0:
        raise PlanError(
            f"the crank of {rig.name} stands (run.crank_rate): there is no heave ratio without it"
        )
    full_settling = rig.run.settling_time.value
    plan = Course(
        duration=0.0,
        carriage_speed=speed,
        crank_rate=crank_rate,
        ramp_time=rig.run.ramp_time.value,
        settle_time=full_settling,
        waiting_time=STEADY_TIME_S + 2.0 * NOTICED_S + (REACTION_S if attended else 0.0),
        room=rig.tank.length.value - rig.tank.clearance.value,
    )
    if duration is not None and not duration >= plan.shortest_duration:
        raise PlanError(
            f"duration {duration:g} s: give at least the {_up(plan.shortest_duration):g} s that a "
            f"heave ratio needs, {MIN_PERIODS} periods of the crank included"
        )
    longest = max(LONGEST_DURATION_S, _up(plan.shortest_duration))
    if beyond_tank:
        return replace(plan, duration=longest if duration is None else duration)

    low, _ = rig.run.settling_time.range or (full_settling, full_settling)
    free = plan.room / speed - plan.ramp_time - plan.waiting_time if speed > 0.0 else math.inf
    if duration is None:
        wanted = min(max(plan.shortest_duration, plan._lasting(WANTED_PERIODS)), longest)
        settling = min(full_settling, max(low, free - wanted))
        plan = replace(plan, settle_time=settling)
        plan = replace(plan, duration=_tenths(min(longest, free - settling)))
    else:
        settling = min(full_settling, max(low, free - duration))
        plan = replace(plan, settle_time=settling, duration=duration)
    most = _tenths(min(free - low, _A_DAY_S))
    if most < plan.shortest_duration:
        at_least = replace(plan, settle_time=low, duration=plan.shortest_duration)
        raise PlanError(
            f"the shortest run that gives a heave ratio needs {at_least.run_length:.1f} m, "
            f"{_room_words(rig, plan)}: lower run.carriage_speed"
            + ("" if attended else ", or give --beyond-tank")
        )
    if not plan.fits:
        raise PlanError(
            f"a log of {plan.duration:g} s needs a run of {plan.run_length:.1f} m (ramps "
            f"{plan.ramp_time * speed:.1f} m, settling {plan.settle_time * speed:.1f} m), "
            f"{_room_words(rig, plan)}: give at most --duration {most:g}, or lower "
            "run.carriage_speed" + ("" if attended else ", or give --beyond-tank")
        )
    return plan


def course_notes(course: Course, rig: Rig) -> list[str]:
    """What the experimenter should know of a course before the start, a line each."""
    notes = [
        f"plan: a log of {course.duration:g} s, {course.crank_periods:.1f} periods of the crank, "
        f"after {course.settle_time:.3g} s of settling; the carriage runs {course.run_length:.1f} "
        f"of {rig.tank.length.value:g} m"
    ]
    if course.settle_time < rig.run.settling_time.value:
        notes.append(
            f"note: settling is cut from {rig.run.settling_time.value:g} to "
            f"{course.settle_time:.3g} s, for the tank is short: lower run.carriage_speed"
        )
    if not course.fits:
        notes.append(
            f"note: the carriage runs {course.run_length:.0f} m, {_room_words(rig, course)}"
        )
    return notes


def _room_words(rig: Rig, course: Course) -> str:
    return (
        f"the tank of {rig.name} has {course.room:g} m ({rig.tank.length.value:g} m less "
        f"tank.clearance)"
    )


def _tenths(seconds: float) -> float:
    """Rounded down to a tenth of a second."""
    return math.floor(10.0 * seconds) / 10.0


def _up(seconds: float) -> float:
    return math.ceil(10.0 * seconds) / 10.0
