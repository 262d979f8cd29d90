# SPDX-License-Identifier: Apache-2.0
"""Water and sea floor of a MoorDyn v2 file: its options, and the files that they name.

| option | here |
|---|---|
| WtrDpth, kBot, cBot | the floor of a Tank: bed_stiffness kBot, damping from cBot |
| SeafloorFile | the floor's depth, if that is one: a Tank's floor is level |
| FrictionCoefficient, mu_kT, mu_kA | its friction; FricDamp only rounds the friction off |
| WaterKin | the steady profile of its file |
| Currents 1, 3 | current_profile.txt |
| Currents 2, 4; 5 | current_profile_dynamic.txt; current_profile_4d.txt, a profile plus a series |
| WaveKin 2, 4, 7; 3, 5 | wave_frequencies.txt; Fourier components of wave_elevation.txt |

MoorDyn's floor has a dashpot, kBot δ + cBot δ̇ per area; here the damping grows with the depth,
kBot δ (1 + a δ̇). Both are alike at the depth δ = w/(kBot d) at which a line of weight w rests on
its diameter d. There the middle of a line touches the floor, here its underside: the floor lies
half a diameter lower. a and the diameter are means over the lines that sink, by their weight.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Current, InvalidInput, Sea, Tank, Water
from sim_core.moordyn_lines import LineType
from sim_core.moordyn_tables import Row, numbers_of_file, text_beside

_NAMES = {
    "gravity": "g",
    "rho": "rhow",
    "wtrdnsty": "rhow",
    "depth": "wtrdpth",  # so MoorPy
    "wtrdepth": "wtrdpth",
    "dt": "dtm",
    "kb": "kbot",
    "cb": "cbot",
}
#: Those of MoorDyn's solver, its start, and its output, which change no result here.
_WITHOUT_EFFECT = {
    *("dtic", "icdt", "tmaxic", "ictmax", "cdscaleic", "icdfac", "threshic", "icthresh", "ictol"),
    *("gendynamicic", "icgendynamic", "fileic", "icfile", "cfl", "tscheme", "writelog", "dtout"),
    *("writeunits", "disableoutput", "disableouttime", "outswitch", "unifycurrentgrid"),
    *("fricdamp", "cv", "inertialf", "inertialf_rampt", "dtwave"),
}
_READ = {
    *("g", "rhow", "wtrdpth", "dtm", "kbot", "cbot", "frictioncoefficient", "mu_kt", "mu_ka"),
    *("statdynfricscale", "mc", "wavekin", "currents", "waterkin", "seafloorfile"),
}

_ALIKE = 1e-6  # of the largest velocity: what rounding in a file may make of equal ones
_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Options:
    """The options of a file by name, in lower case."""

    rows: Mapping[str, Row]
    folder: Path
    unknown: tuple[Row, ...]  #: of no known name

    @staticmethod
    def of(rows: list[Row], folder: Path) -> Options:
        known: dict[str, Row] = {}
        unknown = []
        for row in rows:
            row.require(("value", "name of the option"))
            name = row.words[1].lower()
            name = _NAMES.get(name, name)
            if name in _READ or name in _WITHOUT_EFFECT:
                known[name] = row
            else:
                unknown.append(row)
        return Options(known, folder, tuple(unknown))

    def real(self, name: str, default: float) -> float:
        row = self.rows.get(name)
        return default if row is None else row.real(0, row.words[1])

    def chosen(self, name: str) -> tuple[Row, int] | None:
        """The row of a choice and what was chosen, if that is not 0."""
        row = self.rows.get(name)
        if row is None or row.words[0] in ("0", "0.0"):
            return None
        return row, row.integer(0, row.words[1])

    @property
    def left_to_the_caller(self) -> list[Row]:
        """The rows by which the calling program gives waves or current."""
        rows = []
        waves = self.chosen("wavekin")
        if waves and waves[1] == 1:
            rows.append(waves[0])
        kinematics = self.rows.get("waterkin")
        if kinematics and (kinematics.words[0].upper() == "SEASTATE" or 2 in self.hybrid()):
            rows.append(kinematics)
        return rows

    def hybrid(self) -> tuple[int, int]:
        """WaveKinMod and CurrentMod of the file of MoorDyn-F that WaterKin names; 0 without."""
        row = self.rows.get("waterkin")
        if row is None or row.words[0].upper() in ("0", "0.0", "SEASTATE"):
            return 0, 0
        modes = {"WAVEKINMOD": 0, "CURRENTMOD": 0}
        for line in text_beside(row, row.words[0].strip("\"'"), self.folder).splitlines():
            words = line.split()
            if len(words) > 1 and words[1].upper() in modes and words[0].isdecimal():
                modes[words[1].upper()] = int(words[0])
        return modes["WAVEKINMOD"], modes["CURRENTMOD"]


def read_water(options: Options, depth: float | None) -> Water:
    """Return the water; depth: m, for waves. Raises InvalidInput naming line, cause and mend."""
    gravity = options.real("g", 9.80665)
    return Water(
        density=options.real("rhow", 1025.0),
        gravity=gravity,
        current=_current(options) or (0.0, 0.0, 0.0),
        waves=_waves(options, depth, gravity),
    )


def floor(
    options: Options, depth: float, lines: list[tuple[LineType, float]], water: Water
) -> Tank:
    """Return the tank whose floor is the sea floor; lines: types and lengths (m)."""
    friction = options.real("frictioncoefficient", 0.0)
    across, along = (options.real(name, friction) for name in ("mu_kt", "mu_ka"))
    if across != along:
        row = next(row for name, row in options.rows.items() if name in ("mu_kt", "mu_ka"))
        raise row.error(
            f"friction across a line ({across:g}) and along it ({along:g}) must be equal: "
            "give mu_kT and mu_kA one value"
        )
    for name in ("statdynfricscale", "mc"):
        if across != 0.0 and options.real(name, 1.0) != 1.0:
            row = options.rows[name]
            raise row.error(f"{row.words[1]}: static friction is as dynamic friction here: give 1")
    stiffness, dashpot = options.real("kbot", 3e6), options.real("cbot", 3e5)
    if not (stiffness > 0.0 and dashpot >= 0.0 and across >= 0.0):
        row = next(row for name, row in options.rows.items() if name in ("kbot", "cbot"))
        raise row.error("kBot must be above 0, cBot and friction not below")
    whole = times_diameter = times_diameter_per_weight = 0.0  # weight (N) of what sinks
    for kind, length in lines:
        p = kind.properties
        buoyancy = water.density * math.pi / 4 * p.diameter**2
        weight = (p.mass_per_length - buoyancy) * water.gravity
        if weight > 0.0:
            whole += length * weight
            times_diameter += length * weight * p.diameter
            times_diameter_per_weight += length * p.diameter
    if whole == 0.0:
        return Tank(floor=-depth, bed_stiffness=stiffness, friction=across)
    return Tank(
        floor=-depth - 0.5 * times_diameter / whole,
        bed_stiffness=stiffness,
        damping=dashpot * times_diameter_per_weight / whole,
        friction=across,
    )


def floor_of_file(row: Row, folder: Path) -> float:
    """Return the depth (m) of the sea floor in the file of an option SeafloorFile.

    Raises InvalidInput if it is uneven: a Tank's floor is level.
    """
    file = row.words[0].strip("\"'")
    counts, *lines = numbers_of_file(row, file, folder, heads=0, columns=1)
    shape = [len(line) for line in lines[:2]]
    rows = lines[2:]
    if counts != shape or len(rows) != math.prod(shape) or any(len(line) != 3 for line in rows):
        raise row.error(
            f"{file}: there must be two counts, as many x, as many y, and x, y, z for each of both"
        )
    heights = [z for _, _, z in rows]
    low, high = min(heights), max(heights)
    if high - low > 1e-6 * abs(low):
        raise row.error(
            f"the sea floor of {file} lies between {low:g} and {high:g} m, only a level one is "
            "supported: give water_depth, or WtrDpth in place of SeafloorFile"
        )
    return -low


def _current(options: Options) -> Current | None:
    waves, current = options.hybrid()
    if waves not in (0, 2) or current not in (0, 1, 2):
        row = options.rows["waterkin"]
        raise row.error(
            f"WaterKin {row.words[0]}: of MoorDyn-F's waves and currents only a steady profile is "
            "read: give 0 for the others, and waves and current to deck.system's water"
        )
    if current == 1:
        row = options.rows["waterkin"]
        text = text_beside(row, row.words[0].strip("\"'"), options.folder)
        table = text[text.upper().index("CURRENTMOD") :].splitlines()[3:]
        return _profile(itertools.takewhile(len, map(_numbers, table)))
    chosen = options.chosen("currents")
    if chosen is None:
        return None
    row, kind = chosen
    if kind in (1, 3):
        file = "current_profile.txt"
        return _profile(numbers_of_file(row, file, options.folder, heads=3, columns=2))
    if kind in (2, 4):
        return _changing_current(row, options.folder)
    if kind == 5:
        return _current_of_a_grid(row, options.folder)
    raise row.error(f"Currents {kind} is not known: give 0 to 5")


def _profile(rows: Iterable[list[float]]) -> Current:
    """Rows of z (m) and one to three components of the velocity (m/s)."""
    profile = {z: (*velocity, 0.0, 0.0)[:3] for z, *velocity in rows}
    return Current(profile=sorted(profile.items()))


def _numbers(line: str) -> list[float]:
    try:
        return [float(word) for word in line.split()]
    except ValueError:
        return []


def _changing_current(row: Row, folder: Path) -> Current:
    """A table over time and depth."""
    file = "current_profile_dynamic.txt"
    lines = numbers_of_file(row, file, folder, heads=4, columns=1)
    depths, samples = np.array(lines[0]), lines[1:]
    count = len(depths)
    if not samples or any(len(s) not in (count + 1, 2 * count + 1, 3 * count + 1) for s in samples):
        raise row.error(f"{file}: there must be 1, 2 or 3 velocities for each of {count} depths")
    times = np.array([sample[0] for sample in samples])
    table = np.zeros((len(samples), 3, count))
    for i, sample in enumerate(samples):
        values = np.reshape(sample[1:], (-1, count))
        table[i, : len(values)] = values
    return _profile_and_series(row, file, depths, times, table)


def _current_of_a_grid(row: Row, folder: Path) -> Current:
    """A table over x, y, z and time, if it is alike in all x and y."""
    file = "current_profile_4d.txt"
    counts, *lines = numbers_of_file(row, file, folder, heads=0, columns=1)
    axes = lines[:4]
    shape = [len(axis) for axis in axes]
    places = [{value: i for i, value in enumerate(axis)} for axis in axes]
    grid = np.full((*shape, 3), np.nan)
    for point in lines[4:]:
        if len(point) != 7:
            raise row.error(f"{file}: the lines after the fifth must be x y z t ux uy uz")
        x, y, z, t = (at.get(value, -1) for at, value in zip(places, point[:4], strict=True))
        grid[x, y, z, t] = point[4:7] if min(x, y, z, t) >= 0 else np.nan
    if counts != shape or np.isnan(grid).any():
        raise row.error(
            f"{file}: there must be four counts, as many x, y, z and times, and a line "
            "x y z t ux uy uz for each point of the grid"
        )
    table = grid[0, 0]
    if np.abs(grid - table).max() > _ALIKE * np.abs(grid).max():
        raise row.error(
            f"{file}: only a current that is alike in all x and y is supported: give such a one, "
            "or Currents 0 and a Current to deck.system's water"
        )
    depths, times = np.array(axes[2]), np.array(axes[3])
    return _profile_and_series(row, file, depths, times, table.transpose(1, 2, 0))


def _profile_and_series(
    row: Row, file: str, depths: _Array, times: _Array, table: _Array
) -> Current:
    """A table (times, 3, depths) in m/s, if it is the sum of a profile and a series."""
    profile = table[0]
    series = (table - profile).mean(axis=2)
    if np.abs(table - profile - series[:, :, None]).max() > _ALIKE * np.abs(table).max():
        raise row.error(
            f"{file}: only the sum of a steady profile and a series that is alike in all depths "
            "is supported: give such a one, or Currents 0 and a Current to deck.system's water"
        )
    over_depth = sorted(zip(depths.tolist(), profile.T.tolist(), strict=True))
    over_time = list(zip(times.tolist(), series.tolist(), strict=True))
    try:
        return Current(
            uniform=(0.0, 0.0, 0.0) if len(over_depth) > 1 else over_depth[0][1],
            profile=over_depth if len(over_depth) > 1 else None,
            series=over_time if len(over_time) > 1 else None,
        )
    except InvalidInput as error:
        raise row.error(f"{file}: {error}") from None


def _waves(options: Options, depth: float | None, gravity: float) -> Sea | None:
    chosen = options.chosen("wavekin")
    if chosen is None or chosen[1] == 1:
        return None
    row, kind = chosen
    # complex amplitudes c and directions; ζ is Re c exp(iωt), or for 7 the imaginary part
    if kind in (2, 4, 7):
        trains = _trains_of_spectrum(row, options.folder, evenly=kind != 7)
        turn = 0.5 * math.pi if kind == 7 else 0.0
    elif kind in (3, 5):
        trains = _trains_of_elevation(row, options)
        turn = 0.0
    else:
        raise row.error(f"WaveKin {kind} is not supported: give 0 and a Sea to deck.system's water")
    trains = [train for train in trains if train[0] > 0.0 and abs(train[1]) > 0.0]
    if not trains:
        return None
    try:
        return Sea(
            amplitude=[abs(c) for _, c, _ in trains],
            frequency=[w for w, _, _ in trains],
            direction=[beta for _, _, beta in trains],
            phase=[turn - cmath.phase(c) for _, c, _ in trains],
            gravity=gravity,
            **({} if depth is None else {"depth": depth}),
        )
    except InvalidInput as error:
        raise row.error(str(error)) from None


def _trains_of_spectrum(
    row: Row, folder: Path, *, evenly: bool
) -> list[tuple[float, complex, float]]:
    file = "wave_frequencies.txt"
    trains = []
    for w, real, imaginary, *direction in numbers_of_file(row, file, folder, heads=0, columns=3):
        trains.append((w, complex(real, imaginary), direction[0] if direction else 0.0))
    if not evenly or len(trains) < 2:
        return trains
    frequency = np.array([w for w, _, _ in trains])
    step = float(np.diff(frequency).min())
    if step <= 0.0:
        raise row.error(f"{file}: frequencies must ascend")
    # as MoorDyn does: amplitudes at even steps, linear between those given
    even = step * np.arange(int(frequency[-1] / step + 1e-9) + 1)
    parts, directions = np.array([c for _, c, _ in trains]), [beta for _, _, beta in trains]
    between = np.interp(even, frequency, parts.real) + 1j * np.interp(even, frequency, parts.imag)
    turned = np.interp(even, frequency, directions)
    return list(zip(even.tolist(), between.tolist(), turned.tolist(), strict=True))


def _trains_of_elevation(row: Row, options: Options) -> list[tuple[float, complex, float]]:
    """Fourier components up to 0.5 Hz, beyond which MoorDyn too cuts off."""
    file = "wave_elevation.txt"
    samples = np.array(numbers_of_file(row, file, options.folder, heads=0, columns=2))
    step = options.real("dtwave", 0.25)
    if step <= 0.0 or len(samples) < 2:
        raise row.error(f"{file}: there must be samples, and dtWave above 0")
    count = int(samples[-1, 0] / step + 1e-9) + 1
    count -= count % 2
    elevation = np.interp(step * np.arange(count), samples[:, 0], samples[:, 1])
    parts = 2.0 / count * np.fft.rfft(elevation)
    frequency = 2 * math.pi * np.fft.rfftfreq(count, step)
    largest = float(np.abs(parts).max())
    return [
        (float(w), complex(c), 0.0)
        for w, c in zip(frequency[:-1], parts[:-1], strict=True)
        if w <= math.pi and abs(c) > 1e-9 * largest
    ]
