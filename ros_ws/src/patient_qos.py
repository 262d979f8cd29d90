# SPDX-License-Identifier: Apache-2.0
"""How a test listens to a stream: on a busy machine it is held up, and must miss nothing."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

PATIENT_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=5000,  # more than comes at 100 Hz in the 30 s that a test waits for something
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
"""SENSOR_QOS, whose publishers it fits, but deeper."""
