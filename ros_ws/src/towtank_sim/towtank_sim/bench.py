# SPDX-License-Identifier: Apache-2.0
"""The virtual bench: what the plant's true state does to the sensors and encoders.

Only systematic errors are made here. White noise is the virtual board's: it belongs to single
conversions, and noise on bench frames would be thinned by the board's interpolation between them
and by its analog low-pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder, pressure_from_depth
from towtank_uncertainty.sensor_errors import PressureSensorErrors, SensorErrors

from towtank_sim.axes import Quaternion, Vector, add, cross, to_tank
from towtank_sim.terminal_faults import EXCITATION, TerminalFault, TerminalFaults

Array = NDArray[np.float64]

# A sensor's zero drifts with the temperature of water and housing. The rig's limit is for the few
# minutes of a run; the bench lets it come about evenly over this time from its start, s.
DRIFT_TIME = 300.0


class BenchError(ValueError):
    """The rig and the board do not fit together."""


class TrueState(NamedTuple):
    """What the bench needs of the plant, at one instant or (arrays as components) at many.

    time: s since the plant's start; positions: m, tank axes; fish_velocity, fish_angular_velocity,
    specific_force: body axes (m/s, rad/s, m/s²); depressor_velocity: tank axes, m/s.
    """

    time: float | Array
    crank_angle: float | Array
    carriage_position: float | Array
    fish_position: Vector
    fish_quaternion: Quaternion
    fish_velocity: Vector
    fish_angular_velocity: Vector
    specific_force: Vector
    depressor_position: Vector
    depressor_velocity: Vector


class Bench:
    """The rig's sensors with one realisation of their errors.

    channels: names of the board's channels in the order of the bench frame. faults: of sensors and
    wires. Raises BenchError if the rig names other channels, FaultError if a fault does.
    """

    def __init__(
        self,
        rig: Rig,
        errors: SensorErrors,
        channels: Sequence[str],
        faults: Sequence[TerminalFault] = (),
    ) -> None:
        if tuple(rig.board.channels) != tuple(channels):
            raise BenchError(
                f"the rig's board.channels are {', '.join(rig.board.channels)}, the board's are "
                f"{', '.join(channels)}: make them the same, in the same order"
            )
        sensors = rig.sensors
        self._rig = rig
        self._errors = errors
        self._fish_port = sensors.fish_pressure.position.value
        self._depressor_port = sensors.depressor_pressure.position.value
        self._crank = crank_encoder(rig)
        self._carriage = carriage_encoder(rig)
        accelerometer = sensors.accelerometer.channels
        self._index = {name: channels.index(name) for name in channels}
        self._faults = TerminalFaults(faults, rig, channels)
        self._accelerometer = [
            self._index[name] for name in (accelerometer.x, accelerometer.y, accelerometer.z)
        ]

    def terminal_volts(self, state: TrueState) -> Array:
        """Return the volts at the terminals in channel order, shape (…, channels).

        At a pressure port: hydrostatic pressure, zero above water, and Cp·½ρU² with the port's own
        speed through the still water.
        """
        errors = self._errors
        sensors = self._rig.sensors
        drift = np.minimum(np.asarray(state.time) / DRIFT_TIME, 1.0)
        fish_port = add(state.fish_position, to_tank(state.fish_quaternion, self._fish_port))
        fish_port_velocity = add(
            state.fish_velocity, cross(state.fish_angular_velocity, self._fish_port)
        )
        depressor_port = add(state.depressor_position, self._depressor_port)
        volts = np.empty((*np.shape(state.time), len(self._index)))
        volts[..., self._index[sensors.fish_pressure.channel]] = self._bridge_volts(
            errors.fish_pressure, fish_port, fish_port_velocity, drift
        )
        volts[..., self._index[sensors.depressor_pressure.channel]] = self._bridge_volts(
            errors.depressor_pressure, depressor_port, state.depressor_velocity, drift
        )
        volts[..., self._accelerometer] = errors.accelerometer.volts(
            np.stack(state.specific_force, axis=-1)
        )
        volts[..., self._index[EXCITATION]] = errors.excitation
        return self._faults.apply(state.time, volts)

    def _bridge_volts(
        self, sensor: PressureSensorErrors, port: Vector, velocity: Vector, drift: Array
    ) -> Array:
        u, v, w = velocity
        return sensor.volts(
            pressure_from_depth(-np.asarray(port[2]), self._rig.water),
            speed=np.sqrt(u * u + v * v + w * w),
            drift=drift,
            excitation=self._errors.excitation,
        )

    def encoder_angles(self, state: TrueState) -> tuple[Array, Array]:
        """Return the angles of the crank's and the measuring wheel's encoder shafts, rad.

        They turn backwards where the rig says that the encoder counts so.
        """
        return (
            self._crank.shaft_angle(state.crank_angle),
            self._carriage.shaft_angle(state.carriage_position),
        )
