# SPDX-License-Identifier: Apache-2.0
"""Checking a rig file: every fault of the file, or what looks implausible in a faultless one."""

import datetime
import math
from collections.abc import Iterator
from pathlib import Path

from towtank_rig.conversion import pressure_from_depth
from towtank_rig.errors import RigError
from towtank_rig.loading import read_rig_text, validate
from towtank_rig.schema import Rig
from towtank_rig.static_margin import static_margin
from towtank_rig.water_density import density_of

# The fastest edges, per second, that the ADC board's encoder inputs are made for.
ENCODER_EDGES_PER_SECOND = 20_000


def check_rig(path: str | Path) -> list[RigError | str]:
    """Return all faults of a rig file as RigError, or, if it has none, warnings as text."""
    try:
        text = read_rig_text(path)
    except RigError as fault:
        return [fault]
    rig, faults = validate(text, str(path), Path(path).parent)
    return list(faults) if rig is None else warnings(rig)


def warnings(rig: Rig) -> list[str]:
    """Return what is implausible in a valid rig, one line each; empty if nothing is."""
    checks = (_water, _displacements, _stability, _room, _instruments, _planning, _errors)
    return [line for check in checks for line in check(rig)]


def calibration_warnings(rig: Rig, today: datetime.date) -> list[str]:
    """Return which calibrations are missing, without a record, or out of date on a day."""
    found = []
    for sensor in type(rig.calibrations).model_fields:
        calibration = getattr(rig.calibrations, sensor)
        where = f"calibrations.{sensor}"
        make = f"make one with `towtank calibrate {_PROCEDURES[sensor]}`"
        if calibration is None:
            found.append(f"{where}: there is none, the data sheet's figures hold; {make}")
        elif calibration.file is None:
            found.append(f"{where}: {calibration.id} has no record of its readings; {make}")
        elif calibration.due is not None and calibration.due < today:
            found.append(f"{where}: {calibration.id} was due on {calibration.due}; {make}")
    return found


_PROCEDURES = {
    "fish_pressure": "pressure",
    "depressor_pressure": "pressure",
    "accelerometer": "accelerometer",
    "crank": "crank",
}


def longest_steady_run(rig: Rig) -> float:
    """Return for how many seconds the carriage can run at full speed between its two ramps.

    Speed rises and falls evenly over ``run.ramp_time``, and ``tank.clearance`` stays free;
    infinite if the carriage stands.
    """
    speed = rig.run.carriage_speed.value
    if speed == 0.0:
        return math.inf
    room = rig.tank.length.value - rig.tank.clearance.value
    return max(room / speed - rig.run.ramp_time.value, 0.0)


def _water(rig: Rig) -> Iterator[str]:
    """The stated density against that of the temperature."""
    stated, derived = rig.water.density, density_of(rig.water.temperature, rig.water.salinity)
    spans = [q.range or (q.value, q.value) for q in (stated, derived)]
    if max(low for low, _ in spans) > min(high for _, high in spans):
        yield (
            f"water: density {stated}, but {derived} by TEOS-10 at {rig.water.temperature} and a "
            f"salinity of {rig.water.salinity}"
        )


def _displacements(rig: Rig) -> Iterator[str]:
    """Masses in air and in water against the volumes that the dimensions give."""
    density = rig.water.density.value
    sphere = math.pi / 6.0 * rig.depressor.diameter.value**3 * density
    displaced = rig.depressor.mass.value - rig.depressor.apparent_mass_in_water.value
    yield from _disagreement("depressor", displaced, sphere, "kg", 0.1)
    envelope = math.pi / 4.0 * rig.fish.diameter.value**2 * rig.fish.length.value * density
    if rig.fish.displaced_mass > 1.05 * envelope:
        yield (
            f"fish: displaces {rig.fish.displaced_mass:.2f} kg of water, a full cylinder of its "
            f"size only {envelope:.2f} kg"
        )
    for name in ("primary", "depressor", "secondary"):
        line = getattr(rig.lines, name)
        displaced = line.mass_per_length.value - line.weight_in_water_per_length.value
        cylinder = math.pi / 4.0 * line.diameter.value**2 * density
        yield from _disagreement(f"lines.{name}", displaced, cylinder, "kg/m", 0.05)


def _disagreement(
    where: str, displaced: float, volume: float, unit: str, tolerance: float
) -> Iterator[str]:
    if abs(displaced - volume) > tolerance * volume:
        yield (
            f"{where}: the masses in air and in water differ by {displaced:.4g} {unit}, the "
            f"diameter gives {volume:.4g} {unit} of water"
        )


