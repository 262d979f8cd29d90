# SPDX-License-Identifier: Apache-2.0
"""Check list of a bring-up: what each terminal, channel and counter must read, and within what.

Expected readings are the rig's conversions backwards; their limits are the sum of all errors that
the rig allows, each at its limit: a sound sensor does not lie outside. A calibration counts only
where its record stands behind it: a board that is brought up for the first time has the data
sheet's figures. Limits of the board come from board.yaml; those of noise, clock and encoder are the
ones of `towtank doctor`, which checks the lines marked with its name by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from towtank_daq.clock import SLOPE_TOLERANCE
from towtank_daq.description import BoardDescription
from towtank_daq.doctor import RESIDUAL_S, ROUND_TRIP_S, TURN_BY_HAND, greatest_noise
from towtank_daq.health_limits import excitation_range
from towtank_daq.noise import noise_margin
from towtank_lab.accelerometer_calibration import SIX_POSITIONS, specific_force
from towtank_rig import Rig
from towtank_rig.conversion import (
    Channel,
    PressureConversion,
    accelerometer_conversion,
    calibrated_channel,
    carriage_encoder,
    crank_encoder,
    crank_zero,
    pressure_conversion,
    pressure_from_depth,
)
from towtank_rig.instruments import PressureSensorName
from towtank_rig.loading import replaced
from towtank_rig.motion import tow_point_motion
from towtank_uncertainty.error_terms import (
    PRESSURE_SENSORS,
    accelerometer_error_terms,
    greatest,
    pressure_error_terms,
)
from towtank_uncertainty.sensor_errors import STANDARD_GRAVITY

DOCTOR_SECONDS = 10.0  # of streaming, by default
_TURNS = 10  # that are timed with the drive on
_BY_HAND_S = 0.5  # to which a time is taken by a stopwatch
_LAG_S = 0.5  # by which the crank may be behind its ramp
_ZEROING_S = 1.0  # the mean that is read after zeroing


@dataclass(frozen=True)
class Reading:
    """One number in one unit; `expected` is None where only limits are known."""

    expected: float | None
    minimum: float
    maximum: float
    unit: str


@dataclass(frozen=True)
class Item:
    """What to read: the same in up to three forms (code, volts at the terminals, unit)."""

    what: str
    readings: tuple[Reading, ...]
    doctor: bool = False
    """Whether `towtank doctor` checks it."""


@dataclass(frozen=True)
class Step:
    """Some readings under one condition."""

    title: str
    how: str
    items: tuple[Item, ...]


def check_list(
    rig: Rig, board: BoardDescription, depths: Sequence[float] | None = None
) -> tuple[Step, ...]:
    """Return the steps of a bring-up in their order.

    depths: of the ports below still water, m; by default five of even steps to 0.1 m, down to what
    tank and sensors can take.
    """
    rig = as_recorded(rig)
    return (
        _supplies(rig, board),
        _self_test(board),
        _in_air(rig, board),
        _six_positions(rig, board),
        _encoders(rig),
        _immersions(rig, board, depths or _depths(rig)),
        _zeroed(rig, board),
        _noise(rig, board),
        _clock(),
        _drive(rig, board),
    )


def as_recorded(rig: Rig) -> Rig:
    """Return the rig without the calibrations that no record stands behind."""
    unrecorded = [
        name
        for name in type(rig.calibrations).model_fields
        if (calibration := getattr(rig.calibrations, name)) and calibration.file is None
    ]
    return (
        replaced(rig, {f"calibrations.{name}": None for name in unrecorded}) if unrecorded else rig
    )


def pressure_item(
    rig: Rig, board: BoardDescription, sensor: PressureSensorName, depth: float
) -> Item:
    """Return what a pressure channel reads at rest with its port at a depth, m, not zeroed."""
    conversion, channel = _pressure(rig, board, sensor)
    given, calibration = getattr(rig.sensors, sensor), getattr(rig.calibrations, sensor)
    terms = pressure_error_terms(rig, sensor)
    pressure = float(pressure_from_depth(depth, rig.water))
    full_scale = given.full_scale.value
    fitted = calibration.fitted_range.value if calibration else full_scale
    gain, water = greatest(terms, "gain"), greatest(terms, "water")
    greatest_pressure = pressure * (1.0 + water)
    bend = 4.0 * greatest(terms, "linearity") / full_scale
    bend *= greatest_pressure * max(abs(fitted - pressure), abs(fitted - greatest_pressure))
    slack = greatest_pressure * (1.0 + gain) - pressure + bend
    offset = greatest(terms, "zero_offset") + greatest(terms, "zero_drift")
    offset *= rig.board.excitation.value / given.reference_excitation.value
    volts = Reading(
        float(conversion.volts(pressure)),
        float(conversion.volts(pressure - slack)) - offset,
        float(conversion.volts(pressure + slack)) + offset,
        "V",
    )
    weight = rig.water.density.value * rig.water.gravity.value
    return _item(
        given.channel, volts, channel, lambda v: float(conversion.pressure(v)) / weight, "m"
    )


def accelerometer_item(
    rig: Rig, board: BoardDescription, axis: str, roll: float, pitch: float
) -> Item:
    """Return what an accelerometer's axis reads at rest in an attitude, rad (REP-103)."""
    conversion = accelerometer_conversion(rig)
    index = "xyz".index(axis)
    felt = conversion.fish_to_axes @ specific_force(roll, pitch, rig.water.gravity.value)
    along = abs(float(felt[index]))
    across = float(np.sum(np.abs(felt))) - along
    terms = [
        term
        for term in accelerometer_error_terms(rig)
        if term.effect in ("rotation", "coupling", "supply") or term.name.endswith(axis)
    ]
    # Of a rotation each axis feels one angle for each of the other two, to the first order; what
    # the second adds is no more than the sum of the squares.
    turn = greatest(terms, "rotation") / 3.0
    coupling = greatest(terms, "coupling") / 6.0
    aside = (turn + coupling) * across + 3.0 * turn**2 * (along + across)
    reach = along + aside
    bend = greatest(terms, "nonlinearity") * (reach / STANDARD_GRAVITY) ** 2
    relative = greatest(terms, "sensitivity")
    slope = float(conversion.sensitivity[index])
    slack = greatest(terms, "zero_g") + slope * (
        relative * along + (1.0 + relative) * (aside + bend)
    )
    zero = float(conversion.zero_g[index])
    middle = zero + slope * float(felt[index])
    slack += greatest(terms, "supply") * (abs(middle) + slack)
    name = getattr(rig.sensors.accelerometer.channels, axis)
    return _item(
        name,
        Reading(middle, middle - slack, middle + slack, "V"),
        board.adc_channel(name, rig.board.excitation.value),
        lambda volts: (volts - zero) / slope,
        "m/s²",
    )


