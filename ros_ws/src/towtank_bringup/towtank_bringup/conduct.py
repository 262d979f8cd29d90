# SPDX-License-Identifier: Apache-2.0
"""The conductor as an executable of its own, for launch files: leads a graph that is started."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import psutil
import rclpy
from towtank_rig import RigError

from towtank_bringup.closing import IncompleteTrial, close_trial, marked
from towtank_bringup.conductor import open_conductor
from towtank_bringup.course import drive_for, run_course
from towtank_bringup.plan import PlanError, PlannedTrial, plan_trial
from towtank_bringup.progress import ProgressLine
from towtank_bringup.result_table import print_result
from towtank_bringup.ros_domain import domain_of_environment
from towtank_bringup.run_file import announced
from towtank_bringup.standard_streams import guard_standard_streams
from towtank_bringup.stop_request import Stopped, StopRequest


def main() -> int:
    """Lead the trial; returns the exit status. The launch file has made the directory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", required=True)
    parser.add_argument("--port", type=Path)
    parser.add_argument("--duration", type=float)
    parser.add_argument("--beyond-tank", action="store_true")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--runtime", type=Path, required=True)
    parser.add_argument("--clock-offset-ns", type=int, required=True)
    arguments, ros_arguments = parser.parse_known_args()  # launch adds --ros-args
    guard_standard_streams()
    say = ProgressLine()
    try:
        planned = plan_trial(**vars(arguments))
        for note in planned.notes():
            print(note, file=sys.stderr)
        with StopRequest() as stop, marked(planned.directory):
            domain = domain_of_environment() or 0  # ROS's default
            with announced(planned.directory.path, domain, planned.on_virtual_tank):
                _conduct(planned, stop, say, ros_arguments)
            print_result(close_trial(planned.directory, say), planned.directory.path)
    except (IncompleteTrial, PlanError, RigError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except Stopped as stopped:
        print("stopped (trial marked incomplete)", file=sys.stderr)
        return stopped.status
    return 0


def _conduct(
    planned: PlannedTrial, stop: StopRequest, say: ProgressLine, ros_arguments: list[str]
) -> None:
    def watch() -> None:
        stop.check()
        planned.directory.check()

    conductor = open_conductor(planned.graph, watch, say, ros_arguments)
    try:
        # The nodes are siblings: children of the launch process.
        run_course(
            conductor,
            planned.course,
            drive_for(planned.on_virtual_tank),
            psutil.Process().parent(),
        )
    finally:
        conductor.close()
        rclpy.try_shutdown()
