# SPDX-License-Identifier: Apache-2.0
"""How the conductor judges what it hears."""

from __future__ import annotations

import pytest
import rclpy
from sensor_msgs.msg import JointState
from towtank_bringup.conductor import Conductor, TrialError
from towtank_node.qos import SENSOR_QOS


@pytest.fixture
def context(monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    context.try_shutdown()


def test_a_drive_that_is_not_heard_is_not_steady(context):
    """The encoder falls silent before the drive has run steadily for long enough."""
    said = []

    def watch():
        if len(said) < 20:
            joints = JointState(name=["crank", "carriage"], velocity=[3.0, 1.0])
            publisher.publish(joints)
            said.append(joints)

    conductor = Conductor((), watch, context=context)
    publisher = conductor.create_publisher(JointState, "/measured/joint_states", SENSOR_QOS)
    with pytest.raises(TrialError, match="steady run at crank 3, carriage 1: not within 8 s"):
        conductor.wait_for_steady_drive({"crank": 3.0, "carriage": 1.0}, 0.03, 4.0, 8.0)
    assert len(said) == 20
    conductor.close()