def _pressure(
    rig: Rig, board: BoardDescription, sensor: PressureSensorName
) -> tuple[PressureConversion, Channel]:
    name = getattr(rig.sensors, sensor).channel
    channel = calibrated_channel(rig, sensor, board.adc_channel(name, rig.board.excitation.value))
    return pressure_conversion(rig, sensor), channel


def _item(
    what: str, volts: Reading, channel: Channel, value: Callable[[float], float], unit: str
) -> Item:
    """Return a reading in volts with its codes and its value in the sensor's unit."""
    assert volts.expected is not None
    three = (volts.expected, volts.minimum, volts.maximum)
    codes = Reading(*(float(code) for code in channel.codes(three)), "code")
    return Item(what, (codes, volts, Reading(*map(value, three), unit)))


def _within(what: str, limits: tuple[float, float], unit: str, expected: float | None) -> Item:
    return Item(what, (Reading(expected, *limits, unit),))


def _supplies(rig: Rig, board: BoardDescription) -> Step:
    excitation = rig.board.excitation.value
    low, high = excitation_range(rig, board)
    ratio = board.adc.refin1_per_excitation
    supply = board.self_test.limits["supply_volts"]
    items = [
        _within("EXC10, the bridges' excitation", (low, high), "V", excitation),
        _within("REFIN1", (low * ratio, high * ratio), "V", excitation * ratio),
        _within("3V3", (supply.minimum, supply.maximum), "V", None),
    ]
    for channel in board.channels:
        if channel.output_reference_volts:
            share = channel.output_reference_volts / excitation
            limits = (low * share, high * share)
            expected = channel.output_reference_volts
            items.append(_within("REF, the amplifiers' output reference", limits, "V", expected))
            break
    return Step(
        "Supplies",
        "12 V on, no sensor connected yet; a multimeter against ground (nets: hardware/board).",
        tuple(items),
    )


def _self_test(board: BoardDescription) -> Step:
    words = {
        "short_offset_volts": ("ADC offset, input shorted", 0.0),
        "short_spread_volts": ("ADC noise, input shorted, peak to peak", None),
        "known_voltage_volts": ("ADC test voltage", None),
        "supply_volts": ("ADC supply", None),
        "refin1_volts": ("reference REFIN1", None),
        "deflection_volts": ("deflection of each axis by its self-test", None),
    }
    limits = board.self_test.limits
    return Step(
        "Self-test",
        "Sensors connected and at rest.",
        tuple(
            Item(what, (Reading(expected, limits[key].minimum, limits[key].maximum, "V"),), True)
            for key, (what, expected) in words.items()
        ),
    )


