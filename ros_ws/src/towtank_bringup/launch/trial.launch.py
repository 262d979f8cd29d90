# SPDX-License-Identifier: Apache-2.0
"""A whole trial in a native ROS 2 Jazzy: the same graph that `towtank trial` starts.

    ros2 launch towtank_bringup trial.launch.py rig:=nit_calicut_2012 duration:=40 out:=DIR
    ros2 launch towtank_bringup trial.launch.py port:=/dev/ttyACM0 out:=DIR

Without `port` the virtual tank runs; TOWTANK_FIRMWARE must then name the folder that
`make -C firmware` builds into. Nodes and parameters stand in towtank_bringup.graph only.
"""

import tempfile
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node
from towtank_bringup.graph import Program, RosNode
from towtank_bringup.plan import plan_trial

ARGUMENTS = {
    "rig": ("nit_calicut_2012", "rig file, or name of one that comes with towtank"),
    "port": ("", "serial port of the ADC board; empty for the virtual board and tank"),
    "duration": ("40.0", "logged time, s"),
    "out": ("", "new directory for the trial; empty for one named by rig and time"),
    "noise": ("rig", "virtual tank: 'rig' for sensor errors from the rig's budget, or 'none'"),
    "seed": ("1", "virtual tank: seed of the sensor errors"),
}


def action_of(item: RosNode | Program):
    """The launch action that starts an item of the graph; the trial ends with any of them."""
    if isinstance(item, Program):
        return ExecuteProcess(cmd=list(item.command), name=item.name, on_exit=Shutdown())
    kind = LifecycleNode if item.lifecycle else Node
    return kind(
        package=item.package,
        executable=item.executable,
        namespace=item.namespace,
        name=item.name,
        parameters=[item.parameters],
        on_exit=Shutdown(),
    )


def trial(context: LaunchContext) -> list:
    """The graph's actions, and the conductor's, with the arguments as they are now."""
    value = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    runtime = Path(tempfile.mkdtemp(prefix="towtank-"))
    planned = plan_trial(
        rig=value["rig"],
        port=Path(value["port"]) if value["port"] else None,
        duration=float(value["duration"]),
        out=Path(value["out"]) if value["out"] else None,
        noise=value["noise"],
        seed=int(value["seed"]),
        runtime=runtime,
    )
    planned.directory.create()
    conductor = Node(
        package="towtank_bringup",
        executable="conduct",
        arguments=[
            *("--rig", value["rig"], "--duration", value["duration"]),
            *("--out", str(planned.directory.path), "--runtime", str(runtime)),
            *(("--port", value["port"]) if value["port"] else ()),
        ],
        output="screen",
        on_exit=Shutdown(),
    )
    return [action_of(item) for item in planned.graph] + [conductor]


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` runs."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=description)
                for name, (default, description) in ARGUMENTS.items()
            ),
            OpaqueFunction(function=trial),
        ]
    )
