# SPDX-License-Identifier: Apache-2.0
"""The virtual carriage and crank: speeds that follow commands along smooth ramps.

Time is in s, carriage positions in m along the run, crank angles in rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from towtank_rig import Rig


class DriveError(ValueError):
    """A drive command that the carriage or the crank cannot follow."""


class DriveCommand(BaseModel):
    """Bring the carriage and the crank to a speed within `ramp_time`.

    The carriage runs forwards only: a tow pulled backwards runs into its own lines.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="forbid")

    carriage_speed: float = Field(ge=0.0, le=20.0)  # m/s
    crank_rate: float = Field(ge=-50.0, le=50.0)  # rad/s
    ramp_time: float = Field(ge=0.1, le=600.0)  # s


def drive_command(carriage_speed: float, crank_rate: float, ramp_time: float) -> DriveCommand:
    """Return the command; DriveError, in one line, if a value is out of its limits."""
    try:
        return DriveCommand(
            carriage_speed=carriage_speed, crank_rate=crank_rate, ramp_time=ramp_time
        )
    except ValidationError as error:
        fault = error.errors()[0]
        raise DriveError(
            f"{fault['loc'][0]} {fault['input']:g}: {fault['msg'].replace('Input', 'it')}"
        ) from error


TimedCommand = tuple[float, DriveCommand]
"""A command and the time (s) from which it holds."""


@dataclass(frozen=True)
class SpeedRamp:
    """Motion of one axis since its last command.

    The speed goes from the start speed v0 to the target v1 on a raised cosine,
    v = v0 + (v1 − v0)·(1 − cos πτ)/2 with τ = (t − start)/duration. A command that comes in the
    middle of a ramp finds an acceleration a0; the term a0·duration·τ(1 − τ)² leads it to zero, so
    that speed and acceleration never jump.
    """

    start: float = 0.0
    duration: float = 1.0
    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0
    target: float = 0.0

    def at(self, time: float) -> tuple[float, float, float]:
        """Return position, speed and acceleration at `time` (not before `start`).

        The position is the exact integral of the speed.
        """
        elapsed = time - self.start
        length = self.duration
        change = self.target - self.speed
        tau = min(elapsed / length, 1.0)
        carried = self.acceleration * length
        position = self.position + length * (
            self.speed * tau
            + change * (tau / 2 - math.sin(math.pi * tau) / (2 * math.pi))
            + carried * tau * tau * (1 / 2 - tau * (2 / 3 - tau / 4))
        )
        if tau == 1.0:
            return position + self.target * (elapsed - length), self.target, 0.0
        speed = (
            self.speed + change * (1 - math.cos(math.pi * tau)) / 2 + carried * tau * (1 - tau) ** 2
        )
        acceleration = change * math.pi / 2 * math.sin(
            math.pi * tau
        ) / length + self.acceleration * (1 - tau) * (1 - 3 * tau)
        return position, speed, acceleration

    def then(self, time: float, target: float, duration: float) -> SpeedRamp:
        """Return the motion from `time` on, under a new command."""
        position, speed, acceleration = self.at(time)
        return SpeedRamp(time, duration, position, speed, acceleration, target)


@dataclass(frozen=True)
class DriveState:
    """Crank (rad, rad/s) and carriage (m, m/s) at one instant."""

    crank_angle: float
    crank_rate: float
    carriage_position: float
    carriage_speed: float


class Drive:
    """Carriage and crank, at rest at position and angle zero until the first command."""

    def __init__(self) -> None:
        self._carriage = SpeedRamp()
        self._crank = SpeedRamp()

    def command_carriage(self, time: float, speed: float, ramp_time: float) -> None:
        """Bring the carriage to a speed, m/s, from `time` on: not before its last command."""
        self._carriage = self._carriage.then(time, speed, ramp_time)

    def command_crank(self, time: float, rate: float, ramp_time: float) -> None:
        """Bring the crank to a rate, rad/s, from `time` on: not before its last command."""
        self._crank = self._crank.then(time, rate, ramp_time)

    def at(self, time: float) -> DriveState:
        """Return the state at `time`, which must not lie before the last command."""
        crank_angle, crank_rate, _ = self._crank.at(time)
        carriage_position, carriage_speed, _ = self._carriage.at(time)
        return DriveState(crank_angle, crank_rate, carriage_position, carriage_speed)


def trial_commands(rig: Rig, rest: float, steady: float) -> Sequence[TimedCommand]:
    """Return the commands of one run: at rest, up to the rig's speeds, steady, stop.

    rest: time at rest before the ramp, s; steady: time at full speed, s. Both ramps take the
    rig's `run.ramp_time`.
    """
    ramp = rig.run.ramp_time.value
    go = drive_command(rig.run.carriage_speed.value, rig.run.crank_rate.value, ramp)
    return (rest, go), (rest + ramp + steady, drive_command(0.0, 0.0, ramp))
