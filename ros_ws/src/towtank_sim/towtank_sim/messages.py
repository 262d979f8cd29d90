# SPDX-License-Identifier: Apache-2.0
"""States of the tow as ROS messages.

Each writer owns one message and fills it anew: at 100 Hz making messages would cost more than
filling them.
"""

from __future__ import annotations

import math
from array import array

from geometry_msgs.msg import Point, Quaternion, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from towtank_interfaces.msg import CableState
from towtank_node.names import CARRIAGE_JOINT, CRANK_JOINT, TANK_FRAME
from towtank_node.stamps import set_stamp

from towtank_sim import axes
from towtank_sim.tow import BodyState, LineShapes, PointState


def _set_vector(vector: Vector3 | Point, values: axes.Vector) -> None:
    vector.x, vector.y, vector.z = values


def _set_quaternion(quaternion: Quaternion, values: axes.Quaternion) -> None:
    quaternion.w, quaternion.x, quaternion.y, quaternion.z = values


class OdometryWriter:
    """Pose in the tank frame, twist in the body's own axes."""

    def __init__(self, child_frame: str) -> None:
        self._message = Odometry(child_frame_id=child_frame)
        self._message.header.frame_id = TANK_FRAME

    def body(self, stamp: int, state: BodyState) -> Odometry:
        """Fill in a body's state."""
        message = self._message
        set_stamp(message.header.stamp, stamp)
        _set_vector(message.pose.pose.position, state.position)
        _set_quaternion(message.pose.pose.orientation, state.quaternion)
        _set_vector(message.twist.twist.linear, state.velocity_in_body)
        _set_vector(message.twist.twist.angular, state.angular_velocity)
        return message

    def point(self, stamp: int, state: PointState) -> Odometry:
        """Fill in a point's state; its axes are the tank's."""
        message = self._message
        set_stamp(message.header.stamp, stamp)
        _set_vector(message.pose.pose.position, state.position)
        _set_vector(message.twist.twist.linear, state.velocity)
        return message


class ImuWriter:
    """Specific force and angular velocity in body axes, with the body's true attitude."""

    def __init__(self, frame: str) -> None:
        self._message = Imu()
        self._message.header.frame_id = frame

    def fill(self, stamp: int, state: BodyState, specific_force: axes.Vector) -> Imu:
        """Fill in a body's state; specific_force: m/s², body axes."""
        message = self._message
        set_stamp(message.header.stamp, stamp)
        _set_quaternion(message.orientation, state.quaternion)
        _set_vector(message.angular_velocity, state.angular_velocity)
        _set_vector(message.linear_acceleration, specific_force)
        return message


class JointStateWriter:
    """Crank angle (rad) and carriage position (m) with their rates."""

    def __init__(self) -> None:
        # Efforts are not simulated, but not all readers of bags take an empty sequence at the end.
        self._message = JointState(name=[CRANK_JOINT, CARRIAGE_JOINT], effort=[math.nan, math.nan])

    def fill(
        self,
        stamp: int,
        crank_angle: float,
        crank_rate: float,
        carriage_position: float,
        carriage_speed: float,
    ) -> JointState:
        message = self._message
        set_stamp(message.header.stamp, stamp)
        message.position = array("d", (crank_angle, carriage_position))
        message.velocity = array("d", (crank_rate, carriage_speed))
        return message


class CableStateWriter:
    """Shape and tension of all lines."""

    def __init__(self) -> None:
        self._message = CableState()
        self._message.header.frame_id = TANK_FRAME

    def fill(self, stamp: int, shapes: LineShapes) -> CableState:
        message = self._message
        set_stamp(message.header.stamp, stamp)
        message.line_names = list(shapes.names)
        message.segment_counts = array("I", shapes.segments)
        message.x = array("d", shapes.x)
        message.y = array("d", shapes.y)
        message.z = array("d", shapes.z)
        message.tension = array("d", shapes.tension)
        return message
