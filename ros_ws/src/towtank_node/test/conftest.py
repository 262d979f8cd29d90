# SPDX-License-Identifier: Apache-2.0
"""A ROS context of each test's own."""

import pytest
import rclpy


@pytest.fixture
def context():
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)
