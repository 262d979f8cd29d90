# SPDX-License-Identifier: Apache-2.0
"""Runs the front ends' ngspice decks and reads what they measure."""

from __future__ import annotations

import itertools
import math
import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DECKS = Path(__file__).resolve().parent

# Deck of each kind of front end, and the channels of board.yaml that are built like it.
CHANNELS = {
    "bridge": ("fish_pressure", "depressor_pressure"),
    "accelerometer": ("accel_x", "accel_y", "accel_z"),
    "excitation": ("excitation",),
}

# Relative tolerances of what sets gain and pole. Resistors 0.1 % (gain, divider) and 1 %, film
# capacitors 5 %, C0G capacitors 5 %; INA128 0.5 % (data sheet, at G = 100); the accelerometer's
# output resistance 80 to 140 kohm (data sheet of the sister part LIS3L02AQ3).
TOLERANCES: dict[str, dict[str, tuple[float, float]]] = {
    "bridge": {
        "R_rg": (-0.001, 0.001),
        "R_fil": (-0.01, 0.01),
        "C_fil": (-0.05, 0.05),
    },
    "accelerometer": {
        "R_out": (80 / 110 - 1, 140 / 110 - 1),
        "C_fil": (-0.05, 0.05),
    },
    "excitation": {
        "R_top": (-0.001, 0.001),
        "R_bottom": (-0.001, 0.001),
        "R_fil": (-0.01, 0.01),
        "C_fil": (-0.05, 0.05),
    },
}
AMPLIFIER_GAIN_ERROR = 0.005

_MEASURED = re.compile(r"^(\w+)\s+=\s+(\S+)", re.MULTILINE)
_DENSITY = re.compile(r"^\d+\t(\S+)\t(\S+)\s*$", re.MULTILINE)
_PARAMETER = re.compile(r"(?<=\s)(\w+)=(\S+)")
_SCALE = {"meg": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "": 1.0}


class SpiceError(Exception):
    """ngspice is missing or did not carry a deck through; one line."""


@dataclass(frozen=True)
class DeckRun:
    """What one run of a deck gave.

    measured: by the names of the deck's `meas` and `print` lines; V, Hz, rad or 1.
    frequency_hz, density: noise at the ADC's input, V/sqrt(Hz), shape (n,), ascending frequency.
    """

    measured: dict[str, float]
    frequency_hz: NDArray[np.float64]
    density: NDArray[np.float64]


def spice_number(text: str) -> float:
    """The value of a number with SPICE's suffix ("3.9k", "10meg")."""
    match = re.fullmatch(r"([0-9.eE+-]+)(meg|[kmunp]?)", text, re.IGNORECASE)
    if match is None:
        raise SpiceError(f"{text!r} is not a number of SPICE; write it as 3.9k or 100n")
    return float(match[1]) * _SCALE[match[2].lower()]


def deck_parameters(deck: str) -> dict[str, float]:
    """Values of a deck's `.param` lines, in SI units."""
    lines = [line for line in _text(deck).splitlines() if line.startswith(".param ")]
    return {name: spice_number(value) for line in lines for name, value in _PARAMETER.findall(line)}


def run_deck(deck: str, changed: Mapping[str, float] | None = None) -> DeckRun:
    """Runs a deck, with other values of some of its parameters if wished. Raises SpiceError."""
    text = _text(deck)
    for name, value in (changed or {}).items():
        text, found = re.subn(rf"^(\.param .*\b{name}=)\S+", rf"\g<1>{value!r}", text, flags=re.M)
        if found != 1:
            raise SpiceError(f"{deck}.cir has no parameter {name}; see its .param lines")
    try:
        # From standard input a deck finds its library in the folder it is run in.
        done = subprocess.run(
            ["ngspice", "-b", "/dev/stdin"],
            input=text,
            capture_output=True,
            text=True,
            cwd=DECKS,
            check=False,
        )
    except FileNotFoundError:
        raise SpiceError("ngspice is not installed; as root, apt-get install ngspice") from None
    output = done.stdout
    measured = {name: float(value) for name, value in _MEASURED.findall(output) if _real(value)}
    density = np.array([(float(f), float(e)) for f, e in _DENSITY.findall(output)])
    if done.returncode != 0 or "attenuation" not in measured or len(density) < 2:
        fault = next((line for line in done.stderr.splitlines() if line.strip()), "no figures")
        raise SpiceError(f"ngspice did not carry {deck}.cir through: {fault}")
    return DeckRun(measured, density[:, 0], density[:, 1])


def worst_case(deck: str) -> dict[str, tuple[float, float]]:
    """Least and greatest `gain` and `pole_hz` over all corners of the parts' tolerances."""
    nominal = deck_parameters(deck)
    corners = {
        name: (nominal[name] * (1 + low), nominal[name] * (1 + high))
        for name, (low, high) in TOLERANCES[deck].items()
    }
    if deck == "bridge":
        corners["gain_error"] = (-AMPLIFIER_GAIN_ERROR, AMPLIFIER_GAIN_ERROR)
    runs = [
        run_deck(deck, dict(zip(corners, corner, strict=True))).measured
        for corner in itertools.product(*corners.values())
    ]
    return {
        figure: (min(run[figure] for run in runs), max(run[figure] for run in runs))
        for figure in ("gain", "pole_hz")
    }


def sinc_response(
    frequency_hz: NDArray[np.float64], order: int, output_rate_hz: float
) -> NDArray[np.float64]:
    """|H| of the ADC's sinc filter: (sin x/x)^order, x = pi f/output rate.

    Right up to the modulator's rate, 32·FS times the output rate, beyond which it would repeat.
    """
    return np.abs(np.sinc(frequency_hz / output_rate_hz)) ** order


def conversion_noise(run: DeckRun, order: int, output_rate_hz: float, lowest_hz: float) -> float:
    """Standard deviation at the ADC's input of one conversion's front-end noise, V.

    lowest_hz: slower noise is drift, which zeroing before the run takes out.
    """
    kept = run.frequency_hz >= lowest_hz
    f, density = run.frequency_hz[kept], run.density[kept]
    power = (density * sinc_response(f, order, output_rate_hz)) ** 2
    # Over ln f, in which the points are equally spaced.
    return math.sqrt(np.trapezoid(power * f, np.log(f)))


def _text(deck: str) -> str:
    return (DECKS / f"{deck}.cir").read_text(encoding="utf-8")


def _real(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
