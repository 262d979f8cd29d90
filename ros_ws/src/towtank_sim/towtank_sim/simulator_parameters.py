# SPDX-License-Identifier: Apache-2.0
"""Parameters that the simulator has in both of its roles."""

from towtank_node.parameters import Parameter

from towtank_sim import resolution

RIG = Parameter("rig", str, "path of the rig file (YAML)")
SEGMENTS = Parameter(
    "segments",
    int,
    "segments of all lines together, shared out in proportion to the lines' lengths with at least "
    "two each; 0: the rig file's own numbers",
    default=resolution.SEGMENTS,
    minimum=0,
    maximum=2000,
)
STEP = Parameter(
    "step_s",
    float,
    "longest time step of the simulation, s",
    default=resolution.STEP,
    minimum=0.0001,
    maximum=0.01,
)
