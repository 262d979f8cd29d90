# SPDX-License-Identifier: Apache-2.0
"""The board's circuit: every part and every net, as a SKiDL circuit, and its rule check.

References by block: 1xx fish pressure, 2xx depressor pressure, 3xx accelerometer, 4xx excitation
and references, 5xx ADC, 6xx logic, 7xx encoders and drive, 8xx supplies. Connectors are J1 to J7.
"""

from __future__ import annotations

import contextlib
import io
import logging
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import wraps
from typing import ParamSpec, TypeVar

# On import SKiDL writes log files where it is and warns that there is no KiCad, of which nothing is
# used here.
with (
    tempfile.TemporaryDirectory() as nowhere,
    contextlib.chdir(nowhere),
    contextlib.redirect_stderr(io.StringIO()),
):
    from skidl import POWER, SKIDL, TEMPLATE, Circuit, Net, Part, Pin
    from skidl.logger import erc_logger, stop_log_file_output

    stop_log_file_output()

import parts
from parts import CAPACITORS, RESISTORS, Kind

_TYPES = {
    "in": Pin.types.INPUT,
    "out": Pin.types.OUTPUT,
    "tri": Pin.types.TRISTATE,
    "power": Pin.types.PWRIN,
    "supply": Pin.types.PWROUT,
    "passive": Pin.types.PASSIVE,
    "free": Pin.types.NOCONNECT,
}

# References of the parts that stand for the parameters of the front ends' decks.
DECK_PARTS = {
    "bridge": {
        "R_rg": ("R105", "R205"),
        "R_ser": ("R101", "R102", "R201", "R202"),
        "R_bias": ("R103", "R104", "R203", "R204"),
        "R_fil": ("R106", "R206"),
        "C_cm": ("C101", "C102", "C201", "C202"),
        "C_diff": ("C103", "C203"),
        "C_fil": ("C104", "C204"),
        "C_fcm": ("C105", "C205"),
    },
    "accelerometer": {"C_fil": ("C301", "C302", "C303"), "R_ser": ("R301", "R302", "R303")},
    "excitation": {
        "R_top": ("R401",),
        "R_bottom": ("R402",),
        "R_fil": ("R403",),
        "C_fil": ("C401",),
        "C_fcm": ("C402",),
    },
}


@dataclass
class Board:
    """A circuit in the making; nets and parts by name."""

    circuit: Circuit = field(default_factory=Circuit)
    nets: dict[str, Net] = field(default_factory=dict)
    kinds: dict[str, Kind] = field(default_factory=dict)
    parts: dict[str, Part] = field(default_factory=dict)

    def place(self, kind: Kind, reference: str, **connections: str | None) -> None:
        """Adds a part; `connections` give the net of each pin by the pin's name, or None for an
        open one. Every pin that may not stay open must be named."""
        part = Part(
            name=kind.name,
            tool=SKIDL,
            dest=TEMPLATE,
            ref_prefix=reference.rstrip("0123456789"),
            pins=[Pin(num=n, name=name, func=_TYPES[t]) for n, name, t in kind.pins],
        )(ref=reference, value=kind.name, circuit=self.circuit)
        names = {name for _, name, _ in kind.pins}
        if unknown := connections.keys() - names:
            raise ValueError(f"{reference} ({kind.name}) has no pin {sorted(unknown)[0]}")
        for pin in part.pins:
            net = connections.get(pin.name)
            if net is not None:
                self.net(net).connect(pin)
        self.kinds[reference], self.parts[reference] = kind, part

    def two(self, kind: Kind, reference: str, first: str, second: str) -> None:
        """Adds a part with two pins called 1 and 2."""
        self.place(kind, reference, **{"1": first, "2": second})

    def resistor(self, reference: str, value: str, first: str, second: str) -> None:
        self.two(RESISTORS[value], reference, first, second)

    def capacitor(self, reference: str, value: str, first: str, second: str = "GND") -> None:
        self.two(CAPACITORS[value], reference, first, second)

    def clamp(self, reference: str, net: str) -> None:
        """Keeps a pin of the Mega between its ground and its supply, behind 1 kohm."""
        self.place(parts.CLAMP, reference, A="GND", K="5V", COM=net)

    def net(self, name: str) -> Net:
        if name not in self.nets:
            self.nets[name] = Net(name, circuit=self.circuit)
        return self.nets[name]

    def net_of(self, reference: str, pin: str) -> str | None:
        """The name of the net at a pin, given by number or name; None where it is open."""
        for candidate in self.parts[reference].pins:
            if pin in (candidate.num, candidate.name):
                return candidate.net.name if candidate.net is not None else None
        raise KeyError(f"{reference} has no pin {pin}")


