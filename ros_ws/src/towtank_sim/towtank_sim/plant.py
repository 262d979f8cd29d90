# SPDX-License-Identifier: Apache-2.0
"""The plant: the simulated tow behind the virtual carriage and crank, in place of the tank."""

from __future__ import annotations

from towtank_rig import Rig

from towtank_sim.axes import Vector
from towtank_sim.drive import Drive, DriveCommand, DriveState
from towtank_sim.tow import BodyState, LineShapes, PointState, Tow, specific_force
from towtank_sim.tow_point import TowPoint
from towtank_sim.virtual_crank import VirtualCrank

CYCLE_NS = 10_000_000
"""The plant's states lie at multiples of this time, ns."""


class Plant:
    """Starts at rest at time zero and goes on cycle by cycle.

    segments: of all lines, see `towtank_sim.model.segment_counts`; step: longest time step, s.
    """

    def __init__(self, rig: Rig, segments: int, step: float) -> None:
        self._tow = Tow(rig, segments, step)
        self._tow_point = TowPoint(rig)
        self._drive = Drive()
        self.crank = VirtualCrank(self._drive)
        self._accelerometer = rig.sensors.accelerometer.position.value
        self._gravity = rig.water.gravity.value
        self._cycles = 0
        self._tow.start(*self._tow_point.at(self.drive()))

    @property
    def time_ns(self) -> int:
        """Time of the present state, ns."""
        return self._cycles * CYCLE_NS

    @property
    def time(self) -> float:
        """Time of the present state, s."""
        return self.time_ns * 1e-9

    def command(self, command: DriveCommand) -> None:
        """Follow `command` from the present state on.

        DriveError if the crank should turn and its drive has tripped.
        """
        self.crank.follow(self.time, command.crank_rate, command.ramp_time)
        self._drive.command_carriage(self.time, command.carriage_speed, command.ramp_time)

    def advance(self) -> None:
        """Go on by one cycle."""
        self._cycles += 1
        self._tow.step_to(self.time, *self._tow_point.at(self.drive()))

    def drive(self) -> DriveState:
        return self._drive.at(self.time)

    def fish(self) -> BodyState:
        return self._tow.fish()

    def depressor(self) -> PointState:
        return self._tow.depressor()

    def line_shapes(self) -> LineShapes:
        return self._tow.line_shapes()

    def top_tension(self) -> float:
        """Tension at the tow point, N."""
        return self._tow.top_tension()

    def specific_force(self, fish: BodyState) -> Vector:
        """Return what the fish's accelerometer should measure, m/s², body axes."""
        return specific_force(fish, self._accelerometer, self._gravity)