def _in_air(rig: Rig, board: BoardDescription) -> Step:
    low, high = excitation_range(rig, board)
    excitation = rig.board.excitation.value
    channel = board.adc_channel("excitation", excitation)
    volts = Reading(excitation, low, high, "V")
    return Step(
        "At rest in air",
        "Ports open to the air and dry, fish level and upright on a levelled table.",
        (
            *(pressure_item(rig, board, sensor, 0.0) for sensor in PRESSURE_SENSORS),
            *(accelerometer_item(rig, board, axis, 0.0, 0.0) for axis in "xyz"),
            Item("excitation", _item("", volts, channel, float, "V").readings[:2]),
        ),
    )


def _six_positions(rig: Rig, board: BoardDescription) -> Step:
    items = []
    for name, (roll, pitch) in SIX_POSITIONS.items():
        for axis in "xyz":
            item = accelerometer_item(rig, board, axis, math.radians(roll), math.radians(pitch))
            items.append(replace(item, what=f"{name}: {item.what}"))
    return Step(
        "Accelerometer in six positions",
        "Fish on a levelled table; `towtank calibrate accelerometer` leads through it and shows "
        "volts.",
        tuple(items),
    )


def _encoders(rig: Rig) -> Step:
    crank, carriage = crank_encoder(rig), carriage_encoder(rig)
    turn = math.copysign(crank.counts_per_revolution, crank.per_count)
    slack = TURN_BY_HAND * crank.counts_per_revolution
    metre = 1.0 / carriage.per_count
    circumference = rig.sensors.carriage_encoder.wheel_circumference.value
    wheel_slack = TURN_BY_HAND * circumference * abs(metre)
    motion, zero = tow_point_motion(rig.tow_point), crank_zero(rig)
    height = rig.tow_point.height
    low, high = height.range or (height.value, height.value)
    items = [
        Item("crank, one turn in its running sense", (_about(turn, slack, "counts"),), True),
        Item("carriage, 1 m forward", (_about(metre, wheel_slack, "counts"),), True),
    ]
    for degrees in (0, 90, 180, 270):
        heave = float(motion.heave(np.asarray(zero + math.radians(degrees))))
        reading = Reading(height.value + heave, low + heave, high + heave, "m")
        items.append(
            Item(f"tow point above still water, crank {degrees}° after its zero", (reading,))
        )
    return Step(
        "Encoders and crank",
        "Turned by hand from mark to mark, the drive off and its emergency stop pressed. The "
        "limits of a height are those that the rig assumes: write the true one into the rig.",
        tuple(items),
    )


def _immersions(rig: Rig, board: BoardDescription, depths: Sequence[float]) -> Step:
    items = []
    for depth in depths:
        for sensor in PRESSURE_SENSORS:
            item = pressure_item(rig, board, sensor, depth)
            items.append(replace(item, what=f"{depth:g} m: {item.what}"))
    return Step(
        "Immersed",
        "Ports so far below still water by the tape, nothing moving, not zeroed; `towtank "
        "calibrate pressure` leads through it and shows volts.",
        tuple(items),
    )


def _zeroed(rig: Rig, board: BoardDescription) -> Step:
    items = []
    samples = rig.board.sample_rate.value * _ZEROING_S
    noise = greatest_noise(rig, board)
    for sensor in PRESSURE_SENSORS:
        conversion, _ = _pressure(rig, board, sensor)
        given = getattr(rig.sensors, sensor)
        drift = greatest(pressure_error_terms(rig, sensor), "zero_drift")
        drift *= rig.board.excitation.value / given.reference_excitation.value
        volts = drift + 5.0 * math.sqrt(2.0 / samples) * noise[given.channel]
        depth = float(conversion.pressure(volts) - conversion.pressure(0.0))
        depth /= rig.water.density.value * rig.water.gravity.value
        items.append(Item(f"{given.channel}, change since zeroing", (_about(0.0, depth, "m"),)))
    return Step(
        "Zero",
        "Zeroed at rest in the water as before a trial, left for some minutes, then the mean of "
        f"{_ZEROING_S:g} s: what temperature and noise may have moved it.",
        tuple(items),
    )


def _noise(rig: Rig, board: BoardDescription) -> Step:
    margin = 1.0 + noise_margin(round(rig.board.sample_rate.value * DOCTOR_SECONDS))
    items = []
    for name, volts in greatest_noise(rig, board).items():
        step = board.adc_channel(name, rig.board.excitation.value).resolution
        limits = (0.1 * step, volts * margin)
        codes = tuple(limit / step for limit in limits)
        readings = (Reading(None, *codes, "codes"), Reading(None, *limits, "V"))
        items.append(Item(f"{name}, white noise", readings, True))
    return Step("Noise", f"At rest, standard deviation over {DOCTOR_SECONDS:g} s.", tuple(items))


