# SPDX-License-Identifier: Apache-2.0
"""Reading of serialised messages, against rclpy's own serialisation."""

from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from towtank_sim.serialised import SerialisedError, read_imu, read_joints, read_odometry

# Names of every length: what follows a string moves with it.
names = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=20)
numbers = st.floats(allow_nan=False, allow_infinity=False)


def three(draw):
    return draw(numbers), draw(numbers), draw(numbers)


def stamped(message, frame_id):
    message.header.stamp.sec, message.header.stamp.nanosec = 1_700_000_000, 987_654_321
    message.header.frame_id = frame_id
    return message


STAMP = 1_700_000_000_987_654_321


def set_vector(vector, values):
    vector.x, vector.y, vector.z = values


@given(frame=names, child=names, data=st.data())
def test_odometry(frame, child, data):
    message = stamped(Odometry(child_frame_id=child), frame)
    position, linear, angular = (three(data.draw) for _ in range(3))
    quaternion = tuple(data.draw(numbers) for _ in range(4))
    set_vector(message.pose.pose.position, position)
    set_vector(message.twist.twist.linear, linear)
    set_vector(message.twist.twist.angular, angular)
    orientation = message.pose.pose.orientation
    orientation.w, orientation.x, orientation.y, orientation.z = quaternion
    message.pose.covariance[35] = 7.0
    read = read_odometry(serialize_message(message))
    assert read == (STAMP, position, quaternion, linear, angular)


@given(frame=names, data=st.data())
def test_imu(frame, data):
    message = stamped(Imu(), frame)
    force = three(data.draw)
    set_vector(message.linear_acceleration, force)
    message.orientation.x = 3.0
    message.angular_velocity_covariance[8] = 5.0
    assert read_imu(serialize_message(message)) == (STAMP, force)


@given(frame=names, joints=st.dictionaries(names, numbers, max_size=4))
def test_joints(frame, joints):
    message = stamped(JointState(name=list(joints)), frame)
    message.position = array("d", joints.values())
    message.velocity = array("d", joints.values())
    assert read_joints(serialize_message(message)) == (STAMP, joints)


def test_other_encodings_are_refused():
    data = bytearray(serialize_message(Imu()))
    data[1] = 0  # big-endian
    with pytest.raises(SerialisedError, match="little-endian"):
        read_imu(bytes(data))
