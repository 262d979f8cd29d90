# SPDX-License-Identifier: Apache-2.0
"""The topics of a trial: name, type and quality of service of each, stated here only.

No ROS in here: names are all that reading a bag takes, and an emergency stop waits for what is
imported. endpoints.py makes publishers and subscriptions of topics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import Any

from towtank_node.names import BODIES, CRANK_DRIVE_NODE, DEPRESSOR, FISH, MEASURED, PLANT, TWIN
from towtank_node.qos import LATCHED, RELIABLE, SENSOR, Qos


def interface(type_name: str) -> Any:
    """The class of a message or service by its name, `package/kind/Name`."""
    package, kind, name = type_name.split("/")
    return getattr(import_module(f"{package}.{kind}"), name)


@dataclass(frozen=True)
class Topic:
    """One topic. name: as ROS 2 resolves it, absolute or a part of it (see `within`).

    type_name: of its messages, `package/msg/Name`.
    """

    name: str
    type_name: str
    qos: Qos

    def within(self, *places: str) -> Topic:
        """The topic of that name below the places: `depth` within `measured` and `fish` is
        `/measured/fish/depth`."""
        return replace(self, name="/".join(("", *places, self.name)))

    def of(self, node: str) -> Topic:
        """The topic of that name below a node's full name, or `~` for the node that makes it."""
        return replace(self, name=f"{node}/{self.name}")

    @cached_property
    def type(self) -> Any:
        """Class of its messages. Imported when it is asked for: that takes its time."""
        return interface(self.type_name)


PRESSURE = Topic("pressure", "sensor_msgs/msg/FluidPressure", SENSOR)
DEPTH = Topic("depth", "towtank_interfaces/msg/Depth", SENSOR)
IMU = Topic("imu", "sensor_msgs/msg/Imu", SENSOR)
ODOMETRY = Topic("odometry", "nav_msgs/msg/Odometry", SENSOR)
"""Of a body of the tow."""

JOINT_STATES = Topic("joint_states", "sensor_msgs/msg/JointState", SENSOR)
CABLE_STATE = Topic("cable_state", "towtank_interfaces/msg/CableState", SENSOR)
HEAVE_RATIO = Topic("heave_ratio", "towtank_interfaces/msg/HeaveRatio", RELIABLE)
"""Of the whole tow."""

CRANK_DRIVE_STATE = Topic("state", "towtank_interfaces/msg/CrankDrive", RELIABLE)
"""Of the crank's drive, be it the board's or the virtual tank's."""

SCANS = Topic("adc_scan", "towtank_interfaces/msg/AdcScan", SENSOR).within(MEASURED)
FISH_PRESSURE = PRESSURE.within(MEASURED, FISH)
FISH_DEPTH = DEPTH.within(MEASURED, FISH)
DEPRESSOR_PRESSURE = PRESSURE.within(MEASURED, DEPRESSOR)
DEPRESSOR_DEPTH = DEPTH.within(MEASURED, DEPRESSOR)
FISH_IMU = IMU.within(MEASURED, FISH)
INCLINATION = Topic("inclination", "towtank_interfaces/msg/Inclination", SENSOR).within(
    MEASURED, FISH
)
MEASURED_JOINTS = JOINT_STATES.within(MEASURED)
CRANK_MOTION = Topic("crank_motion", "towtank_interfaces/msg/CrankMotion", SENSOR).within(MEASURED)
CRANK_DRIVE = CRANK_DRIVE_STATE.of(CRANK_DRIVE_NODE)
MEASURED_RATIO = HEAVE_RATIO.within(MEASURED)
TWIN_FISH = ODOMETRY.within(TWIN, FISH)
TWIN_DEPRESSOR = ODOMETRY.within(TWIN, DEPRESSOR)
TWIN_CABLES = CABLE_STATE.within(TWIN)
TWIN_RATIO = HEAVE_RATIO.within(TWIN)
PLANT_FISH = ODOMETRY.within(PLANT, FISH)
PLANT_IMU = IMU.within(PLANT, FISH)
PLANT_DEPRESSOR = ODOMETRY.within(PLANT, DEPRESSOR)
PLANT_JOINTS = JOINT_STATES.within(PLANT)
PLANT_CABLES = CABLE_STATE.within(PLANT)
EVENTS = Topic("/trial/events", "towtank_interfaces/msg/TrialEvent", LATCHED)
RIG = Topic("/rig", "std_msgs/msg/String", LATCHED)
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", RELIABLE)

DEPTHS = {body: DEPTH.within(MEASURED, body) for body in BODIES}
"""What the pressure sensors say, by body."""

TRIAL = (
    SCANS,
    FISH_PRESSURE,
    FISH_DEPTH,
    DEPRESSOR_PRESSURE,
    DEPRESSOR_DEPTH,
    FISH_IMU,
    INCLINATION,
    MEASURED_JOINTS,
    CRANK_MOTION,
    CRANK_DRIVE,
    MEASURED_RATIO,
    TWIN_FISH,
    TWIN_DEPRESSOR,
    TWIN_CABLES,
    TWIN_RATIO,
    PLANT_FISH,
    PLANT_IMU,
    PLANT_DEPRESSOR,
    PLANT_JOINTS,
    PLANT_CABLES,
    EVENTS,
    RIG,
    DIAGNOSTICS,
)
"""Everything that a trial publishes, and its bag holds."""
