# SPDX-License-Identifier: Apache-2.0
"""The drive of the virtual tank's crank, which obeys as the board's does.

Whoever stops the crank of a real trial by `towtank crank` can practise it here: speeds, ramp and
states are those of board.yaml, an emergency stop is a trip that must be cleared. The motor is
ideal: the crank is where its ramp says. Times in s, rates in rad/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from towtank_sim.board_file import board_file
from towtank_sim.drive import Drive, DriveError

RPM = 2.0 * math.pi / 60.0
COASTING_RATE = 2.5
"""What a crank without power loses of its speed, rad/s²: friction over inertia of the motor that
the virtual board has (1 N m, 0.4 kg m²)."""
_SHORTEST_RAMP_S = 0.1


@dataclass(frozen=True)
class CrankStatus:
    """state, trip: names in board.yaml's `drive_state` and `drive_trip`; rates in rad/s."""

    state: str
    trip: str
    target_rate: float
    rate: float


class VirtualCrank:
    """Drives the crank of `drive`; times of successive calls must not decrease."""

    def __init__(self, drive: Drive) -> None:
        limits = board_file()["drive"]
        self._drive = drive
        self._slowest = limits["speed_rpm"]["minimum"] * RPM
        self._fastest = limits["speed_rpm"]["maximum"] * RPM
        self._ramp_rate = limits["ramp_rpm_per_s"] * RPM
        self._target = 0.0
        self._rest_from = 0.0
        self._trip = "none"

    def run(self, time: float, rate: float) -> None:
        """Bring the crank to a speed; DriveError where it cannot be, or after a trip."""
        if not self._slowest <= rate <= self._fastest:
            raise DriveError(
                f"the crank cannot be driven at {rate / RPM:g} rpm: give "
                f"{self._slowest / RPM:g} to {self._fastest / RPM:g} rpm"
            )
        self.follow(time, rate, self._time_to(time, rate, self._ramp_rate))

    def follow(self, time: float, rate: float, ramp_time: float) -> None:
        """Bring the crank to a speed within `ramp_time`, as the trial itself wants it.

        DriveError after a trip, unless it is to stand, which it does then.
        """
        if self._trip != "none":
            if rate == 0.0:
                return
            raise DriveError(
                f"the drive is stopped ({self._trip.replace('_', ' ')}): clear the trip"
            )
        self._to(time, rate, ramp_time)

    def stop(self, time: float) -> None:
        """Bring the crank to rest along the ramp."""
        if self._target != 0.0:
            self._to(time, 0.0, self._time_to(time, 0.0, self._ramp_rate))

    def emergency_stop(self, time: float) -> None:
        """Take the power away; the crank runs down by itself."""
        self._trip = "emergency_stop"
        self._to(time, 0.0, self._time_to(time, 0.0, COASTING_RATE))

    def clear_trip(self) -> None:
        """The crank may run again, once it is told to."""
        self._trip = "none"

    def status(self, time: float) -> CrankStatus:
        """How the drive is at `time`, not before the last call."""
        if self._trip != "none":
            state = "tripped"
        elif self._target != 0.0:
            state = "running"
        else:
            state = "stopping" if time < self._rest_from else "stopped"
        return CrankStatus(state, self._trip, self._target, self._drive.at(time).crank_rate)

    def _time_to(self, time: float, rate: float, change_per_s: float) -> float:
        change = abs(rate - self._drive.at(time).crank_rate)
        return max(change / change_per_s, _SHORTEST_RAMP_S)

    def _to(self, time: float, rate: float, ramp_time: float) -> None:
        self._target = rate
        self._rest_from = time + ramp_time
        self._drive.command_crank(time, rate, ramp_time)
