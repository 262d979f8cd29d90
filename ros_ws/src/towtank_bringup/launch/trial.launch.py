# SPDX-License-Identifier: Apache-2.0
"""A whole trial in a native ROS 2 Jazzy: the same graph that `towtank trial` starts.

    ros2 launch towtank_bringup trial.launch.py rig:=nit_calicut_2012 duration:=15 out:=DIR
    ros2 launch towtank_bringup trial.launch.py port:=/dev/ttyACM0 out:=DIR

Without `port` the virtual tank runs; TOWTANK_FIRMWARE must then name the folder that
`make -C firmware` builds into. Nodes and parameters stand in towtank_bringup.graph only.
"""

import atexit
import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.event_handlers import OnProcessIO
from launch.events.process import ProcessExited, ProcessIO
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node
from towtank_bringup.environment import check_ros_variables, make_runtime_folder
from towtank_bringup.graph import Graph, Item, NodeGroup, Program, told_to_all
from towtank_bringup.only_trial import only_trial
from towtank_bringup.plan import plan_trial
from towtank_bringup.processes import STOP_TIMEOUT_S
from towtank_bringup.trial_directory import TrialDirectoryError

ARGUMENTS = {
    "rig": ("nit_calicut_2012", "rig file, or name of one that comes with towtank"),
    "port": ("", "serial port of the ADC board; empty for the virtual board and tank"),
    "duration": ("", "logged time, s; empty for what the tank has room for, at most 40"),
    "beyond_tank": ("false", "virtual tank: 'true' lets the run be longer than the tank"),
    "out": ("", "new directory for the trial; empty for one named by rig and time"),
    "plant_rig": ("", "virtual tank: the plant's own rig file; empty for the rig"),
    "noise": ("rig", "virtual tank: 'rig' for sensor errors from the rig's budget, or 'none'"),
    "seed": ("1", "virtual tank: seed of the sensor errors"),
    "sensor_faults": ("", "virtual tank: broken sensors and wires, CHANNEL:KIND@START[-STOP],…"),
}
CHOICES = {"noise": ["rig", "none"], "beyond_tank": ["true", "false"]}
ENVIRONMENT = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONUTF8": "1",
}
"""What the script `towtank` sets too, unless it is set otherwise; it says why."""


def ended(event: ProcessExited, context: LaunchContext) -> None:
    """A process has ended: if it is the first to do so, the trial has failed.

    An exception is what gives `ros2 launch` its exit status; it stops the others all the same.
    """
    if not context.is_shutdown:
        raise RuntimeError(
            f"{event.process_name} ended with status {event.returncode}: see what it said above"
        )


def conducted(event: ProcessExited, context: LaunchContext) -> Shutdown | None:
    """The conductor has ended, and so does the trial."""
    if event.returncode != 0 or context.is_shutdown:
        return ended(event, context)
    return Shutdown(reason="the trial is done")


def ended_once_more(restarts: int) -> Callable[[ProcessExited, LaunchContext], None]:
    """As `ended`, for a process that launch starts again so often; the rest is the conductor's."""
    left = restarts

    def on_exit(event: ProcessExited, context: LaunchContext) -> None:
        nonlocal left
        left -= 1
        if left < 0:
            ended(event, context)

    return on_exit


def action_of(item: Item) -> ExecuteProcess:
    """The launch action that starts an item of the graph."""
    ending = {"on_exit": ended, "sigterm_timeout": str(STOP_TIMEOUT_S)}
    if isinstance(item, Program):
        return ExecuteProcess(cmd=list(item.command), name=item.name, **ending)
    if isinstance(item, NodeGroup):
        if item.restarts:
            ending |= {
                "on_exit": ended_once_more(item.restarts),
                "respawn": True,
                "respawn_max_retries": item.restarts,
            }
        return Node(
            package=item.package, executable=item.executable, parameters=[item.parameters], **ending
        )
    kind = LifecycleNode if item.lifecycle else Node
    return kind(
        package=item.package,
        executable=item.executable,
        namespace=item.namespace,
        name=item.name,
        parameters=[item.parameters],
        **ending,
    )


def in_order(graph: Graph) -> list:
    """The actions that start the graph; what comes after a Program waits until that is ready."""
    if not graph:
        return []
    item, *others = graph
    action, following = action_of(item), in_order(others)
    if not isinstance(item, Program):
        return [action, *following]

    def on_stdout(event: ProcessIO) -> list:
        lines = event.text.decode(errors="replace").splitlines()
        if not any(line.startswith(item.ready_line) for line in lines):
            return []
        starting = following.copy()
        following.clear()
        return starting

    return [RegisterEventHandler(OnProcessIO(target_action=action, on_stdout=on_stdout)), action]


def trial(context: LaunchContext) -> list:
    """The graph's actions, and the conductor's, with the arguments as they are now."""
    value = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    check_ros_variables()
    runtime = make_runtime_folder()
    # Run when `ros2 launch` ends: all processes have ended then.
    atexit.register(shutil.rmtree, runtime, ignore_errors=True)
    planned = plan_trial(
        rig=value["rig"],
        port=Path(value["port"]) if value["port"] else None,
        duration=number(float, "duration", value) if value["duration"] else None,
        beyond_tank=value["beyond_tank"] == "true",
        out=Path(value["out"]) if value["out"] else None,
        plant_rig=value["plant_rig"] or None,
        noise=value["noise"],
        seed=number(int, "seed", value),
        sensor_faults=value["sensor_faults"],
        runtime=runtime,
    )
    trial_of_the_domain = contextlib.ExitStack()
    trial_of_the_domain.enter_context(only_trial(planned.graph))
    atexit.register(trial_of_the_domain.close)
    try:
        planned.directory.create()
    except TrialDirectoryError as error:
        raise TrialDirectoryError(f"{error}: give a new one with out:=") from error
    atexit.register(planned.directory.abandon)
    conductor = Node(
        package="towtank_bringup",
        executable="conduct",
        arguments=[
            *("--rig", value["rig"]),
            *(("--duration", value["duration"]) if value["duration"] else ()),
            *(("--beyond-tank",) if value["beyond_tank"] == "true" else ()),
            *("--out", str(planned.directory.path), "--runtime", str(runtime)),
            *("--clock-offset-ns", str(told_to_all(planned.graph)["clock_offset_ns"])),
            *(("--port", value["port"]) if value["port"] else ()),
        ],
        output="screen",
        on_exit=conducted,
        sigterm_timeout=str(STOP_TIMEOUT_S),
    )
    # The conductor comes first: launch would take a graph that does not come up for a done one.
    return [conductor, *in_order(planned.graph)]


def number(kind: type, name: str, value: dict[str, str]) -> float:
    """The argument's number. ValueError, naming the argument, if it is none."""
    try:
        return kind(value[name])
    except ValueError as error:
        wanted = "a whole number" if kind is int else "a number"
        raise ValueError(f"{name}:={value[name]}: give {wanted}") from error


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` runs."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(
                    name,
                    default_value=default,
                    description=description,
                    choices=CHOICES.get(name),
                )
                for name, (default, description) in ARGUMENTS.items()
            ),
            *(
                SetEnvironmentVariable(name, EnvironmentVariable(name, default_value=default))
                for name, default in ENVIRONMENT.items()
            ),
            OpaqueFunction(function=trial),
        ]
    )
