# SPDX-License-Identifier: Apache-2.0
"""Names of the graph: where values come from, parts of the tow, joints, frames and nodes."""

from __future__ import annotations

MEASURED = "measured"
TWIN = "twin"
PLANT = "plant"
"""Where a value comes from: the sensors, the twin, the plant of a virtual tank. Each is the first
part of its topics' names, too."""

FISH = "fish"
DEPRESSOR = "depressor"
BODIES = (FISH, DEPRESSOR)
"""What hangs below the junction: parts of topics' names, and frames."""

CRANK_JOINT = "crank"
CARRIAGE_JOINT = "carriage"
TOW_POINT_JOINT = "tow_point"
"""Joints of joint_states: the crank turns (rad), carriage and tow point slide (m)."""

TANK_FRAME = "tank"
CRANK_FRAME = "crank"
BOARD_FRAME = "adc_board"
CRANK_DRIVE_FRAME = "crank_drive"
ACCELEROMETER_FRAME = "accelerometer"
"""Frames of messages, besides those of the bodies; a pressure sensor's is the sensor's name."""

CONDUCTOR_NODE = "/conductor"
RECORDER_NODE = "/recorder"
COMPARISON_NODE = "/comparison"
BOARD_NODE = f"/{MEASURED}/adc_board"
CRANK_DRIVE_NODE = f"/{MEASURED}/crank_drive"
ENCODER_NODE = f"/{MEASURED}/encoder"
INCLINOMETER_NODE = f"/{MEASURED}/{FISH}/inclinometer"
TWIN_NODE = f"/{TWIN}/simulator"
PLANT_NODE = f"/{PLANT}/simulator"
BENCH_NODE = f"/{PLANT}/bench"


def pressure_node(body: str) -> str:
    """Full name of the node of a body's pressure sensor."""
    return f"/{MEASURED}/{body}/pressure_sensor"


def split_name(full_name: str) -> tuple[str, str]:
    """Namespace and name of a node, by its full name."""
    namespace, _, name = full_name.rpartition("/")
    return namespace or "/", name
