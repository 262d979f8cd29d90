# SPDX-License-Identifier: Apache-2.0
"""What looks wrong with a sensor, from its codes and from what the rig says of it.

No threshold is chosen here: each follows from the rig's figures for sensor, water and tank and from
the board's. What is judged by scatter is judged beyond five standard deviations of the estimate.

* An intact sensor stays within what the deepest water of the tank, or any attitude under little
  more than gravity, can make of it with all its errors at their limits. Beyond: OPEN.
* A bridge whose outputs touch reads no difference but the amplifier's own offset, and an output
  that touches ground reads ground: SHORT. (In air, a bridge with next to no offset reads so, too.)
* Noise makes equal codes in a row unlikely; where there are so many that it would happen by chance
  once in 10^12 scans: STUCK. And a pressure sensor that over a whole turn of the crank shows
  nothing but its noise does not feel the water.
* Noise is what third differences leave over: motion at the crank's frequency hardly passes them.
  More than the rig's noise at its highest: NOISE.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from towtank_node.health import Health
from towtank_rig import Quantity, Rig
from towtank_rig.conversion import (
    Channel,
    accelerometer_conversion,
    calibrated_channel,
    crank_encoder,
    pressure_conversion,
)
from towtank_rig.instruments import PressureSensorName
from towtank_uncertainty.error_terms import (
    accelerometer_error_terms,
    greatest,
    pressure_error_terms,
)

from towtank_daq.description import BoardDescription

SIGMAS = 5.0
FORCE_TOLERANCE = 0.25
"""Of g: as much more or less of specific force a towed fish may feel."""

_CHANCE = 1e-12
# Third differences of white noise have 20 times its variance. The median of their sizes, 0.6745
# deviations, is not moved by a few jumps. Of n it scatters by 1.166/√n of itself if they were
# independent; the sum of their squared correlations, C(12, 6)/C(6, 3)², makes fewer of them.
_DIFFERENCES = 20.0
_MEDIAN = 0.6745
_FEWEST_MEANS = 6  # of half a second each, less two for the straight line
_NOISE_SCATTER = 1.166 * math.sqrt(924.0 / 400.0)


ADVICE = {
    Health.OPEN: "reads what an intact sensor cannot give: check its wires and the sensor",
    Health.SHORT: "reads as a short circuit: check its wires for water",
    Health.SATURATED: "is at an end of the ADC's scale: check its wires and the gain",
    Health.STUCK: "does not move: check the port, the wires and the ADC",
    Health.EXCITATION: "has an excitation out of range: check the supply of the bridges",
    Health.NOISE: "is noisier than the rig expects: check shield, ground and wires",
}


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


class ChannelWatch:
    """Judges one channel's codes; update() takes one a scan.

    Saturation, range and equal codes are judged at once; noise and short circuits over blocks of
    ``block`` scans, and then hold until the next block is full.
    """

    def __init__(self, channel: Channel, limits: Limits, block: int) -> None:
        self._limits = limits
        self._top = 2**channel.bits - 1
        self._equal = limits.equal_codes
        self._block = block
        self._noise_limit = limits.noise * (1.0 + noise_margin(block))
        self._codes: list[int] = []
        self._repeats = 0
        self._last: int | None = None
        self._of_block = Health(0)

    def update(self, code: int | None) -> Health:
        """Flags after one more scan; None where the scan lacks a conversion."""
        if code is None:
            self._codes.clear()
            self._repeats, self._last = 0, None
            return self._of_block
        flags = self._of_block
        if code <= 0 or code >= self._top:
            flags |= Health.SATURATED
        limits = self._limits
        if code < limits.low or code > limits.high:
            at_ground = limits.short[0] <= code <= limits.short[1]
            flags |= Health.SHORT if at_ground else Health.OPEN
        self._repeats = self._repeats + 1 if code == self._last else 1
        self._last = code
        if self._equal is not None and self._repeats >= self._equal:
            flags |= Health.STUCK
        self._codes.append(code)
        if len(self._codes) == self._block:
            self._judge_block()
        return flags

    def _judge_block(self) -> None:
        codes = np.array(self._codes, dtype=float)
        self._codes.clear()
        flags = Health(0)
        if white_noise(codes) > self._noise_limit:
            flags |= Health.NOISE
        low, high = self._limits.short
        if low <= float(codes.mean()) <= high and float(codes.std()) <= self._noise_limit:
            flags |= Health.SHORT
        self._of_block = flags


class MotionWatch:
    """Judges whether a pressure sensor follows a turn of the crank; noise: its greatest, codes."""

    def __init__(self, rig: Rig, noise: float) -> None:
        self._noise = noise
        self._turn = crank_encoder(rig).counts_per_revolution
        self._codes: list[int] = []
        self._start: int | None = None
        self._epoch = 0
        self._flags = Health(0)

    def update(self, code: int | None, crank_count: int, count_epoch: int = 0) -> Health:
        """Flags after one more scan; they hold until the crank has turned once more."""
        if self._start is None or code is None or count_epoch != self._epoch:
            self._start = crank_count
            self._codes.clear()
        self._epoch = count_epoch
        if code is not None:
            self._codes.append(code)
        if abs(crank_count - self._start) >= self._turn:
            codes = np.array(self._codes, dtype=float)
            self._flags = Health.STUCK if is_still(codes, self._noise) else Health(0)
            self._codes.clear()
            self._start = crank_count
        elif len(self._codes) > 10_000:  # the crank stands
            self._start = None
        return self._flags


def white_noise(codes: np.ndarray) -> float:
    """Return the standard deviation of the white noise in samples, by third differences."""
    sizes = np.abs(np.diff(codes, 3))
    return float(np.median(sizes)) / (_MEDIAN * math.sqrt(_DIFFERENCES))


def noise_margin(samples: int) -> float:
    """Return how far white_noise() may lie above the truth by chance, relative; for 4 or more."""
    return SIGMAS * _NOISE_SCATTER / math.sqrt(samples - 3)


def wander_samples(rate_hz: float) -> int:
    """Return how many samples slow_wander() takes into each mean."""
    return max(round(rate_hz / 2.0), 1)


def wander_margin(samples: int, rate_hz: float) -> float:
    """Return how far slow_wander() of white noise may lie above the truth by chance, relative."""
    return SIGMAS / math.sqrt(2.0 * max(samples // wander_samples(rate_hz) - 2, 1))


def slow_wander(values: np.ndarray, rate_hz: float) -> float:
    """Return the amplitude of what is slower than 1 Hz in samples, as of one oscillation.

    Means over half a second, less a straight line: their standard deviation times √2. White noise
    leaves √2 times its own over the root of a mean's samples. NaN for less than three seconds.
    """
    size = wander_samples(rate_hz)
    means = values[: len(values) // size * size].reshape(-1, size).mean(axis=1)
    if len(means) < _FEWEST_MEANS:
        return math.nan
    time = np.arange(len(means))
    left = means - np.polyval(np.polyfit(time, means, 1), time)
    return math.sqrt(2.0 * float(np.sum(left**2)) / (len(means) - 2))


def is_still(codes: np.ndarray, greatest_noise: float) -> bool:
    """Return whether samples hold nothing but white noise, of no more than a greatest deviation."""
    if len(codes) < 20:
        return False
    noise = min(white_noise(codes), greatest_noise) ** 2
    # Of one variance by itself and of the other, twice that of its root
    scatter = math.hypot(2.0 * _NOISE_SCATTER, math.sqrt(2.0)) / math.sqrt(len(codes))
    return float(np.var(codes)) <= noise * (1.0 + SIGMAS * scatter)


class PressureHealth:
    """Health of one pressure sensor and of the bridges' excitation."""

    def __init__(self, rig: Rig, board: BoardDescription, sensor: PressureSensorName) -> None:
        block = _block(rig)
        name = getattr(rig.sensors, sensor).channel
        self._channel = board.channel_names.index(name)
        self._excitation = board.channel_names.index("excitation")
        nominal = rig.board.excitation.value
        channel = calibrated_channel(rig, sensor, board.adc_channel(name, nominal))
        limits = pressure_limits(rig, board, sensor)
        self._watch = ChannelWatch(channel, limits, block)
        self._motion = MotionWatch(rig, limits.noise)
        low, high = excitation_range(rig, board)
        adc = board.adc_channel("excitation", nominal)
        self._excitation_codes = int(adc.codes(low)), int(adc.codes(high))

    def update(
        self, codes: Sequence[int], valid_mask: int, crank_count: int, count_epoch: int = 0
    ) -> Health:
        """Flags after one more scan."""
        code = codes[self._channel] if valid_mask >> self._channel & 1 else None
        flags = self._watch.update(code)
        if more := self._motion.update(code, crank_count, count_epoch):
            flags |= more  # the union of enumeration's flags takes longer than all else here
        if valid_mask >> self._excitation & 1:
            low, high = self._excitation_codes
            if not low <= codes[self._excitation] <= high:
                flags |= Health.EXCITATION
        return flags