def _clock() -> Step:
    ppm = 1e6 * SLOPE_TOLERANCE
    return Step(
        "Clock",
        "While the board streams.",
        (
            Item("board's rate against the host's", (_about(0.0, ppm, "ppm"),), True),
            Item("scatter of the exchanges", (Reading(None, 0.0, 1e3 * RESIDUAL_S, "ms"),), True),
            Item("round trip", (Reading(None, 0.0, 1e3 * ROUND_TRIP_S, "ms"),), True),
        ),
    )


def _drive(rig: Rig, board: BoardDescription) -> Step:
    """Times by a stopwatch; the board's clock is as good as its resonator."""
    drive = board.drive
    wanted = abs(rig.run.crank_rate.value) * 30.0 / math.pi
    rpm = min(max(wanted, drive.speed_rpm.minimum), drive.speed_rpm.maximum)
    ramp = rpm / drive.ramp_rpm_per_s
    turns = 60.0 * _TURNS / rpm
    slack = _BY_HAND_S + _LAG_S
    times = {
        f"from rest to {rpm:g} rpm": _about(ramp, slack, "s"),
        f"{_TURNS} turns at {rpm:g} rpm": _about(turns, SLOPE_TOLERANCE * turns + _BY_HAND_S, "s"),
        # Along the ramp at the latest: in a stop nothing pushes the crank over the heavy half turn
        f"told to stop at {rpm:g} rpm, to rest": Reading(None, 0.0, ramp + slack, "s"),
        f"host stopped or line pulled at {rpm:g} rpm, to rest": Reading(
            None, 0.0, drive.command_timeout_s + ramp + slack, "s"
        ),
    }
    return Step(
        "Crank drive",
        "Only with a motor on the board. `towtank crank run`, first without the tow, then with it. "
        "First of all press the emergency stop: the motor is without voltage whatever the board "
        "does, and `run` is refused until the loop is closed and `towtank crank clear` was given.",
        tuple(Item(what, (reading,)) for what, reading in times.items()),
    )


def _about(middle: float, slack: float, unit: str) -> Reading:
    return Reading(middle, middle - slack, middle + slack, unit)


def _depths(rig: Rig) -> list[float]:
    weight = rig.water.density.value * rig.water.gravity.value
    full_scale = min(getattr(rig.sensors, s).full_scale.value for s in PRESSURE_SENSORS)
    deepest = min(rig.tank.depth.value, full_scale / weight)
    step = max(math.floor(2.0 * deepest) / 10.0, 0.1)  # a fifth, to 0.1 m
    return [round(step * number, 1) for number in range(1, 6)]


def markdown(rig: Rig, steps: Sequence[Step]) -> str:
    """Return the list to print and fill in."""
    lines = [
        f"# Bring-up of {rig.name}",
        "",
        f"Rig file SHA-256 {rig.sha256[:16]}…; made by `towtank checklist`. Expected reading, "
        "and in brackets the limits that a sound one keeps to. D: `towtank doctor` checks it.",
        "",
        "Board ________________ Date ________________ By ________________",
    ]
    for number, step in enumerate(steps, 1):
        lines += ["", f"## {number}. {step.title}", "", step.how, "", *_table(step)]
    return "\n".join(lines) + "\n"


def _table(step: Step) -> Iterator[str]:
    columns = max(len(item.readings) for item in step.items)
    heads = (
        ("code", "volts at the terminals", "meaning") if columns == 3 else ("expected",) * columns
    )
    yield f"| | {' | '.join(heads)} | found | ok | |"
    yield "|---" * (columns + 4) + "|"
    for item in step.items:
        cells = [_cell(reading) for reading in item.readings]
        cells += [""] * (columns - len(cells))
        mark = "D" if item.doctor else ""
        yield f"| {item.what} | {' | '.join(cells)} | | | {mark} |"


def _cell(reading: Reading) -> str:
    factor, unit = _prefix(reading)
    low, high = factor * reading.minimum, factor * reading.maximum
    whole = unit in ("code", "codes", "counts")
    fine = (high - low) / 50.0
    digits = 0 if whole or fine <= 0.0 else max(0, -math.floor(math.log10(fine)))

    def number(value: float) -> str:
        text = f"{value:.{digits}f}"
        return text.replace("-", "−") if float(text) else text.removeprefix("-")

    first = "" if reading.expected is None else f"{number(factor * reading.expected)} "
    return f"{first}[{number(low)} … {number(high)}] {unit}"


def _prefix(reading: Reading) -> tuple[float, str]:
    """Return by what a reading is multiplied to be written, and the unit then."""
    greatest_size = max(abs(reading.minimum), abs(reading.maximum))
    prefixes = {"V": ("µV", "mV"), "m": ("µm", "mm")}.get(reading.unit)
    if prefixes is None or greatest_size >= 0.05:
        return 1.0, reading.unit
    return (1e3, prefixes[1]) if greatest_size >= 5e-4 else (1e6, prefixes[0])
