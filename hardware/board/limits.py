# SPDX-License-Identifier: Apache-2.0
"""Guaranteed limits of the parts, and how near the circuit comes to each: prints README.md's table.

Worst cases add up: supply, excitation and every tolerance at its end. Values of resistors are the
netlist's, gains and references board.yaml's. Limits are those that the makers guarantee, not the
typical ones; where each is from stands beside it (M: memory of the data sheet).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE / "spice"), str(HERE.parents[1] / "firmware" / "protocol")]

import power  # noqa: E402
from netlist import Board, build  # noqa: E402
from schema_hash import load_board  # noqa: E402

LP2951_33_TOLERANCE = 0.012  # over temperature, M
SENSOR_SPAN = 41.5e-3  # MPX2050 at 10 V, V
# Offset, its stability, its hysteresis, and its change from 25 to 0 or 85 degC, V at 10 V.
SENSOR_ZERO = 1.0e-3 + 0.2e-3 + 0.2e-3 + 1.0e-3
AMPLIFIER_OFFSET = 50e-6 + 500e-6 / 36 + 60 * (0.5e-6 + 20e-6 / 36)  # and 60 K, V
AMPLIFIER_GAIN_ERROR = 0.006  # with the gain resistor's 0.1 %
DIVIDER_TOLERANCE = 0.002
MEGA_VOLTS = (4.5, 5.5)  # fed from USB or by its own regulator
SURGE_VOLTS = 19.1  # of the suppressor at the 8 A that trip the fuse at once: 17.2 V + 6 V · 8/25.9
WRONG_PLUG_VOLTS = 13.8  # the board's own highest supply on a line that is not for it
ACCELERATION_G = 1.5


@dataclass(frozen=True)
class Limit:
    """One limit: what the part sees at worst, and the range in which its maker guarantees it.

    part, quantity: for people. worst: in `unit`. least, most: None where there is no such limit.
    """

    part: str
    quantity: str
    worst: float
    unit: str
    source: str
    least: float | None = None
    most: float | None = None

    @property
    def margin(self) -> float:
        """How far within the limit; negative beyond it."""
        below = [] if self.least is None else [self.worst - self.least]
        above = [] if self.most is None else [self.most - self.worst]
        return min(below + above)


def limits(board: Board) -> list[Limit]:
    """All limits that the circuit touches."""
    return [
        *_supplies(board),
        *_amplifiers(board),
        *_converter(board),
        *_logic(board),
        *_faults(board),
    ]


def _excitation(board: Board) -> tuple[float, float]:
    nominal = power.budget(board).excitation_volts
    return nominal * (1 - power.LP2951_TOLERANCE), nominal * (1 + power.LP2951_TOLERANCE)


def _ref(board: Board) -> tuple[float, float]:
    ohms = power.resistances(board)
    share = ohms("R407") / (ohms("R406") + ohms("R407"))
    low, high = _excitation(board)
    return low * share * (1 - DIVIDER_TOLERANCE), high * share * (1 + DIVIDER_TOLERANCE)


def _avdd() -> tuple[float, float]:
    return 3.3 * (1 - LP2951_33_TOLERANCE), 3.3 * (1 + LP2951_33_TOLERANCE)


def _supply(board: Board) -> float:
    """The least 12 V behind fuse and FET."""
    drop = power.budget(board).input_amperes * (power.FUSE_OHMS + power.FET_OHMS)
    return power.SUPPLY_VOLTS[0] - drop


def _output(board: Board, zero: float, span: float, high: bool) -> float:
    """An amplifier's output, V, of a bridge that gives zero + span at 10 V."""
    ohms = power.resistances(board)
    gain = (1 + 50e3 / ohms("R105")) * (1 + AMPLIFIER_GAIN_ERROR)
    end = 1 if high else 0
    terminals = (zero + span) * _excitation(board)[end] / 10
    return _ref(board)[end] + gain * (terminals + (AMPLIFIER_OFFSET if high else -AMPLIFIER_OFFSET))


