# SPDX-License-Identifier: Apache-2.0
"""The error of a depth by appendix III of P. P. Lalu's thesis, and what that leaves out.

The thesis takes the tolerance of the span, 80 ± 1 mV, on 2.2 m of water at 9800 N/m³, and no more:
1 mV · 21.56 kPa/50 kPa = 0.431 mV of 80 mV, 0.2695 kPa, 27.5 mm; it prints 2.74 cm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from towtank_rig.conversion import depth_from_pressure, flow_pressure
from towtank_rig.loading import replaced
from towtank_rig.schema import Rig

from towtank_uncertainty.depth_budget import OperatingPoint, depth_budget

DEPTH = 2.2  # m
PRINTED = 0.0274  # m
_SPAN = 0.080  # V
_TOLERANCE = 0.001  # V
_DENSITY, _GRAVITY = 1000.0, 9.8

_ATMOSPHERE = 101_325.0  # Pa
_KELVIN = 273.15
_SHARE_OF_EXCITATION = 0.01


@dataclass(frozen=True)
class AppendixThree:
    """At DEPTH, in m, for the fish's pressure sensor without calibration; k = 1 unless said.

    Attributes:
        span_tolerance: The thesis's figure: the limit that the tolerance of its span sets.
        span: What the span's tolerance in the rig makes.
        left_out: The same of all else that zeroing leaves, by the errors' names, largest first.
        zero_offset: What zeroing takes away.
        combined: Of a zeroed depth.
        u95: Half its 95 % interval.
        weight_of_water: By how much 9800 N/m³ in the place of the rig's own misjudges the depth.
        velocity_head: Flow's pressure at the rig's towing speed for Cp = 1.
        excitation: What 1 % of excitation makes of it where the ADC's reference is not derived
            from it (a ratiometric measurement does not feel it).
        unvented: What each kelvin makes of it in a capsule without a vent, whose air warms up.
    """

    span_tolerance: float
    span: float
    left_out: Mapping[str, float]
    zero_offset: float
    combined: float
    u95: float
    weight_of_water: float
    velocity_head: float
    excitation: float
    unvented: float


def appendix_three(rig: Rig) -> AppendixThree:
    """Return the thesis's figure, by the budget that all else is worked out with, and the rest."""
    bare = replaced(rig, {"calibrations": {}})
    thesis = replaced(
        bare,
        {
            "water.density": {"value": f"{_DENSITY} kg/m^3"},
            "water.gravity": {"value": f"{_GRAVITY} m/s^2"},
            "sensors.fish_pressure.span": {"value": f"{_SPAN} V"},
            "sensors.fish_pressure.errors.span": {"value": _TOLERANCE / _SPAN},
        },
    )
    speed = rig.run.carriage_speed.value
    at = OperatingPoint(mean_depth=DEPTH, amplitude=1.0, speed=speed)
    theirs = {c.name: c.depth for c in depth_budget(thesis, "fish_pressure", at).components}
    budget = depth_budget(bare, "fish_pressure", at)
    own = {c.name: c.depth for c in budget.components if c.depth > 0.0}
    span = own.pop("span", 0.0)
    offsets = (c.absolute_depth for c in budget.components if c.effect == "zero_offset")
    water = rig.water
    return AppendixThree(
        span_tolerance=math.sqrt(3.0) * theirs["span"],
        span=span,
        left_out=dict(sorted(own.items(), key=lambda item: item[1], reverse=True)),
        zero_offset=math.hypot(*offsets),
        combined=budget.depth,
        u95=budget.depth_u95(),
        weight_of_water=(_DENSITY * _GRAVITY / (water.density.value * water.gravity.value) - 1.0)
        * DEPTH,
        velocity_head=float(depth_from_pressure(flow_pressure(1.0, speed, water), water)),
        excitation=_SHARE_OF_EXCITATION * DEPTH,
        unvented=float(
            depth_from_pressure(_ATMOSPHERE / (_KELVIN + water.temperature.value), water)
        ),
    )
