# SPDX-License-Identifier: Apache-2.0
"""Topics of a trial, as the recorder takes them."""

from __future__ import annotations

from collections.abc import Sequence

from towtank_bag.qos_profile import OfferedQos
from towtank_bag.writer import Topic

QOS = {
    "sensor": OfferedQos("best_effort", "volatile", 50),
    "reliable": OfferedQos("reliable", "volatile", 100),
    "latched": OfferedQos("reliable", "transient_local", 100),
}
"""By the names of the graph's profiles (towtank_node.qos)."""

TRIAL_TOPICS = (
    "/measured/adc_scan towtank_interfaces/msg/AdcScan sensor",
    "/measured/fish/pressure sensor_msgs/msg/FluidPressure sensor",
    "/measured/fish/depth towtank_interfaces/msg/Depth sensor",
    "/measured/depressor/pressure sensor_msgs/msg/FluidPressure sensor",
    "/measured/depressor/depth towtank_interfaces/msg/Depth sensor",
    "/measured/fish/imu sensor_msgs/msg/Imu sensor",
    "/measured/fish/inclination towtank_interfaces/msg/Inclination sensor",
    "/measured/joint_states sensor_msgs/msg/JointState sensor",
    "/measured/crank_motion towtank_interfaces/msg/CrankMotion sensor",
    "/measured/crank_drive/state towtank_interfaces/msg/CrankDrive reliable",
    "/measured/heave_ratio towtank_interfaces/msg/HeaveRatio reliable",
    "/twin/fish/odometry nav_msgs/msg/Odometry sensor",
    "/twin/depressor/odometry nav_msgs/msg/Odometry sensor",
    "/twin/cable_state towtank_interfaces/msg/CableState sensor",
    "/twin/heave_ratio towtank_interfaces/msg/HeaveRatio reliable",
    "/plant/fish/odometry nav_msgs/msg/Odometry sensor",
    "/plant/fish/imu sensor_msgs/msg/Imu sensor",
    "/plant/depressor/odometry nav_msgs/msg/Odometry sensor",
    "/plant/joint_states sensor_msgs/msg/JointState sensor",
    "/plant/cable_state towtank_interfaces/msg/CableState sensor",
    "/trial/events towtank_interfaces/msg/TrialEvent latched",
    "/rig std_msgs/msg/String latched",
    "/diagnostics diagnostic_msgs/msg/DiagnosticArray reliable",
)
"""Everything that a trial publishes: name, type and quality of service."""

TRIAL_TOPIC_NAMES = tuple(line.split()[0] for line in TRIAL_TOPICS)


class TopicError(ValueError):
    """A line of the topic list cannot be used."""


def parse_topics(lines: Sequence[str]) -> list[Topic]:
    """Topics from lines `name package/msg/Type sensor|reliable|latched`; raises TopicError."""
    topics = []
    for line in lines:
        words = line.split()
        if len(words) != 3 or not words[0].startswith("/") or words[2] not in QOS:
            raise TopicError(
                f"topic '{line}': write it as '/name package/msg/Type {'|'.join(QOS)}'"
            )
        topics.append(Topic(words[0], words[1], QOS[words[2]]))
    names = [topic.name for topic in topics]
    for name in names:
        if names.count(name) > 1:
            raise TopicError(f"topic '{name}' is listed twice: list it once")
    return topics