_P = ParamSpec("_P")
_R = TypeVar("_R")


def _with_a_short_stack(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Call it from a thread of its own: SKiDL looks through the whole stack, and all that stands in
    its variables, for each part. Under pytest it took fifty times as long so."""

    @wraps(function)
    def called(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(function, *args, **kwargs).result()

    return called


@_with_a_short_stack
def build() -> Board:
    """The whole board."""
    board = Board()
    _supplies(board)
    _references(board)
    _bridge(board, 100, "J2", "FISH", ain="AIN0")
    _bridge(board, 200, "J3", "DEPRESSOR", ain="AIN2")
    _accelerometer(board)
    _converter(board)
    _logic(board)
    _encoder(board, 700, "J5", "CRANK")
    _encoder(board, 710, "J6", "CARRIAGE")
    _drive(board)
    return board


@_with_a_short_stack
def rule_check(board: Board) -> list[str]:
    """What SKiDL's electrical rule check finds: its errors and warnings, one line each."""
    board.circuit.no_files = True
    found: list[str] = []
    listener = logging.Handler(logging.WARNING)
    listener.emit = lambda record: found.append(record.getMessage())
    erc_logger.addHandler(listener)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            board.circuit.ERC()
    finally:
        erc_logger.removeHandler(listener)
    return found


def _supplies(board: Board) -> None:
    board.place(parts.POWER_INLET, "J1", **{"1": "12V_IN", "2": "GND"})
    board.two(parts.FUSE, "F801", "12V_IN", "12V_FUSED")
    board.place(parts.TVS, "D801", K="12V_FUSED", A="GND")
    # The FET's body diode starts it; with the poles exchanged its gate is at its source.
    board.place(parts.PFET, "Q801", D="12V_FUSED", S="12V", G="GATE")
    board.place(parts.ZENER, "D802", K="12V", A="GATE")
    board.resistor("R801", "100k", "GATE", "GND")
    board.net("12V").drive = POWER  # through the FET, which the rule check takes for a passive part
    board.capacitor("C801", "100u", "12V")
    board.capacitor("C802", "100n", "12V")

    board.place(parts.LP2951, "U801", IN="12V", OUT="EXC10", FB="EXC_FB", SHUTDOWN="GND", GND="GND")
    board.resistor("R802", "97.6k", "EXC10", "EXC_FB")
    board.resistor("R803", "13.7k", "EXC_FB", "GND")
    board.capacitor("C803", "10n", "EXC10", "EXC_FB")
    board.capacitor("C804", "10u tantalum", "EXC10")

    board.place(
        parts.LP2951_33,
        "U802",
        IN="12V",
        OUT="3V3",
        SENSE="3V3",
        TAP="3V3_FB",
        FB="3V3_FB",
        SHUTDOWN="GND",
        GND="GND",
    )
    board.capacitor("C805", "10u tantalum", "3V3")
    # Beside showing the supply, it takes what saturated amplifiers push into the ADC's inputs.
    board.resistor("R804", "220", "3V3", "LED_A")
    board.place(parts.LED, "D803", A="LED_A", K="GND")

    board.place(parts.R78E5, "U803", IN="12V", GND="GND", OUT="5V_ENC")
    board.capacitor("C806", "10u", "12V")
    board.capacitor("C807", "10u", "5V_ENC")


def _references(board: Board) -> None:
    # REFIN1: a quarter of the excitation.
    board.resistor("R404", "30k", "EXC10", "REFIN1")
    board.resistor("R405", "10k", "REFIN1", "GND")
    board.capacitor("C403", "1u film", "REFIN1")
    # REF: 0.151 of the excitation, so that a bridge at zero leaves the amplifiers above their
    # guaranteed swing. Buffered: resistance at an INA128's REF spoils its common-mode rejection.
    board.resistor("R406", "56.2k", "EXC10", "REF_IN")
    board.resistor("R407", "10k", "REF_IN", "GND")
    board.capacitor("C404", "100n", "REF_IN")
    board.place(
        parts.OPA333,
        "U401",
        **{"IN+": "REF_IN", "IN-": "REF", "OUT": "REF", "V+": "3V3", "V-": "GND"},
    )
    board.capacitor("C405", "100n", "3V3")
    # The excitation's own channel.
    board.resistor("R401", "12k", "EXC10", "EXC_DIV")
    board.resistor("R402", "3k", "EXC_DIV", "GND")
    board.resistor("R403", "1.5k", "EXC_DIV", "AIN7")
    board.capacitor("C401", "1u film", "AIN7")
    board.capacitor("C402", "2.2n", "AIN7")


def _bridge(board: Board, block: int, connector: str, name: str, ain: str) -> None:
    def ref(letter: str, number: int) -> str:
        return f"{letter}{block + number}"

    plus, minus, output = f"{name}_P", f"{name}_N", f"{name}_OUT"
    # The connector's poles are the MPX2050's pins.
    board.place(
        parts.TERMINALS[4],
        connector,
        **{"1": "GND", "2": f"{name}_SENSOR_P", "3": "EXC10", "4": f"{name}_SENSOR_N"},
    )
    board.resistor(ref("R", 1), "499", f"{name}_SENSOR_P", plus)
    board.resistor(ref("R", 2), "499", f"{name}_SENSOR_N", minus)
    board.resistor(ref("R", 3), "10meg", plus, "GND")
    board.resistor(ref("R", 4), "10meg", minus, "GND")
    board.capacitor(ref("C", 1), "1n", plus)
    board.capacitor(ref("C", 2), "1n", minus)
    board.capacitor(ref("C", 3), "10n", plus, minus)
    board.place(
        parts.INA128,
        ref("U", 1),
        **{"IN+": plus, "IN-": minus, "RG1": f"{name}_RG1", "RG2": f"{name}_RG2"},
        **{"OUT": output, "REF": "REF", "V+": "12V", "V-": "GND"},
    )
    board.resistor(ref("R", 5), "1.43k", f"{name}_RG1", f"{name}_RG2")
    board.resistor(ref("R", 6), "3.9k", output, ain)
    board.capacitor(ref("C", 4), "1u film", ain, "REF")
    board.capacitor(ref("C", 5), "2.2n", ain)
    board.capacitor(ref("C", 6), "100n", "12V")


def _accelerometer(board: Board) -> None:
    board.place(
        parts.TERMINALS[6],
        "J4",
        **{"1": "3V3", "2": "GND", "3": "ACCEL_X", "4": "ACCEL_Y", "5": "ACCEL_Z", "6": "ACCEL_ST"},
    )
    for number, axis, ain in ((1, "X", "AIN4"), (2, "Y", "AIN5"), (3, "Z", "AIN6")):
        board.capacitor(f"C30{number}", "100n C0G", f"ACCEL_{axis}")
        board.resistor(f"R30{number}", "1k", f"ACCEL_{axis}", ain)
    board.resistor("R304", "1k", "ST_3V3", "ACCEL_ST")
    board.resistor("R305", "100k", "ACCEL_ST", "GND")


def _converter(board: Board) -> None:
    board.place(
        parts.AD7124,
        "U501",
        AIN0="AIN0",
        AIN1="REF",
        AIN2="AIN2",
        AIN3="REF",
        **{f"AIN{n}": f"AIN{n}" for n in range(4, 8)},
        **{f"AIN{n}": "GND" for n in range(8, 16)},
        **{"REFIN1+": "REFIN1", "REFIN1-": "GND", "REFOUT": "REFOUT"},
        REGCAPA="REGCAPA",
        REGCAPD="REGCAPD",
        AVDD="3V3",
        IOVDD="3V3",
        AVSS="GND",
        DGND="GND",
        EP="GND",
        CS="CS_3V3",
        SCLK="SCLK_3V3",
        DIN="DIN_3V3",
        DOUT="DOUT_3V3",
        SYNC="SYNC_3V3",
    )
    for number, net in ((1, "REGCAPA"), (2, "REGCAPD"), (3, "REFOUT"), (4, "3V3"), (5, "3V3")):
        board.capacitor(f"C50{number}", "100n", net)
    board.capacitor("C506", "10u", "3V3")
    # DOUT lets go between the ADC's reset and its first transaction.
    board.resistor("R501", "100k", "DOUT_3V3", "3V3")


def _logic(board: Board) -> None:
    # Takes heat from the Mega's own linear regulator.
    board.resistor("R604", "27", "12V", "MEGA_VIN")
    board.net("MEGA_VIN").drive = POWER
    board.place(
        parts.MEGA,
        "A601",
        **{"VIN": "MEGA_VIN", "GND": "GND", "5V": "5V"},
        PB0="CS",
        PB1="SCLK",
        PB2="DIN",
        PB3="DOUT",
        PE4="DOUT",
        PL0="SYNC",
        PL1="ST",
        PH3="DRIVE_PWM",
        PH4="DRIVE_ENABLE",
        PH5="E_STOP",
        PD0="CRANK_A",
        PD1="CRANK_B",
        PD2="CARRIAGE_A",
        PD3="CARRIAGE_B",
    )
    board.place(
        parts.LVC244,
        "U601",
        **{"VCC": "3V3", "GND": "GND", "1OE": "GND", "2OE": "GND"},
        **{"1A1": "CS", "1Y1": "CS_3V3", "1A2": "SCLK", "1Y2": "SCLK_3V3"},
        **{"1A3": "DIN", "1Y3": "DIN_3V3", "1A4": "SYNC", "1Y4": "SYNC_3V3"},
        **{"2A1": "ST", "2Y1": "ST_3V3", "2A2": "GND", "2A3": "GND", "2A4": "GND"},
    )
    board.capacitor("C601", "100n", "3V3")
    board.place(parts.AHCT125, "U602", OE="GND", A="DOUT_3V3", Y="DOUT", VCC="5V", GND="GND")
    board.capacitor("C602", "100n", "5V")
    # While the Mega is in reset its pins float: ADC not selected and waiting, no self-test.
    board.resistor("R601", "100k", "CS", "3V3")
    board.resistor("R602", "100k", "SYNC", "GND")
    board.resistor("R603", "100k", "ST", "GND")


def _encoder(board: Board, block: int, connector: str, name: str) -> None:
    board.place(
        parts.TERMINALS[4],
        connector,
        **{"1": "5V_ENC", "2": "GND", "3": f"{name}_A_IN", "4": f"{name}_B_IN"},
    )
    for number, track in ((1, "A"), (2, "B")):
        board.resistor(f"R{block + number}", "2.2k", f"{name}_{track}_IN", "5V")
        board.resistor(f"R{block + 2 + number}", "1k", f"{name}_{track}_IN", f"{name}_{track}")
        board.capacitor(f"C{block + number}", "1n", f"{name}_{track}")
        board.clamp(f"D{block + number}", f"{name}_{track}")


def _drive(board: Board) -> None:
    board.place(
        parts.TERMINALS[4],
        "J7",
        **{"1": "DRIVE_PWM_OUT", "2": "DRIVE_ENABLE_OUT", "3": "E_STOP_LOOP", "4": "GND"},
    )
    # In reset the pins float: the motor is off, at the driver's end of the cable as well.
    for number, signal in ((1, "PWM"), (2, "ENABLE")):
        board.resistor(f"R72{number}", "1k", f"DRIVE_{signal}", f"DRIVE_{signal}_OUT")
        board.resistor(f"R72{number + 2}", "100k", f"DRIVE_{signal}", "GND")
        board.clamp(f"D72{number}", f"DRIVE_{signal}")
    # The loop is closed to ground through the button; open, or with a broken wire, it is high.
    board.resistor("R725", "2.2k", "E_STOP_LOOP", "5V")
    board.resistor("R726", "1k", "E_STOP", "E_STOP_LOOP")
    board.capacitor("C721", "100n", "E_STOP")
    board.clamp("D723", "E_STOP")