class AccelerometerHealth:
    """Health of the accelerometer's three axes."""

    def __init__(self, rig: Rig, board: BoardDescription) -> None:
        names = rig.sensors.accelerometer.channels
        nominal = rig.board.excitation.value
        self._watches = [
            (
                board.channel_names.index(name),
                ChannelWatch(
                    board.adc_channel(name, nominal),
                    accelerometer_limits(rig, board, axis),
                    _block(rig),
                ),
            )
            for axis, name in (("x", names.x), ("y", names.y), ("z", names.z))
        ]

    def update(self, codes: Sequence[int], valid_mask: int) -> Health:
        """Flags of all axes together after one more scan."""
        flags = Health(0)
        for channel, watch in self._watches:
            if more := watch.update(codes[channel] if valid_mask >> channel & 1 else None):
                flags |= more
        return flags


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
        short=(channel.exact_code(-aside), channel.exact_code(aside)),
        noise=math.hypot(highest, motion) / channel.resolution,
        least_noise=math.hypot(least, board_noise) / channel.resolution,
    )


def _highest(quantity: Quantity) -> float:
    return quantity.range[1] if quantity.range else quantity.value


def _passed(rig: Rig) -> float:
    """Return how much of the amplitude of a motion at the crank's frequency third differences take
    for noise: (2 sin(ω/2f))³/√2, its effective value, over √20."""
    turn = rig.run.crank_rate.value / rig.board.sample_rate.value
    return (2.0 * math.sin(min(turn, math.pi) / 2.0)) ** 3 / math.sqrt(2.0 * _DIFFERENCES)


def _block(rig: Rig) -> int:
    """Scans that noise is judged over: those of a second, at least enough for a judgement."""
    return max(round(rig.board.sample_rate.value), 20)