def _stability(rig: Rig) -> Iterator[str]:
    margin = static_margin(rig.fish, rig.water.density.value)
    if margin is None and rig.fish.munk_moment.value > 0.0:
        yield "fish: no horizontal fins against the Munk moment; it will not tow straight"
    if margin is not None and margin < 0.0:
        yield f"fish: static margin {100.0 * margin:.1f} % of the length; it will not tow straight"
    if rig.fish.centre_of_gravity.z.value > 0.0:
        yield "fish: the centre of gravity lies above the centre of buoyancy; it will capsize"


def _room(rig: Rig) -> Iterator[str]:
    """The tow in its tank: floor when it hangs, length of the run."""
    for name, depth in _hanging_depths(rig).items():
        if depth > rig.tank.depth.value:
            yield (
                f"{name}: hangs down to {depth:.2f} m when the carriage stands, the water is "
                f"{rig.tank.depth.value:g} m deep"
            )
    logged = max(longest_steady_run(rig) - rig.run.settling_time.value, 0.0)
    periods = logged * rig.run.crank_rate.value / (2.0 * math.pi)
    if rig.run.crank_rate.value > 0.0 and periods < 5.0:
        yield (
            f"run: the tank's length leaves {periods:.1f} crank periods behind settling_time; "
            "aim for 5"
        )


def _hanging_depths(rig: Rig) -> dict[str, float]:
    """Return the greatest depth, m, of fish and depressor under a standing carriage."""
    motion = rig.tow_point.motion
    junction = motion.crank_radius.value - rig.tow_point.height.value
    junction += rig.lines.primary.length.value
    return {
        "fish": junction + rig.lines.secondary.length.value + rig.fish.diameter.value / 2.0,
        "depressor": junction + rig.lines.depressor.length.value + rig.depressor.diameter.value,
    }


def _instruments(rig: Rig) -> Iterator[str]:
    for name, depth in _hanging_depths(rig).items():
        sensor = getattr(rig.sensors, f"{name}_pressure")
        pressure = float(pressure_from_depth(depth, rig.water))
        if pressure > sensor.full_scale.value:
            yield (
                f"sensors.{name}_pressure: {pressure:.0f} Pa when the carriage stands, full scale "
                f"is {sensor.full_scale.value:g} Pa"
            )
    crank, carriage = rig.sensors.crank_encoder, rig.sensors.carriage_encoder
    turns = {
        "crank": rig.run.crank_rate.value / (2.0 * math.pi),
        "carriage": rig.run.carriage_speed.value / carriage.wheel_circumference.value,
    }
    for name, encoder in (("crank", crank), ("carriage", carriage)):
        edges = turns[name] * encoder.counts_per_revolution
        if edges > ENCODER_EDGES_PER_SECOND:
            yield (
                f"sensors.{name}_encoder: {edges:.0f} counts/s, the board is made for "
                f"{ENCODER_EDGES_PER_SECOND}"
            )
    per_period = math.inf
    if turns["crank"] > 0.0:
        per_period = rig.board.sample_rate.value / turns["crank"]
    if per_period < 20.0:
        yield f"board: {per_period:.1f} samples a crank period; take at least 20"


def _planning(rig: Rig) -> Iterator[str]:
    """What a run is planned by, and a rig file may leave out, for those of old bags do."""
    if "settling_time" not in rig.run.model_fields_set:
        yield (
            f"run: settling_time is not given and counts as {rig.run.settling_time}; add how long "
            "the tow takes to settle, with the range that may be cut to"
        )
    if "clearance" not in rig.tank.model_fields_set:
        yield (
            f"tank: clearance is not given and counts as {rig.tank.clearance}; add what of its "
            "length a run must leave free"
        )


def _errors(rig: Rig) -> Iterator[str]:
    """Errors that a rig file may leave out, for those of old bags do."""
    for sensor in ("fish_pressure", "depressor_pressure", "accelerometer"):
        errors = getattr(rig.sensors, sensor).errors
        for name in type(errors).model_fields:
            if name not in errors.model_fields_set:
                yield (
                    f"sensors.{sensor}.errors: {name} is not given and counts as none; add it from "
                    "the data sheet"
                )
    if "zero_angle_error" not in rig.sensors.crank_encoder.model_fields_set:
        yield (
            "sensors.crank_encoder: zero_angle_error is not given and counts as none; add how well "
            "the crank is set to its zero"
        )
