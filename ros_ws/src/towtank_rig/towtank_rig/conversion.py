# SPDX-License-Identifier: Apache-2.0
"""From ADC codes to engineering values and back.

Codes → volts at the sensor's terminals → pressure → depth; volts → specific force → pitch and roll;
encoder counts → crank angle and carriage position. Each conversion has its inverse, with which the
virtual bench makes the terminals' volts. All functions take scalars or arrays of any shape. Most
give a float for a float: a sensor's node converts one scan after the other, and numpy's scalars
would cost it ten times the arithmetic.

A rig's calibration takes the place of the data sheet's figures where the rig has one.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towtank_rig.instruments import Mounting, PressureSensorName
from towtank_rig.schema import Rig, Water

Array = NDArray[np.float64]

# A sensor's polynomial is taken as straight beyond these shares of full scale.
_FITTED_SHARES = (-0.1, 1.1)
# A bend of 10 % of the span leaves 1e-16 after four steps; each squares the error.
_NEWTON_STEPS = 5


def _floats(values: ArrayLike) -> Array:
    """Return a Python number as it is, all else as an array of floats."""
    if isinstance(values, float | int):
        return values  # type: ignore[return-value]  # it does all that is asked of an array here
    return np.asarray(values, dtype=float)


@dataclass(frozen=True)
class Channel:
    """Analog front end and ADC of one channel: input = gain·(volts at the terminals) + offset.

    Attributes:
        gain: Volts between the ADC's inputs per volt at the terminals.
        offset: Volts between the ADC's inputs at zero volts at the terminals.
        reference_volts: The ADC's reference. If it derives from what feeds the sensor, the
            excitation or the supply (ratiometric), its nominal value; volts then are those at the
            nominal one, too, whatever the true one is.
        bipolar: Codes are ``2^(bits−1)·(V·pga/reference + 1)`` if bipolar, else ``2^bits·V·pga/
            reference`` (AD7124-8 data sheet).
        pga: Gain inside the ADC.
        bits: Width of the code.
    """

    gain: float
    offset: float
    reference_volts: float
    bipolar: bool
    pga: float = 1.0
    bits: int = 24

    @cached_property
    def _codes_per_volt(self) -> float:
        return 2.0 ** (self.bits - self.bipolar) * self.pga / self.reference_volts

    @cached_property
    def _zero_code(self) -> float:
        return 2.0 ** (self.bits - 1) if self.bipolar else 0.0

    @property
    def resolution(self) -> float:
        """Return the volts at the terminals of one code step."""
        return 1.0 / (self._codes_per_volt * self.gain)

    def volts(self, codes: ArrayLike) -> Array:
        """Return the volts at the terminals."""
        at_input = (_floats(codes) - self._zero_code) / self._codes_per_volt
        return (at_input - self.offset) / self.gain

    def codes(self, volts: ArrayLike) -> NDArray[np.int64]:
        """Return the code of volts at the terminals, saturated at the ends of the scale."""
        codes = np.floor(self.exact_code(volts) + 0.5)
        return np.clip(codes, 0, 2**self.bits - 1).astype(np.int64)

    def exact_code(self, volts: ArrayLike) -> Array:
        """Return the code of volts at the terminals, neither rounded nor saturated."""
        at_input = self.gain * np.asarray(volts, dtype=float) + self.offset
        return at_input * self._codes_per_volt + self._zero_code

    def saturated(self, codes: ArrayLike) -> NDArray[np.bool_]:
        """Return where a code lies at an end of the scale and so is no measurement."""
        codes = codes if isinstance(codes, int) else np.asarray(codes)
        return (codes <= 0) | (codes >= 2**self.bits - 1)


def calibrated_channel(rig: Rig, sensor: PressureSensorName, nominal: Channel) -> Channel:
    """Return a pressure sensor's channel, with the calibrated amplifier gain if there is one."""
    calibration = getattr(rig.calibrations, sensor)
    if calibration is None or calibration.afe_gain is None:
        return nominal
    return replace(nominal, gain=calibration.afe_gain.value)


