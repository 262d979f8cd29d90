# SPDX-License-Identifier: Apache-2.0
"""What the crank can do at worst in a fault, from the motor's equations and the drive's rules.

The equations are those of firmware/vboard/crank_motor.h, solved here anew. A crank that could run
away is given the lightest load there is, its friction alone: a worm gear that holds lets no tow
help it on. One that has to give itself away by its speed is given the heaviest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

RPM = 2.0 * math.pi / 60.0
"""One revolution per minute, rad/s."""
_STEP_S = 0.25e-3


@dataclass(frozen=True)
class Rules:
    """Times in s, speeds in rpm, duties from 0 to 1: `drive` of board.yaml."""

    step_s: float
    window_s: float
    ramp_rpm_per_s: float
    ceiling_standing: float
    ceiling_per_rpm: float
    start_s: float
    stall_s: float
    stall_parts: int
    overspeed_rpm: float
    overload_s: float
    rest_rpm: float
    alive_s: float
    command_timeout_s: float
    pwm_s: float
    watchdog_s: float

    def ceiling(self, rpm: float) -> float:
        """The highest duty at a speed."""
        return min(1.0, self.ceiling_standing + self.ceiling_per_rpm * max(rpm, 0.0))

    def stall(self, setpoint_rpm: float) -> float:
        """From the last movement to the trip: it is seen in steps, and so is that movement."""
        part_s = 60.0 / self.stall_parts / setpoint_rpm if setpoint_rpm > 0.0 else math.inf
        return min(part_s, self.stall_s) + 2.0 * self.step_s

    def stop(self, setpoint_rpm: float) -> float:
        """A soft stop's end, at the latest."""
        return setpoint_rpm / self.ramp_rpm_per_s + self.step_s

    @property
    def sight_s(self) -> float:
        """From a speed to the step that has measured it."""
        return self.window_s + 2.0 * self.step_s


@dataclass(frozen=True)
class Motor:
    """vb_motor of firmware/vboard/vboard.h; seen from the crank."""

    supply_v: float
    resistance_ohm: float
    inductance_h: float
    flux_v_s_a: float
    gear_ratio: float
    gear_efficiency: float
    inertia_kg_m2: float
    friction_n_m: float
    breakaway_n_m: float
    damping_n_m_s: float
    crank_radius_m: float
    rod_length_m: float
    tow_weight_n: float
    tow_drag_n_s2_m2: float
    tow_mass_kg: float

    def runaway(
        self, rpm: float, powered: Sequence[tuple[float, float]], driven_n_m: float = 0.0
    ) -> tuple[float, float]:
        """The highest speed, rpm, and the turns until rest of the crank with nothing on it.

        rpm: at the start. powered: seconds and duty, one after another; then it coasts. driven_n_m:
        a torque that turns it on until the power is off.
        """
        rate, angle = rpm * RPM, 0.0
        current = self._settled_current(powered[0][1], rate) if powered else 0.0
        fastest = rate
        stages = [*powered, (math.inf, 0.0)]
        for seconds, duty in stages:
            ends = seconds
            while ends > 0.0 and (duty > 0.0 or rate > 0.0 or current > 1e-3):
                helped = driven_n_m if math.isfinite(seconds) else 0.0
                current, rate = self._advance(current, rate, duty, -helped, self.inertia_kg_m2)
                angle += rate * _STEP_S
                fastest = max(fastest, rate)
                ends -= _STEP_S
        return fastest / RPM, angle / (2.0 * math.pi)

    def seconds_to(
        self, rpm: float, wanted_rpm: float, duty: float, driven_n_m: float = 0.0
    ) -> float:
        """Until a crank under its tow has come from one speed to another, s: under the heaviest
        load all the time, or under it for half a turn and then without."""
        heavy_s = self._seconds_to(rpm, wanted_rpm, duty, driven_n_m, tow=1.0)
        if rpm <= 0.0:
            return heavy_s
        light_s = self._seconds_to(rpm, wanted_rpm, duty, driven_n_m, tow=0.0)
        return min(heavy_s, 30.0 / rpm + light_s)

    def _seconds_to(
        self, rpm: float, wanted_rpm: float, duty: float, driven_n_m: float, tow: float
    ) -> float:
        rate, current, seconds = rpm * RPM, 0.0, 0.0
        slope = self.crank_radius_m * (1.0 + self.crank_radius_m / self.rod_length_m)
        inertia = self.inertia_kg_m2 + self.tow_mass_kg * slope**2
        while rate < wanted_rpm * RPM:
            inertial = self.tow_mass_kg * slope**2 * rate**2 / 2.0
            weight = self.tow_weight_n + self.tow_drag_n_s2_m2 * (slope * rate) ** 2
            load = tow * (slope * weight + inertial) / self.gear_efficiency
            current, rate = self._advance(current, rate, duty, load - driven_n_m, inertia)
            seconds += _STEP_S
            if seconds > 60.0:
                return math.inf
        return seconds

    def _settled_current(self, duty: float, rate: float) -> float:
        back = self.flux_v_s_a * self.gear_ratio * rate
        return duty * self.supply_v / (self.resistance_ohm + back)

    def _advance(
        self, current: float, rate: float, duty: float, load: float, inertia: float
    ) -> tuple[float, float]:
        resistance = self.resistance_ohm + self.flux_v_s_a * self.gear_ratio * rate
        final = duty * self.supply_v / resistance
        current = final + (current - final) * math.exp(-_STEP_S * resistance / self.inductance_h)
        torque = self.gear_ratio * self.flux_v_s_a * current**2
        friction = self.friction_n_m + self.damping_n_m_s * rate if rate > 0 else self.breakaway_n_m
        return current, max(rate + (torque - load - friction) / inertia * _STEP_S, 0.0)
