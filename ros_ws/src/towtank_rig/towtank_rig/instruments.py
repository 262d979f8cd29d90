# SPDX-License-Identifier: Apache-2.0
"""Sections of the rig file that describe board, sensors and calibrations."""

import datetime
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from towtank_rig.quantity import SI, Quantity, Section, Tolerance, Vector, rig_fault
from towtank_rig.tow import Length

Voltage = Annotated[Quantity, SI("V")]
Pressure = Annotated[Quantity, SI("Pa", gt=0)]
Angle = Annotated[Quantity, SI("rad")]
Noise = Annotated[Quantity, SI("V", ge=0)]
Sensitivity = Annotated[Quantity, SI("V/(m/s^2)", gt=0)]
RelativeLimit = Annotated[Tolerance, SI("1", ge=0)]
VoltageLimit = Annotated[Tolerance, SI("V", ge=0)]
PerKelvinLimit = Annotated[Tolerance, SI("1/K", ge=0)]
VoltagePerKelvinLimit = Annotated[Tolerance, SI("V/K", ge=0)]
TemperatureLimit = Annotated[Tolerance, SI("K", ge=0)]
SpeedLimit = Annotated[Tolerance, SI("m/s", ge=0)]
AngleLimit = Annotated[Tolerance, SI("rad", ge=0)]
AccelerationLimit = Annotated[Tolerance, SI("m/s^2", ge=0)]

PressureSensorName = Literal["fish_pressure", "depressor_pressure"]


class Board(Section):
    """The ADC board as the rig uses it; ``channels`` are the names in scan order.

    ``calibration_id`` is what the board has stored that the rig's calibrations were made with; None
    where any board may be used. Another board's amplifiers differ by up to their gain's tolerance.
    """

    sample_rate: Annotated[Quantity, SI("Hz", gt=0)]
    excitation: Annotated[Quantity, SI("V", gt=0)]
    channels: tuple[str, ...] = Field(min_length=1)
    calibration_id: Annotated[int, Field(ge=0, lt=2**32 - 1)] | None = None

    @model_validator(mode="after")
    def _channels_differ(self) -> "Board":
        if len(set(self.channels)) != len(self.channels):
            raise rig_fault("a channel is named twice", "name each channel once", at="channels")
        return self


class PressureErrors(Section):
    """Limits of the systematic errors of one pressure channel, and its noise.

    Limits "of full scale" are fractions of the full-scale pressure. Volts are at the bridge's
    terminals, at the nominal excitation. Rig files in old bags lack those that have a default.
    """

    span: RelativeLimit
    offset: VoltageLimit
    offset_stability: VoltageLimit = Tolerance(value=0.0, unit="V")  # over the sensor's life
    temperature_hysteresis: VoltageLimit = Tolerance(value=0.0, unit="V")  # of the offset
    linearity: RelativeLimit  # of full scale
    hysteresis: RelativeLimit  # of full scale
    span_temperature: PerKelvinLimit
    offset_temperature: VoltagePerKelvinLimit
    temperature_since_calibration: TemperatureLimit
    temperature_since_zeroing: TemperatureLimit
    reference_ratio: RelativeLimit  # excitation/4 as the ADC's reference
    amplifier_gain: RelativeLimit
    amplifier_offset: VoltageLimit
    amplifier_offset_temperature: VoltagePerKelvinLimit
    flow_coefficient: RelativeLimit  # of Cp at the port
    surge_speed: SpeedLimit  # oscillation of the flow past the port, at the crank's frequency
    noise: Noise  # white, standard deviation per sample
    # Amplitude of what mains hum folds down to below 1 Hz, behind the board's filter.
    hum: VoltageLimit = Tolerance(value=0.0, unit="V")


class PressureSensor(Section):
    """A ratiometric bridge for gauge pressure.

    volts = excitation/reference_excitation · (offset + span · pressure/full_scale)
    """

    channel: str
    position: Vector  # of the port, axes of its body
    full_scale: Pressure
    reference_excitation: Annotated[Quantity, SI("V", gt=0)]
    span: Annotated[Quantity, SI("V", gt=0)]
    offset: Voltage
    flow_coefficient: Annotated[Quantity, SI("1")]  # Cp = (p − p_static)/(½ρU²) at the port
    errors: PressureErrors


class AccelerometerErrors(Section):
    """Limits of the systematic errors of each accelerometer axis, and its noise.

    Rig files in old bags lack those that have a default.
    """

    sensitivity: RelativeLimit
    zero_g: VoltageLimit
    supply_ratio: RelativeLimit = Tolerance(value=0.0, unit="1")  # of supply to the ADC's reference
    nonlinearity: AccelerationLimit
    cross_axis: RelativeLimit
    alignment: AngleLimit
    zero_g_temperature: VoltagePerKelvinLimit
    temperature_since_calibration: TemperatureLimit
    noise: Noise  # white, standard deviation per sample


class AxisChannels(Section):
    """Board channel of each accelerometer axis."""

    x: str
    y: str
    z: str


class Mounting(Section):
    """Attitude of the sensor in the fish: Rz(yaw)·Ry(pitch)·Rx(roll) turns sensor to fish axes."""

    roll: Angle
    pitch: Angle
    yaw: Angle


class Accelerometer(Section):
    """Three-axis accelerometer with analog outputs: volts = zero_g + sensitivity·specific force."""

    channels: AxisChannels
    position: Vector
    mounting: Mounting
    zero_g: Voltage
    sensitivity: Sensitivity
    errors: AccelerometerErrors


