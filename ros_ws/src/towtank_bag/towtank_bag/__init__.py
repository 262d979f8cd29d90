# SPDX-License-Identifier: Apache-2.0
"""Recorder and reader of MCAP bags in the directory layout of rosbag2.

`writer` and `reader` work without ROS; `recorder` is the node.
"""
