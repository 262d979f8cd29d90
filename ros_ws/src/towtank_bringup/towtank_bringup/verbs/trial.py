# SPDX-License-Identifier: Apache-2.0
"""`towtank trial`: record a trial, on the virtual tank or on a real one, and report it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import click
import psutil
import rclpy
from towtank_rig import RigError

from towtank_bringup.closing import FAULTS, IncompleteTrial, close_trial, marked
from towtank_bringup.conductor import Conductor, open_conductor
from towtank_bringup.course import drive_for, run_course
from towtank_bringup.environment import ros_domain, runtime_folder
from towtank_bringup.only_trial import DISCOVERY_S, DomainTaken, only_trial
from towtank_bringup.plan import PlanError, PlannedTrial, plan_trial
from towtank_bringup.processes import ProcessGroup
from towtank_bringup.progress import ProgressLine
from towtank_bringup.result_table import print_result
from towtank_bringup.run_file import announced
from towtank_bringup.standard_streams import OutputError
from towtank_bringup.stop_request import StopRequest
from towtank_bringup.trial_directory import TrialDirectoryError


@click.command(name="trial")
@click.option("--rig", default="nit_calicut_2012", help="Rig file, or name of one.")
@click.option("--port", type=click.Path(path_type=Path), help="Serial port of the ADC board.")
@click.option("--virtual", is_flag=True, help="Virtual board and tank (default without --port).")
@click.option(
    "--duration", type=float, help="Logged time, s (what the tank has room for, at most 40)."
)
@click.option(
    "--beyond-tank", is_flag=True, help="Virtual tank: let the run be longer than the tank."
)
@click.option("--out", type=click.Path(path_type=Path), help="New directory for the trial.")
@click.option("--plant-rig", help="Virtual tank: the plant's own rig file (default: the rig).")
@click.option(
    "--noise",
    type=click.Choice(["rig", "none"]),
    default="rig",
    help="Virtual tank: sensor errors drawn from the rig's budget, or ideal sensors.",
)
@click.option("--seed", type=int, default=1, help="Virtual tank: seed of the sensor errors (1).")
@click.option(
    "--sensor-faults",
    default="",
    metavar="CHANNEL:KIND@START[-STOP],…",
    help="Virtual tank: broken sensors and wires (open, short, stuck, noisy; excitation:low, high),"
    " s after the start.",
)
@click.option(
    "--any-calibration",
    is_flag=True,
    help="Take a board of another calibration than the rig's, with a warning.",
)
@click.option("--json", "as_json", is_flag=True, help="Print result.json instead of the table.")
def command(virtual: bool, as_json: bool, **wishes: Any) -> None:
    """Record a trial, compute its heave ratios and write a report."""
    if virtual and wishes["port"]:
        raise click.UsageError("--virtual and --port exclude each other: give one")
    say = ProgressLine()
    shared = bool(os.environ.get("ROS_DOMAIN_ID"))  # a domain that others may be in
    try:
        with runtime_folder() as runtime, ros_domain() as domain:
            planned = plan_trial(runtime=runtime, **wishes)
            for note in planned.notes():
                say(note)
                say.close()
            with only_trial(planned.graph, DISCOVERY_S if shared else 0.0):
                planned.directory.create()
                try:
                    with StopRequest() as stop, marked(planned.directory):
                        with announced(planned.directory.path, domain, planned.on_virtual_tank):
                            _start_and_lead(planned, stop, say)
                        result = close_trial(planned.directory, say)
                finally:
                    say.close()
    except TrialDirectoryError as error:
        raise click.ClickException(f"{error}: give a new one with --out") from error
    except (PlanError, RigError, DomainTaken, IncompleteTrial) as error:
        raise click.ClickException(str(error)) from error
    try:
        if as_json:
            click.echo(json.dumps(result, indent=2))
        else:
            print_result(result, planned.directory.path)
    except OutputError as error:
        raise click.ClickException(
            f"{error}: the trial is whole, see {planned.directory.result}"
        ) from error


def _start_and_lead(planned: PlannedTrial, stop: StopRequest, say: ProgressLine) -> None:
    """Start the graph, lead the trial through, stop everything whatever happens."""
    processes = ProcessGroup(planned.directory.logs)
    conductor: Conductor | None = None

    def watch() -> None:
        stop.check()
        planned.directory.check()
        processes.check(may_restart=conductor is not None and conductor.leading)

    try:
        say("starting the graph")
        processes.start(planned.graph, watch)
        conductor = open_conductor(planned.graph, watch, say)
        run_course(conductor, planned.course, drive_for(planned.on_virtual_tank), psutil.Process())
    except FAULTS as error:
        say(f"stopping: {error}")  # somebody stands at the carriage, and stopping takes seconds
        raise
    finally:
        if conductor:
            conductor.close()
            rclpy.try_shutdown()
        for name in processes.stop():
            say(f"warning: {name} did not stop by itself and was killed")
