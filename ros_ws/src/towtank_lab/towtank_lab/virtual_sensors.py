# SPDX-License-Identifier: Apache-2.0
"""What the virtual board's terminals see at a step of a calibration: a stand-in for the water, the
levelled table, the crank and the carriage."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder, pressure_from_depth
from towtank_uncertainty.sensor_errors import SensorErrors

from towtank_lab.accelerometer_calibration import specific_force


class VirtualSensors:
    """The rig's sensors with one realisation of their errors, at rest where the last step put them.

    channels: names of the board's channels in their order.
    """

    def __init__(self, rig: Rig, errors: SensorErrors, channels: tuple[str, ...]) -> None:
        self._rig = rig
        self._errors = errors
        self._channels = channels
        self._depth = 0.0
        self._attitude = (0.0, 0.0)
        self._crank = 0.0
        self._carriage = 0.0

    def move(self, step: Mapping[str, float]) -> None:
        """Go where a step says: `depth_m`, `roll_deg` and `pitch_deg`, `angle_deg`, `travel_m`."""
        self._depth = step.get("depth_m", self._depth)
        if "roll_deg" in step:
            self._attitude = (math.radians(step["roll_deg"]), math.radians(step["pitch_deg"]))
        if "angle_deg" in step:
            self._crank = math.radians(step["angle_deg"])
        self._carriage = step.get("travel_m", self._carriage)

    def terminal_volts(self) -> list[float]:
        """Return the volts at the terminals in channel order."""
        sensors, errors = self._rig.sensors, self._errors
        pressure = pressure_from_depth(self._depth, self._rig.water)
        force = specific_force(*self._attitude, self._rig.water.gravity.value)
        axes = sensors.accelerometer.channels
        volts = dict(zip((axes.x, axes.y, axes.z), errors.accelerometer.volts(force), strict=True))
        for sensor in ("fish_pressure", "depressor_pressure"):
            volts[getattr(sensors, sensor).channel] = getattr(errors, sensor).volts(
                pressure, drift=0.0, excitation=errors.excitation
            )
        volts["excitation"] = np.float64(errors.excitation)
        return [float(volts[name]) for name in self._channels]

    def crank_shaft(self) -> float:
        """Return the angle of the crank encoder's shaft in its counting sense, rad."""
        return float(crank_encoder(self._rig).shaft_angle(self._crank))

    def carriage_shaft(self) -> float:
        """Return the angle of the carriage encoder's shaft in its counting sense, rad."""
        return float(carriage_encoder(self._rig).shaft_angle(self._carriage))
