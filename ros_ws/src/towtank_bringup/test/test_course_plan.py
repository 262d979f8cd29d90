# SPDX-License-Identifier: Apache-2.0
"""A planned course fits its tank, or is refused with the mend."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_bringup.course_plan import (
    LONGEST_DURATION_S,
    Course,
    PlanError,
    course_notes,
    plan_course,
)
from towtank_bringup.rigs import rig_path
from towtank_rig import Rig, load_rig
from towtank_rig.loading import replaced

NIT = load_rig(rig_path("nit_calicut_2012"))
WU = load_rig(rig_path("wu_chwang_2001"))


def short_tank(length: float) -> Rig:
    return replaced(NIT, {"tank.length": {"value": f"{length} m", "basis": "measured"}})


def test_the_default_trial_fits_the_tank_it_was_made_in():
    """40 m less 2 m; at 1 m/s, ramps of 4 s and 2 s of waiting leave 32 s for settling and log."""
    course = plan_course(NIT, attended=False)
    assert (course.settle_time, course.duration) == (15.0, 17.0)
    assert course.run_length == pytest.approx(38.0)
    assert course.crank_periods == pytest.approx(8.5)
    assert course_notes(course, NIT) == [
        "plan: a log of 17 s, 8.5 periods of the crank, after 15 s of settling; the carriage runs "
        "38.0 of 40 m"
    ]


def test_a_person_needs_time_to_stop():
    assert plan_course(NIT, attended=True).duration == 15.0


def test_a_long_tank_is_not_used_up():
    course = plan_course(WU, attended=False)
    assert (course.settle_time, course.duration) == (15.0, LONGEST_DURATION_S)


def test_settling_is_cut_only_for_a_log_of_some_periods():
    """Five periods of 2 s, by a crank that is slower by what still counts as steady: 10.31 s."""
    course = plan_course(short_tank(30.0), attended=False)
    assert course.duration == pytest.approx(10.3, abs=0.1)
    assert course.settle_time == pytest.approx(28.0 - 6.0 - 10.0 / 0.97, abs=1e-9)
    assert "settling is cut from 15 to 11.7 s" in course_notes(course, short_tank(30.0))[1]
    shortest = plan_course(short_tank(24.0), attended=False)
    assert (shortest.settle_time, shortest.duration) == (10.0, 6.0)


def test_a_wanted_log_may_cost_settling_but_no_more():
    course = plan_course(NIT, 20.0, attended=False)
    assert (course.settle_time, course.duration) == (12.0, 20.0)
    with pytest.raises(PlanError) as refused:
        plan_course(NIT, 25.0, attended=True)
    assert str(refused.value) == (
        "a log of 25 s needs a run of 43.0 m (ramps 4.0 m, settling 10.0 m), the tank of "
        "nit_calicut_2012 has 38 m (40 m less tank.clearance): give at most --duration 20, or "
        "lower run.carriage_speed"
    )
    assert plan_course(NIT, 20.0, attended=True).fits
    with pytest.raises(PlanError, match="or give --beyond-tank"):
        plan_course(NIT, 25.0, attended=False)


def test_beyond_the_tank_the_settling_is_whole_and_the_note_says_so():
    course = plan_course(NIT, 40.0, attended=False, beyond_tank=True)
    assert (course.settle_time, course.duration) == (15.0, 40.0)
    assert (
        "the carriage runs 61 m, the tank of nit_calicut_2012 has 38 m"
        in (course_notes(course, NIT)[-1])
    )
    assert plan_course(NIT, attended=False, beyond_tank=True) == course


@pytest.mark.parametrize("length", [0.5, 2.0, 10.0, 22.9])
def test_a_tank_that_is_too_short_is_refused(length):
    with pytest.raises(PlanError, match=r"the shortest run .* lower run.carriage_speed$"):
        plan_course(short_tank(length), attended=True)


@pytest.mark.parametrize("duration", [4.9, 0.0, -1.0, math.nan])
def test_a_log_too_short_for_a_ratio_is_refused(duration):
    with pytest.raises(PlanError, match=r"duration .* s: give at least the 5 s"):
        plan_course(NIT, duration, attended=False)


def test_a_slow_crank_needs_a_longer_log():
    """Two periods of 20 s, 3 % slow: 41.24 s."""
    slow = replaced(WU, {"run.crank_rate": 2 * math.pi / 20})
    with pytest.raises(PlanError, match=r"give at least the 41\.3 s"):
        plan_course(slow, 40.0, attended=False)
    assert plan_course(slow, attended=False).duration >= 41.24
    with pytest.raises(PlanError, match="the crank of wu_chwang_2001 stands"):
        plan_course(replaced(WU, {"run.crank_rate": 0.0}), attended=False)


def test_a_standing_carriage_needs_no_tank():
    still = replaced(NIT, {"run.carriage_speed": 0.0})
    course = plan_course(still, attended=True)
    assert (course.settle_time, course.duration, course.run_length) == (15.0, 40.0, 0.0)
    assert course.after(100.0) == course


def test_a_carriage_that_was_started_early_shortens_the_log():
    course = plan_course(NIT, attended=True)
    nominal = course.carriage_speed * (course.ramp_time / 2 + 1.0)
    assert course.after(nominal) == course
    late = course.after(nominal + 3.5)
    assert late.duration == pytest.approx(course.duration - 3.0)
    assert late.settle_time == course.settle_time
    with pytest.raises(PlanError, match=r"had run 20\.0 m before .* stop it"):
        course.after(20.0)


PLANNED_BY = (
    *("tank.length", "tank.clearance", "run.carriage_speed", "run.crank_rate"),
    *("run.ramp_time", "run.settling_time"),
)


def with_values(rig: Rig, values: list[float]) -> Rig:
    """The rig with other values for what a course is planned by."""
    sections = {"tank": {}, "run": {}}
    for path, value in zip(PLANNED_BY, values, strict=True):
        section, name = path.split(".")
        quantity = getattr(getattr(rig, section), name)
        sections[section][name] = quantity.model_copy(update={"value": value})
    return rig.model_copy(
        update={name: getattr(rig, name).model_copy(update=new) for name, new in sections.items()}
    )


def values_of(rig: Rig) -> st.SearchStrategy[Rig]:
    """Each value anywhere in its range, or from a tenth of it to ten times."""
    found = []
    for path in PLANNED_BY:
        section, name = path.split(".")
        quantity = getattr(getattr(rig, section), name)
        found.append(quantity.range or (quantity.value / 10.0, quantity.value * 10.0))
    spans = st.tuples(*(st.floats(low, high) for low, high in found))
    return spans.map(lambda values: with_values(rig, values))


def way(course: Course) -> float:
    """From rest to rest, by its stages."""
    times = (course.ramp_time / 2, course.waiting_time, course.settle_time, course.duration)
    return course.carriage_speed * (sum(times) + course.ramp_time / 2)


@given(
    rig=st.one_of(values_of(NIT), values_of(WU)),
    duration=st.none() | st.floats(0.1, 200.0),
    attended=st.booleans(),
)
def test_any_course_fits_or_is_refused(rig, duration, attended):
    try:
        course = plan_course(rig, duration, attended=attended)
    except PlanError as refused:
        assert "\n" not in str(refused)
        # Nothing that is allowed would have fitted
        low = rig.run.settling_time.range[0]
        wished = duration if duration is not None else 0.0
        time = rig.run.ramp_time.value + 2.0 + 2.0 * attended + low + max(wished, 5.0)
        slow = 2 * 2 * math.pi / rig.run.crank_rate.value
        assert (
            rig.run.carriage_speed.value * time
            > rig.tank.length.value - rig.tank.clearance.value - 0.1 * rig.run.carriage_speed.value
            or wished < max(5.0, 1.04 * slow)
        )
        return
    assert way(course) <= rig.tank.length.value - rig.tank.clearance.value + 1e-9
    low, high = rig.run.settling_time.range
    assert low <= course.settle_time <= rig.run.settling_time.value <= high
    assert course.crank_periods >= 2.0
    assert course.duration >= 5.0
    if duration is None:
        assert course.duration <= max(LONGEST_DURATION_S, course.shortest_duration + 0.1)
    else:
        assert course.duration == duration
    # A nominal start leaves the course as it is, and no start leads out of the tank.
    start = course.carriage_speed * (course.ramp_time / 2 + 1.0)
    assert course.after(start).duration == pytest.approx(course.duration, abs=0.1)
