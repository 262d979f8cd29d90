# SPDX-License-Identifier: Apache-2.0
"""Leading a trial through its course: zero, start, steady run, log, stop."""

from __future__ import annotations

import time
from typing import Protocol

import psutil
from towtank_interfaces.msg import TrialEvent
from towtank_node.names import BODIES, CARRIAGE_JOINT, CRANK_JOINT, pressure_node

from towtank_bringup.conductor import Conductor, CrankStopped, TrialError
from towtank_bringup.course_plan import STEADY_TIME_S, STEADY_TOLERANCE, Course, PlanError

RUN_DOWN_S = 4.0
"""A crank without power is at rest by then, 60 rpm and the virtual tank's lead included."""


class Drive(Protocol):
    """What moves carriage and crank.

    start_timeout_s: how long they may take to run steadily. attended: a person moves them, who may
    let the carriage run before the crank does.
    """

    start_timeout_s: float
    attended: bool

    def start(self, conductor: Conductor, course: Course) -> None: ...

    def stop(self, conductor: Conductor, course: Course) -> None: ...


class VirtualDrive:
    """The virtual tank's drive, told by a service."""

    start_timeout_s = 60.0
    attended = False

    def start(self, conductor: Conductor, course: Course) -> None:
        conductor.set_drive(course.carriage_speed, course.crank_rate, course.ramp_time)

    def stop(self, conductor: Conductor, course: Course) -> None:
        conductor.set_drive(0.0, 0.0, course.ramp_time)
        conductor.spin_for(course.ramp_time + 0.5)


class OperatorDrive:
    """A person at the carriage, told in words."""

    start_timeout_s = 300.0
    attended = True

    def start(self, conductor: Conductor, course: Course) -> None:
        conductor.say(
            f"start the crank ({course.crank_rate:.4g} rad/s), then the carriage "
            f"({course.carriage_speed:g} m/s); the log starts by itself once both are steady"
        )

    def stop(self, conductor: Conductor, course: Course) -> None:
        conductor.say("stop the carriage and the crank")
        conductor.bring_crank_to_rest()


def run_course(
    conductor: Conductor, course: Course, drive: Drive, process_tree: psutil.Process
) -> None:
    """Lead one trial through; everything it leaves is in the recorder's bag.

    However it ends, a real crank that the board's drive turns is brought to rest first: the nodes
    are ended one after the other, and until its turn comes the board's would keep it running.
    process_tree: the process whose descendants are the graph, for the processor time it takes.
    """
    try:
        _lead(conductor, course, drive, process_tree)
    except BaseException as error:
        if drive.attended and conductor.crank_turns:
            conductor.say(f"stopping the crank first: {error}")
            conductor.bring_crank_to_rest()
        raise


def _lead(conductor: Conductor, course: Course, drive: Drive, process_tree: psutil.Process) -> None:
    conductor.say("waiting for the nodes")
    conductor.bring_up()
    conductor.mark(TrialEvent.STARTED, duration_s=course.duration)

    conductor.say("zeroing the pressure sensors at rest")
    for body in BODIES:
        words = conductor.zero(pressure_node(body))
        conductor.mark(TrialEvent.ZEROED, sensor=f"{body}_pressure", message=words)

    conductor.say(
        f"carriage to {course.carriage_speed:g} m/s, crank to {course.crank_rate:.4g} rad/s"
    )
    drive.start(conductor, course)
    conductor.mark(
        TrialEvent.DRIVE, carriage_speed=course.carriage_speed, crank_rate=course.crank_rate
    )
    way = conductor.wait_for_steady_drive(
        {CARRIAGE_JOINT: course.carriage_speed, CRANK_JOINT: course.crank_rate},
        STEADY_TOLERANCE,
        STEADY_TIME_S,
        drive.start_timeout_s,
    )
    if drive.attended:
        course = _with_the_room_left(conductor, course, way)
    try:
        conductor.hold_crank(STEADY_TOLERANCE)
        cpu_cores = _log(conductor, course, process_tree)
    except CrankStopped:
        # What a crank does that was stopped is worth a record, too
        conductor.release_crank()
        conductor.say(f"the crank was stopped; recording for {RUN_DOWN_S:g} s how it runs down")
        conductor.spin_for(RUN_DOWN_S)
        raise
    conductor.release_crank()

    conductor.say("stopping the carriage and the crank")
    drive.stop(conductor, course)
    conductor.mark(
        TrialEvent.RESOURCES, cpu_cores=round(cpu_cores, 3), overruns=conductor.reported("overruns")
    )
    conductor.mark(TrialEvent.STOPPED)
    conductor.spin_for(0.5)  # the recorder takes the last events in
    conductor.shut_down()


def _with_the_room_left(conductor: Conductor, course: Course, way: float) -> Course:
    """The course whose log ends in the tank, after the carriage has run `way`, m."""
    try:
        left = course.after(way)
    except PlanError as error:
        raise TrialError(str(error)) from error
    if left.duration < course.duration:
        conductor.say(
            f"log cut to {left.duration:g} s ({left.crank_periods:.1f} periods of the crank): the "
            f"carriage has run {way:.1f} m already"
        )
    return left


def _log(conductor: Conductor, course: Course, process_tree: psutil.Process) -> float:
    """Let the tow settle and log it. Returns the processor cores that the log took."""
    conductor.say(f"settling for {course.settle_time:g} s")
    conductor.spin_for(course.settle_time)
    conductor.mark(TrialEvent.LOG_START)
    start, busy = time.monotonic(), _cpu_seconds(process_tree)
    conductor.spin_for(course.duration, lambda: _show_progress(conductor, course, start))
    cpu_cores = (_cpu_seconds(process_tree) - busy) / (time.monotonic() - start)
    conductor.mark(TrialEvent.LOG_STOP)
    return cpu_cores


def _cpu_seconds(process_tree: psutil.Process) -> float:
    """Processor time of a process and its descendants so far, user and system, s."""
    total = 0.0
    for process in [process_tree, *process_tree.children(recursive=True)]:
        try:
            times = process.cpu_times()
        except psutil.NoSuchProcess:
            continue
        # Those of its children that have ended count on: one may have been started again
        total += times.user + times.system + times.children_user + times.children_system
    return total


def _show_progress(conductor: Conductor, course: Course, start: float) -> None:
    ratios = "  ".join(
        f"{source} {ratio.value:.4f}"
        for source, ratio in sorted(conductor.ratios.items())
        if ratio.valid
    )
    done = min(time.monotonic() - start, course.duration)
    conductor.say(f"logging {done:5.1f} of {course.duration:g} s   heave ratio {ratios or '...'}")


def drive_for(on_virtual_tank: bool) -> Drive:
    """The drive that a trial has."""
    return VirtualDrive() if on_virtual_tank else OperatorDrive()