def _supplies(board: Board) -> list[Limit]:
    low, high = _avdd()
    excitation = _excitation(board)[1]
    return [
        Limit("LP2951", "input in a surge", SURGE_VOLTS, "V", "another maker's", most=30.0),
        Limit("R-78E5.0-0.5", "input in a surge", SURGE_VOLTS, "V", "M", most=28.0),
        Limit(
            "Mega 2560",
            "VIN in a surge",
            SURGE_VOLTS - power.resistances(board)("R604") * power.MEGA_AMPERES,
            "V",
            "M",
            most=20.0,
        ),
        Limit("IRLML9301", "drain to source, poles exchanged", 13.8, "V", "M", most=30.0),
        Limit("IRLML9301", "gate to source, zener at its end", 12.7, "V", "M", most=20.0),
        Limit("10u", "on 12 V in a surge", SURGE_VOLTS, "V", "marking", most=25.0),
        Limit("MPX2050", "supply", excitation, "V", "M", most=16.0),
        Limit("AD7124-8", "AVDD at full power, least", low, "V", "revision F", least=2.9),
        Limit("AD7124-8", "AVDD, most", high, "V", "revision F", most=3.6),
        Limit("LIS3L06AL", "supply, most", high, "V", "M", least=2.4, most=3.6),
        Limit("OPA333", "supply, most", high, "V", "M", least=1.8, most=5.5),
        Limit("INA128", "supply in a surge", SURGE_VOLTS, "V", "SBOS051", most=36.0),
    ]


def _amplifiers(board: Board) -> list[Limit]:
    supply = _supply(board)
    low, high = _excitation(board)
    half_span = _output(board, SENSOR_ZERO, SENSOR_SPAN, high=True) - _ref(board)[1]
    return [
        Limit(
            "INA128",
            "output at zero pressure, lowest",
            _output(board, -SENSOR_ZERO, 0.0, high=False),
            "V",
            "M of SBOS051",
            least=1.4,
        ),
        Limit(
            "INA128",
            "output at full scale, highest",
            _output(board, SENSOR_ZERO, SENSOR_SPAN, high=True),
            "V",
            "M of SBOS051",
            most=supply - 1.4,
        ),
        Limit("INA128", "inputs, lowest", low / 2 - 0.1, "V", "SBOS051", least=2.0),
        Limit("INA128", "inputs, highest", high / 2 + 0.1, "V", "SBOS051", most=supply - 2.0),
        Limit(
            "INA128",
            "its input amplifiers' outputs, highest",
            high / 2 + 0.1 + half_span / 2,
            "V",
            "taken as its output's",
            most=supply - 1.4,
        ),
        Limit("OPA333", "output REF, highest", _ref(board)[1], "V", "M", least=0.1, most=3.16),
    ]


def _converter(board: Board) -> list[Limit]:
    ohms = power.resistances(board)
    avdd = _avdd()[0]
    low, high = _excitation(board)
    refin1 = ohms("R405") / (ohms("R404") + ohms("R405"))
    divided = ohms("R402") / (ohms("R401") + ohms("R402"))
    description = load_board(HERE.parents[1] / "firmware" / "protocol" / "board.yaml")
    beyond = description["adc"]["buffer_headroom_volts"]
    sensitivity, zero = 3.3 / 5 * 1.1, 3.3 / 2
    full = _output(board, SENSOR_ZERO, SENSOR_SPAN, high=True)
    return [
        Limit("AD7124-8", "AIN0, highest", full, "V", "revision F", beyond, avdd - beyond),
        Limit(
            "AD7124-8",
            "AIN0 − AIN1 over REFIN1, highest",
            (full - _ref(board)[1]) / (high * refin1),
            "1",
            "revision F",
            most=1.0,
        ),
        Limit("AD7124-8", "REFIN1+, highest", high * refin1, "V", "revision F", 0.5, avdd - beyond),
        Limit("AD7124-8", "REFIN1+, lowest", low * refin1, "V", "revision F", 0.5, avdd - beyond),
        Limit(
            "AD7124-8",
            f"AIN4 at {ACCELERATION_G} g, highest",
            zero * 1.06 + ACCELERATION_G * sensitivity,
            "V",
            "revision F",
            beyond,
            avdd - beyond,
        ),
        Limit(
            "AD7124-8",
            f"AIN4 at −{ACCELERATION_G} g, lowest",
            zero * 0.94 - ACCELERATION_G * sensitivity,
            "V",
            "revision F",
            beyond,
            avdd - beyond,
        ),
        Limit("AD7124-8", "AIN7, highest", high * divided, "V", "revision F", beyond, 2.5 * 0.998),
        Limit(
            "AD7124-8",
            "input current, amplifier at its supply",
            1e3 * power.saturation_amperes(board),
            "mA",
            "revision F",
            most=10.0,
        ),
    ]