@dataclass(frozen=True)
class PressureConversion:
    """Gauge pressure of a ratiometric bridge.

    volts = excitation/reference_excitation · (offset + span·s + quadratic·s² + cubic·s³), with
    s = pressure/full_scale

    Attributes:
        span: Volts from zero to full scale at the reference excitation, the bend aside.
        offset: Volts at zero pressure, at the reference excitation.
        full_scale: Pa.
        reference_excitation: V.
        excitation: The board's nominal excitation, V.
    """

    span: float
    offset: float
    full_scale: float
    reference_excitation: float
    excitation: float
    quadratic: float = 0.0
    cubic: float = 0.0

    def pressure(self, volts: ArrayLike) -> Array:
        """Return Pa from volts at the terminals, given as at the nominal excitation.

        Beyond where the polynomial was fitted (10 % around zero to full scale) its straight
        continuation holds.
        """
        at_reference = _floats(volts) * self.reference_excitation / self.excitation
        rise = at_reference - self.offset
        if not (self.quadratic or self.cubic):
            return rise * (self.full_scale / self.span)
        share = rise / self.span
        for _ in range(_NEWTON_STEPS):
            share = share - (self._rise(share) - rise) / self._slope(share)
        return share * self.full_scale

    def volts(self, pressure: ArrayLike) -> Array:
        """Return volts at the terminals at the nominal excitation, from Pa."""
        rise = self._rise(np.asarray(pressure, dtype=float) / self.full_scale)
        return (self.offset + rise) * self.excitation / self.reference_excitation

    def _rise(self, share: Array) -> Array:
        if not (self.quadratic or self.cubic):
            return share * self.span
        inside = np.clip(share, *_FITTED_SHARES)
        curve = inside * (self.span + inside * (self.quadratic + inside * self.cubic))
        return curve + (share - inside) * self._slope(share)

    def _slope(self, share: Array) -> Array:
        inside = np.clip(share, *_FITTED_SHARES)
        return self.span + inside * (2.0 * self.quadratic + 3.0 * self.cubic * inside)


def pressure_conversion(rig: Rig, sensor: PressureSensorName) -> PressureConversion:
    """Return the conversion of one pressure sensor."""
    given = getattr(rig.sensors, sensor)
    calibration = getattr(rig.calibrations, sensor)
    line = calibration or given
    span, offset = line.span.value, line.offset.value
    quadratic, cubic = 0.0, 0.0
    if calibration is not None:
        quadratic, cubic = calibration.bends
        if calibration.temperature is not None:
            warmer = rig.water.temperature.value - calibration.temperature.value
            if calibration.span_temperature is not None:
                span *= 1.0 + calibration.span_temperature.value * warmer
            if calibration.offset_temperature is not None:
                offset += calibration.offset_temperature.value * warmer
    return PressureConversion(
        span=span,
        offset=offset,
        quadratic=quadratic,
        cubic=cubic,
        full_scale=given.full_scale.value,
        reference_excitation=given.reference_excitation.value,
        excitation=rig.board.excitation.value,
    )


def depth_from_pressure(pressure: ArrayLike, water: Water) -> Array:
    """Return the depth in m, downwards from still water, of a gauge pressure in Pa."""
    return _floats(pressure) / (water.density.value * water.gravity.value)


def pressure_from_depth(depth: ArrayLike, water: Water) -> Array:
    """Return the hydrostatic gauge pressure in Pa at a depth in m; above water it is zero."""
    hydrostatic = np.asarray(depth, dtype=float) * (water.density.value * water.gravity.value)
    return np.maximum(hydrostatic, 0.0)


def flow_pressure(flow_coefficient: ArrayLike, speed: ArrayLike, water: Water) -> Array:
    """Return Cp·½ρU², the Pa by which flow at ``speed`` (m/s) shifts the reading of a port."""
    speed = _floats(speed)
    return _floats(flow_coefficient) * (0.5 * water.density.value * (speed * speed))


@dataclass(frozen=True)
class DepthConversion:
    """From the codes of one pressure channel to pressure and depth.

    Attributes:
        channel: Front end and ADC.
        bridge: The sensor.
        water: For density, gravity and the flow's pressure.
        flow_coefficient: Cp of the port.
    """

    channel: Channel
    bridge: PressureConversion
    water: Water
    flow_coefficient: float

    def pressure(self, codes: ArrayLike) -> Array:
        """Return the gauge pressure at the port, Pa, that of the flow included."""
        return self.bridge.pressure(self.channel.volts(codes))

    def depth(self, pressure: ArrayLike, speed: ArrayLike) -> Array:
        """Return the depth, m below still water, from pressure, Pa, and towing speed, m/s."""
        flow = flow_pressure(self.flow_coefficient, speed, self.water)
        return depth_from_pressure(_floats(pressure) - flow, self.water)


def depth_conversion(rig: Rig, sensor: PressureSensorName, nominal: Channel) -> DepthConversion:
    """Return the conversion of one pressure channel; ``nominal``: as the board describes it."""
    return DepthConversion(
        calibrated_channel(rig, sensor, nominal),
        pressure_conversion(rig, sensor),
        rig.water,
        getattr(rig.sensors, sensor).flow_coefficient.value,
    )


def mounting_rotation(mounting: Mounting) -> Array:
    """Return the 3×3 matrix Rz(yaw)·Ry(pitch)·Rx(roll) that turns sensor axes to fish axes."""
    return rotation(mounting.roll.value, mounting.pitch.value, mounting.yaw.value)


