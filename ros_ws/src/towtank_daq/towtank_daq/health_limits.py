# SPDX-License-Identifier: Apache-2.0
"""What an intact sensor keeps to: facts of the rig and of the board, in codes.

No threshold is chosen here: each follows from the rig's figures for sensor, water and tank and from
the board's.

* An intact sensor stays within what the deepest water of the tank, or any attitude under little
  more than gravity, can make of it with all its errors at their limits.
* A bridge whose outputs touch reads no difference but the amplifier's own offset, and an output
  that touches ground reads ground. (In air, a bridge with next to no offset reads so, too.)
* Its noise is the rig's and the board's at their highest, and what motion leaves in the estimate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from towtank_rig import Quantity, Rig
from towtank_rig.conversion import (
    Channel,
    accelerometer_conversion,
    calibrated_channel,
    pressure_conversion,
)
from towtank_rig.instruments import PressureSensorName
from towtank_uncertainty.error_terms import (
    accelerometer_error_terms,
    greatest,
    pressure_error_terms,
)

from towtank_daq.description import BoardDescription
from towtank_daq.noise import SIGMAS, passed_motion

FORCE_TOLERANCE = 0.25
"""Of g: as much more or less of specific force a towed fish may feel."""

_CHANCE = 1e-12


@dataclass(frozen=True)
class Limits:
    """What an intact channel keeps to, in codes.

    Attributes:
        low, high: Codes between which it stays.
        short: Lowest and highest mean code that a short circuit gives.
        noise: Greatest standard deviation of its noise, and of what motion adds to its estimate.
        least_noise: Smallest standard deviation of its noise.
    """

    low: int
    high: int
    short: tuple[float, float]
    noise: float
    least_noise: float

    @property
    def equal_codes(self) -> int | None:
        """Equal codes in a row that are no chance; None where noise is too small to tell."""
        same = 1.0 / (2.0 * math.sqrt(math.pi) * self.least_noise) if self.least_noise else 1.0
        return 1 + math.ceil(math.log(_CHANCE) / math.log(same)) if same < 0.9 else None


def pressure_limits(rig: Rig, board: BoardDescription, sensor: PressureSensorName) -> Limits:
    """Return what a pressure channel keeps to: any depth of the tank, errors at their limits."""
    given = getattr(rig.sensors, sensor)
    water = rig.water
    terms = pressure_error_terms(rig, sensor)
    offset = greatest(terms, "zero_offset") + greatest(terms, "zero_drift")
    gain = 1.0 + sum(greatest(terms, effect) for effect in ("gain", "linearity", "water"))
    cp = abs(given.flow_coefficient.value) + given.errors.flow_coefficient.value
    speed = rig.run.carriage_speed.value
    flow = cp * 0.5 * water.density.value * speed**2
    deepest = _highest(rig.tank.depth) * water.density.value * water.gravity.value
    conversion = pressure_conversion(rig, sensor)
    scale = rig.board.excitation.value / given.reference_excitation.value
    low = float(conversion.volts(-flow * gain)) - offset * scale
    high = float(conversion.volts((deepest + flow) * gain)) + offset * scale
    amplifier = given.errors.amplifier_offset.value + sum(
        math.prod(f.value for f in term.factors)
        for term in terms
        if term.name == "amplifier offset over temperature"
    )
    crank = rig.tow_point.motion.crank_radius.value * water.density.value * water.gravity.value
    motion = float(conversion.volts(crank) - conversion.volts(0.0)) * _passed(rig)
    return _in_codes(
        calibrated_channel(
            rig, sensor, board.adc_channel(given.channel, rig.board.excitation.value)
        ),
        (low, high),
        amplifier,
        given.errors.noise,
        board.terminal_noise(given.channel, rig.board.excitation.value),
        motion,
    )


def accelerometer_limits(rig: Rig, board: BoardDescription, axis: str) -> Limits:
    """Return what an accelerometer's axis keeps to: any attitude under little more than gravity."""
    given = rig.sensors.accelerometer
    conversion = accelerometer_conversion(rig)
    index = "xyz".index(axis)
    zero, slope = float(conversion.zero_g[index]), float(conversion.sensitivity[index])
    all_terms = accelerometer_error_terms(rig)
    terms = [t for t in all_terms if t.name.endswith(axis)]
    slack = greatest(terms, "zero_g") + slope * greatest(terms, "nonlinearity")
    gravity = rig.water.gravity.value
    steepest = slope * (1.0 + greatest(terms, "sensitivity"))
    reach = slack + steepest * (1.0 + FORCE_TOLERANCE) * gravity
    reach += greatest(all_terms, "supply") * (zero + reach)
    name = getattr(given.channels, axis)
    return _in_codes(
        board.adc_channel(name, rig.board.excitation.value),
        (zero - reach, zero + reach),
        board.adc.buffer_headroom_volts,  # the ADC's buffer need not follow down to ground
        given.errors.noise,
        board.terminal_noise(name, rig.board.excitation.value),
        slope * gravity * _passed(rig),
    )


def excitation_range(rig: Rig, board: BoardDescription) -> tuple[float, float]:
    """Return the lowest and highest excitation, V: the rig's range, or what the board's self-test
    allows for the reference that is made of it."""
    if rig.board.excitation.range is not None:
        return rig.board.excitation.range
    reference = board.self_test.limits["refin1_volts"]
    ratio = board.adc.refin1_per_excitation
    return reference.minimum / ratio, reference.maximum / ratio


def _in_codes(
    channel: Channel,
    span: tuple[float, float],
    short: float,
    noise: Quantity,
    board_noise: float,
    motion: float,
) -> Limits:
    """Limits in codes, of volts at the terminals; ``short``: how far from nothing a short may read.

    A rounding error of a code is added outwards.
    """
    low, high = (int(code) for code in channel.codes(span))
    highest = math.hypot(_highest(noise), board_noise)
    least = noise.range[0] if noise.range else noise.value
    aside = short + SIGMAS * highest
    return Limits(
        low=max(low - 1, 0),
        high=min(high + 1, 2**channel.bits - 1),
        short=(float(channel.exact_code(-aside)), float(channel.exact_code(aside))),
        noise=math.hypot(highest, motion) / channel.resolution,
        least_noise=math.hypot(least, board_noise) / channel.resolution,
    )


def _highest(quantity: Quantity) -> float:
    return quantity.range[1] if quantity.range else quantity.value


def _passed(rig: Rig) -> float:
    """Return how much of the amplitude of the crank's motion is taken for noise."""
    return passed_motion(rig.run.crank_rate.value / rig.board.sample_rate.value)
