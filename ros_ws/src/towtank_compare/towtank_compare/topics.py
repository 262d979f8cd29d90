# SPDX-License-Identifier: Apache-2.0
"""Topics that the comparison reads, by source."""

CRANK = "/measured/joint_states"
CRANK_JOINT = "crank"
CARRIAGE_JOINT = "carriage"

MEASURED_FISH = "/measured/fish/depth"
MEASURED_DEPRESSOR = "/measured/depressor/depth"
INCLINATION = "/measured/fish/inclination"


def fish_odometry(source: str) -> str:
    """Topic of the simulated fish; source is `twin` or `plant`."""
    return f"/{source}/fish/odometry"


def depressor_odometry(source: str) -> str:
    """Topic of the simulated depressor; source is `twin` or `plant`."""
    return f"/{source}/depressor/odometry"


def heave_ratio(source: str) -> str:
    """Topic of the live results."""
    return f"/{source}/heave_ratio"