def rotation(roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> Array:
    """Return the matrix Rz(yaw)·Ry(pitch)·Rx(roll), angles in rad (REP-103); shape (…, 3, 3)."""
    cr, sr = np.cos(roll), np.sin(roll)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.stack([np.stack(np.broadcast_arrays(*row), axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True)
class AccelerometerConversion:
    """Specific force from three analog outputs: volts = zero_g + sensitivity·(what the axis feels).

    Attributes:
        zero_g: Volts of each axis at zero specific force, shape (3,).
        sensitivity: V/(m/s²) of each axis, shape (3,).
        fish_to_axes: What the axes feel of a specific force in fish axes, shape (3, 3): its rows
            are the directions of the axes, which need not be square to one another.
        axes_to_fish: Its inverse.
    """

    zero_g: Array
    sensitivity: Array
    fish_to_axes: Array
    axes_to_fish: Array

    def specific_force(self, volts: ArrayLike) -> Array:
        """Return specific force in fish axes, m/s², from volts of x, y, z; both of shape (…, 3)."""
        felt = (np.asarray(volts, dtype=float) - self.zero_g) / self.sensitivity
        return felt @ self.axes_to_fish.T

    def volts(self, specific_force: ArrayLike) -> Array:
        """Return the volts of x, y, z from specific force in fish axes, m/s²; shape (…, 3)."""
        felt = np.asarray(specific_force, dtype=float) @ self.fish_to_axes.T
        return self.zero_g + self.sensitivity * felt


def accelerometer_conversion(rig: Rig) -> AccelerometerConversion:
    """Return the conversion of the rig's accelerometer."""
    sensor = rig.sensors.accelerometer
    calibration = rig.calibrations.accelerometer
    axes = (calibration.x, calibration.y, calibration.z) if calibration else (sensor,) * 3
    mounting = mounting_rotation(sensor.mounting)
    misaligned = np.eye(3)
    if calibration and calibration.misalignment:
        misaligned = misaligned + calibration.misalignment.matrix
    return AccelerometerConversion(
        zero_g=np.array([axis.zero_g.value for axis in axes]),
        sensitivity=np.array([axis.sensitivity.value for axis in axes]),
        fish_to_axes=misaligned @ mounting.T,
        axes_to_fish=mounting @ np.linalg.inv(misaligned),
    )


def pitch(specific_force: ArrayLike) -> Array:
    """Return pitch in rad, positive bow down (REP-103), from specific force in fish axes (…, 3).

    The arc tangent of two components does not feel a heave acceleration of a level fish, which only
    scales gravity; an arc sine of one component over g does. Surge acceleration remains.
    """
    force = np.asarray(specific_force, dtype=float)
    return np.arctan2(-force[..., 0], np.hypot(force[..., 1], force[..., 2]))


def roll(specific_force: ArrayLike) -> Array:
    """Return roll in rad, positive starboard down (REP-103), from specific force (…, 3)."""
    force = np.asarray(specific_force, dtype=float)
    return np.arctan2(force[..., 1], force[..., 2])


@dataclass(frozen=True)
class EncoderConversion:
    """A quadrature encoder: value = counts · per_count, the sign by its direction.

    Attributes:
        per_count: rad of the crank, or m of the carriage, by which one count moves on.
        counts_per_revolution: Counts in one turn of the encoder's shaft.
    """

    per_count: float
    counts_per_revolution: int

    def value(self, counts: ArrayLike) -> Array:
        """Return angle (rad) or position (m) of counts after fourfold decoding."""
        return np.asarray(counts, dtype=float) * self.per_count

    def counts(self, value: ArrayLike) -> NDArray[np.int64]:
        """Return the count of an encoder that started at zero: the last edge passed."""
        return np.floor(np.asarray(value, dtype=float) / self.per_count).astype(np.int64)

    def shaft_angle(self, value: ArrayLike) -> Array:
        """Return the angle in rad by which the encoder's shaft has turned in its counting sense."""
        counts = np.asarray(value, dtype=float) / self.per_count
        return counts * (2.0 * math.pi / self.counts_per_revolution)


def crank_encoder(rig: Rig) -> EncoderConversion:
    """Return the conversion of the crank's encoder, counts → rad."""
    encoder = rig.calibrations.crank or rig.sensors.crank_encoder
    per_count = encoder.direction * 2.0 * math.pi / encoder.counts_per_revolution
    return EncoderConversion(per_count, encoder.counts_per_revolution)


def crank_zero(rig: Rig) -> float:
    """Return the crank's angle in rad, by the motion law, where it stands when it is zeroed."""
    calibration = rig.calibrations.crank
    return calibration.zero_angle.value if calibration else 0.0


def carriage_encoder(rig: Rig) -> EncoderConversion:
    """Return the conversion of the carriage's encoder, counts → m along the run."""
    encoder = rig.sensors.carriage_encoder
    circumference = encoder.wheel_circumference.value
    per_count = encoder.direction * circumference / encoder.counts_per_revolution
    return EncoderConversion(per_count, encoder.counts_per_revolution)