def _logic(board: Board) -> list[Limit]:
    ohms = power.resistances(board)
    avdd_low, avdd_high = _avdd()
    mega_low, mega_high = MEGA_VOLTS
    pulled_up = mega_high / ohms("R701")
    return [
        Limit("74LVC244A", "input high from the Mega", mega_low - 0.9, "V", "M", least=2.0),
        Limit("74LVC244A", "input high, most", mega_high, "V", "M", most=5.5),
        Limit("AD7124-8", "input high", avdd_low - 0.2, "V", "M", least=0.7 * avdd_high),
        Limit("74AHCT1G125", "input high from DOUT", avdd_low - 0.35, "V", "M", least=2.0),
        Limit("ATmega2560", "input high from DOUT", mega_low - 0.1, "V", "M", 0.6 * mega_low),
        Limit(
            "ATmega2560", "encoder low, open collector", 0.4, "V", "encoder: M", most=0.3 * mega_low
        ),
        Limit("E6B2-CWZ6C", "sinks of its pull-up", 1e3 * pulled_up, "mA", "M", most=35.0),
        Limit(
            "VNH5019",
            "PWM high behind 1 kΩ, 10 kΩ at the driver",
            (mega_low - 0.9) * 10 / 11,
            "V",
            "M",
            least=2.1,
        ),
        Limit("VNH5019", "PWM with a broken wire, 10 µA", 0.1, "V", "M", most=0.9),
    ]


def _faults(board: Board) -> list[Limit]:
    """12 V on a line of an encoder or of J7: a plug with wrong poles."""
    ohms = power.resistances(board)
    series, pull_up = ohms("R703"), ohms("R701")
    clamped = (WRONG_PLUG_VOLTS - MEGA_VOLTS[1]) / series
    pushed = 4 * (clamped + (WRONG_PLUG_VOLTS - MEGA_VOLTS[1]) / pull_up)
    return [
        Limit("BAT54S", "12 V on a line", 1e3 * clamped, "mA", "M", most=200.0),
        Limit("ATmega2560", "pin over its supply, clamped", 0.35, "V", "M", most=0.5),
        Limit("0603 resistor", "12 V on a line", 1e3 * clamped**2 * series, "mW", "M", most=100.0),
        Limit(
            "Mega 2560",
            "takes what 12 V on four lines push into 5 V",
            1e3 * pushed,
            "mA",
            "estimate of its own",
            most=1e3 * power.MEGA_AMPERES,
        ),
        Limit("INA128", "input with 12 V on it", WRONG_PLUG_VOLTS, "V", "SBOS051", most=40.0),
    ]


def tables(board: Board | None = None) -> str:
    """All limits in Markdown."""
    lines = ["| part | what | at worst | guaranteed | left | source |", "|---|---|---|---|---|---|"]
    for found in limits(board or build()):
        ends = (found.least, found.most)
        low, high = ("" if end is None else f"{end:.3g}" for end in ends)
        span = f"{low} … {high}" if low and high else f"≥ {low}" if low else f"≤ {high}"
        unit = "" if found.unit == "1" else f" {found.unit}"
        lines.append(
            f"| {found.part} | {found.quantity} | {found.worst:.4g}{unit} | {span}{unit} "
            f"| {found.margin:.2g}{unit} | {found.source} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    print(tables())
