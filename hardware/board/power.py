# SPDX-License-Identifier: Apache-2.0
"""The board's power budget from 12 V: prints the tables of README.md.

Currents are the largest of the data sheets, from memory, or estimates (encoders, Mega); what a
resistor draws follows from the netlist.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

BOARD = Path(__file__).resolve().parent
sys.path += [str(BOARD), str(BOARD / "spice")]

from front_ends import spice_number  # noqa: E402
from netlist import Board, build  # noqa: E402

SUPPLY_VOLTS = (11.4, 13.8)  # 12 V less 5 % to a lead battery on charge
AMBIENT_C = 50.0  # in a closed box

LP2951_REFERENCE_VOLTS = 1.235
LP2951_TOLERANCE = 0.012  # reference 1 %, feedback resistors 0.1 % each
LP2951_DROPOUT_VOLTS = 0.6  # at 100 mA, over temperature
LP2951_OWN_AMPERES = 3.0e-3  # of its ground pin, at 21 mA less
REGULATOR_MAXIMUM_C = 125.0
KELVIN_PER_WATT = {"U801": 160.0, "U802": 160.0, "Mega's regulator": 100.0}  # on little copper
MEGA_AMPERES = 0.09
SWITCHER_EFFICIENCY = 0.8  # R-78E5.0-0.5 at a quarter of its current
SWITCHER_AMPERES = 0.5
FUSE_OHMS = 0.4
FUSE_HOLD_AMPERES = 0.5  # MF-MSMF075/24 at 50 degC
FET_OHMS = 0.1  # IRLML9301, hot
LED_VOLTS = 2.0
BRIDGE_OHMS = 1000.0  # MPX2050: least input resistance
ADC_INPUT_AMPERES = 0.010  # AD7124-8: most that its input diodes may carry


@dataclass(frozen=True)
class Load:
    """A steady load on a supply: rail, what draws, A, and where the figure is from."""

    rail: str
    name: str
    amperes: float
    source: str


@dataclass(frozen=True)
class Budget:
    """Loads, current of each rail, A, and heat of the regulators at the highest supply, W."""

    excitation_volts: float
    loads: tuple[Load, ...]
    rail_amperes: dict[str, float]
    dissipation_watts: dict[str, float]

    @property
    def input_amperes(self) -> float:
        return self.rail_amperes["12V"]

    @property
    def least_supply_volts(self) -> float:
        """At the terminals, for the excitation to be regulated still."""
        drop = self.input_amperes * (FUSE_OHMS + FET_OHMS)
        return self.excitation_volts * (1 + LP2951_TOLERANCE) + LP2951_DROPOUT_VOLTS + drop

    def junction_c(self, regulator: str) -> float:
        return AMBIENT_C + KELVIN_PER_WATT[regulator] * self.dissipation_watts[regulator]


def budget(board: Board) -> Budget:
    """The budget of a board as `netlist.build` gives it."""
    ohms = resistances(board)
    excitation = LP2951_REFERENCE_VOLTS * (1 + ohms("R802") / ohms("R803"))
    dividers = (("R404", "R405"), ("R406", "R407"), ("R401", "R402"), ("R802", "R803"))
    divided = sum(excitation / (ohms(top) + ohms(bottom)) for top, bottom in dividers)
    loads = [
        Load("EXC10", "2 × MPX2050", 2 * excitation / BRIDGE_OHMS, "at least 1 kΩ each"),
        Load("EXC10", "dividers", divided, "netlist"),
        Load("3V3", "AD7124-8", 2.0e-3, "full power, buffers, both supplies"),
        Load("3V3", "LIS3L06AL", 1.5e-3, "data sheet"),
        Load("3V3", "OPA333, 74LVC244A", 0.1e-3, "data sheets"),
        Load("3V3", "LED", (3.3 - LED_VOLTS) / ohms("R804"), "netlist"),
        Load("5V_ENC", "2 encoders", 2 * 0.06, "estimate"),
        Load("12V", "2 × INA128", 2 * 0.75e-3, "data sheet"),
        Load("12V", "2 × LP2951, own current", 2 * LP2951_OWN_AMPERES, "data sheet"),
        Load("12V", "Arduino Mega 2560", MEGA_AMPERES, "estimate, pull-ups included"),
    ]
    rails = {
        rail: sum(load.amperes for load in loads if load.rail == rail)
        for rail in ("EXC10", "3V3", "5V_ENC")
    }
    # The switcher takes the same power at any voltage: most current at the lowest.
    switcher = 5.0 * rails["5V_ENC"] / SWITCHER_EFFICIENCY / SUPPLY_VOLTS[0]
    loads.append(Load("12V", "R-78E5.0-0.5", switcher, f"at {SUPPLY_VOLTS[0]} V"))
    rails["12V"] = (
        rails["EXC10"] + rails["3V3"] + sum(load.amperes for load in loads if load.rail == "12V")
    )
    highest = SUPPLY_VOLTS[1]
    heat = {
        "U801": (highest - excitation) * rails["EXC10"] + highest * LP2951_OWN_AMPERES,
        "U802": (highest - 3.3) * rails["3V3"] + highest * LP2951_OWN_AMPERES,
        "U803": 5.0 * rails["5V_ENC"] * (1 / SWITCHER_EFFICIENCY - 1),
        "R604": ohms("R604") * MEGA_AMPERES**2,
        "Mega's regulator": (highest - ohms("R604") * MEGA_AMPERES - 5.0) * MEGA_AMPERES,
    }
    return Budget(excitation, tuple(loads), rails, heat)


def saturation_amperes(board: Board) -> float:
    """What an amplifier at its upper limit pushes into the ADC at the highest supply, A.

    Nothing guarantees that its output keeps away from the supply.
    """
    return (SUPPLY_VOLTS[1] - 3.3) / resistances(board)("R106")


def resistances(board: Board) -> Callable[[str], float]:
    """A function that gives a resistor's ohms by its reference."""
    return lambda reference: spice_number(board.kinds[reference].name)


def tables() -> str:
    """The loads and what follows from them, in Markdown."""
    board = build()
    found = budget(board)
    lines = ["| rail | load | mA | from |", "|---|---|---|---|"]
    lines += [
        f"| {load.rail} | {load.name} | {1e3 * load.amperes:.1f} | {load.source} |"
        for load in found.loads
    ]
    lines += ["", "| rail | mA |", "|---|---|"]
    lines += [f"| {rail} | {1e3 * amperes:.0f} |" for rail, amperes in found.rail_amperes.items()]
    lines += ["", f"| at {SUPPLY_VOLTS[1]} V | heat, mW |", "|---|---|"]
    lines += [f"| {name} | {1e3 * watts:.0f} |" for name, watts in found.dissipation_watts.items()]
    lines += [
        "",
        f"Excitation {found.excitation_volts:.3f} V, regulated down to "
        f"{found.least_supply_volts:.2f} V at the terminals. In a box at {AMBIENT_C:.0f} °C "
        + ", ".join(f"{name} reaches {found.junction_c(name):.0f} °C" for name in KELVIN_PER_WATT)
        + f". A saturated amplifier pushes {1e3 * saturation_amperes(board):.1f} mA into the ADC's "
        "input.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    print(tables())
