# SPDX-License-Identifier: Apache-2.0
"""The tow point's place and velocity, from crank and carriage."""

from __future__ import annotations

from towtank_rig import Rig
from towtank_rig.motion import tow_point_motion

from towtank_sim.axes import Vector
from towtank_sim.drive import DriveState


class TowPoint:
    """The upper end of the primary line: carried along x by the carriage, along z by the crank."""

    def __init__(self, rig: Rig) -> None:
        self._motion = tow_point_motion(rig.tow_point)

    def at(self, drive: DriveState) -> tuple[Vector, Vector]:
        """Return position (m) and velocity (m/s) in the tank frame."""
        height = float(self._motion.height(drive.crank_angle))
        heave_speed = float(self._motion.slope(drive.crank_angle)) * drive.crank_rate
        return (drive.carriage_position, 0.0, height), (drive.carriage_speed, 0.0, heave_speed)