class CrankEncoder(Section):
    """Quadrature encoder on the crank; counts per revolution after ×4 decoding.

    ``zero_angle_error``: how far from the motion law's angle 0 the crank may stand when it is
    zeroed. Rig files in old bags lack it.
    """

    counts_per_revolution: int = Field(ge=4)
    direction: Literal[1, -1]
    zero_angle_error: AngleLimit = Tolerance(value=0.0, unit="rad")


class CarriageEncoder(Section):
    """Quadrature encoder on a measuring wheel that runs along the rail."""

    counts_per_revolution: int = Field(ge=4)
    direction: Literal[1, -1]
    wheel_circumference: Length


class Sensors(Section):
    """All sensors of the rig, each by its channel's name on the board."""

    fish_pressure: PressureSensor
    depressor_pressure: PressureSensor
    accelerometer: Accelerometer
    crank_encoder: CrankEncoder
    carriage_encoder: CarriageEncoder


class Calibration(Section):
    """What every calibration says of itself.

    ``file`` names the record behind it, with all its readings, as the rig file refers to it (see
    towtank_rig.calibration_files); it is missing where the figures are assumed. After ``due`` the
    calibration is out of date.
    """

    id: str
    date: datetime.date
    due: datetime.date | None = None
    file: str | None = None


class PressureCalibration(Calibration):
    """Line or polynomial fitted in place through known immersions; takes the data sheet's place.

    volts = offset + span·s + quadratic·s² + cubic·s³ at the reference excitation, s being the share
    of full scale. It covers the whole chain, amplifier and reference included. ``afe_gain``
    replaces the board's nominal gain if the amplifier was calibrated by itself.

    Offset and span are those at ``temperature``, and change with the water's by the two
    coefficients; ranges of these are the limits of their uncertainty.
    """

    span: Annotated[Quantity, SI("V", gt=0)]
    offset: Voltage
    quadratic: Voltage | None = None
    cubic: Voltage | None = None
    fitted_range: Pressure  # the line was fitted between 0 and this pressure
    span_error: RelativeLimit
    temperature: Annotated[Quantity, SI("degC", ge=-3, le=50)] | None = None
    span_temperature: Annotated[Quantity, SI("1/K")] | None = None
    offset_temperature: Annotated[Quantity, SI("V/K")] | None = None
    afe_gain: Annotated[Quantity, SI("1", gt=0)] | None = None

    @model_validator(mode="after")
    def _rises(self) -> "PressureCalibration":
        if not rises(self.span.value, *self.bends):
            raise rig_fault(
                "the volts do not rise all the way to full scale",
                "correct it or cubic",
                at="quadratic",
            )
        return self

    @model_validator(mode="after")
    def _temperature_is_known(self) -> "PressureCalibration":
        if self.temperature is None and (self.span_temperature or self.offset_temperature):
            raise rig_fault(
                "coefficients of temperature without the temperature that they count from",
                "add '<number> degC'",
                at="temperature",
            )
        return self

    @property
    def bends(self) -> tuple[float, float]:
        """Return the quadratic and the cubic coefficient, V; zero where there is none."""
        terms = (self.quadratic, self.cubic)
        quadratic, cubic = (term.value if term is not None else 0.0 for term in terms)
        return quadratic, cubic


def rises(span: float, quadratic: float, cubic: float) -> bool:
    """Return whether span·s + quadratic·s² + cubic·s³ rises from s = −0.1 to 1.1."""
    share = np.linspace(-0.1, 1.1, 121)
    return bool(np.all(span + 2.0 * quadratic * share + 3.0 * cubic * share**2 > 0.0))


class AxisCalibration(Section):
    """Straight line of one accelerometer axis from a six-position calibration."""

    zero_g: Voltage
    sensitivity: Sensitivity
    zero_g_error: VoltageLimit | None = None  # in the place of what all axes have


class Misalignment(Section):
    """Small errors of the axes' directions: ``xy`` is what axis x feels of a force along y."""

    xy: Angle
    xz: Angle
    yx: Angle
    yz: Angle
    zx: Angle
    zy: Angle

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Return the 3×3 matrix with a zero diagonal, axes of the mounted sensor, rad."""
        return np.array(
            [
                [0.0, self.xy.value, self.xz.value],
                [self.yx.value, 0.0, self.yz.value],
                [self.zx.value, self.zy.value, 0.0],
            ]
        )


class AccelerometerCalibration(Calibration):
    """Six-position calibration; its limits take the place of the data sheet's.

    ``misalignment`` comes on top of the sensor's mounting.
    """

    x: AxisCalibration
    y: AxisCalibration
    z: AxisCalibration
    misalignment: Misalignment | None = None
    sensitivity_error: RelativeLimit
    zero_g_error: VoltageLimit
    alignment_error: AngleLimit


class CrankCalibration(Calibration):
    """Marks of the crank's disc; takes the place of the encoder's counts and direction.

    ``zero_angle`` is the crank's angle, by the motion law, at the mark where it stands when it is
    zeroed.
    """

    counts_per_revolution: int = Field(ge=4)
    direction: Literal[1, -1]
    zero_angle: Angle
    zero_angle_error: AngleLimit


class Calibrations(Section):
    """Calibrations in force; a sensor without one keeps the data sheet's figures."""

    fish_pressure: PressureCalibration | None = None
    depressor_pressure: PressureCalibration | None = None
    accelerometer: AccelerometerCalibration | None = None
    crank: CrankCalibration | None = None
