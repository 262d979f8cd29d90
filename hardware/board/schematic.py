# SPDX-License-Identifier: Apache-2.0
"""Draws the schematic from the netlist: writes schematic/*.svg."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE))

import schemdraw  # noqa: E402
from netlist import Board, build  # noqa: E402
from sheet import Sheet  # noqa: E402

FOLDER = HERE / "schematic"


def pressure(board: Board) -> Sheet:
    """Both bridges with their amplifiers and filters."""
    sheet = Sheet(board)
    for y, block, connector, ain in ((0.0, "1", "J2", "AIN0"), (-15.0, "2", "J3", "AIN2")):
        _bridge(sheet, y, block, connector, ain)
    return sheet


def _bridge(sheet: Sheet, y: float, block: str, connector: str, ain: str) -> None:
    plus, minus = y, y - 6.0
    sheet.box(connector, (-1, plus), 4, right=("2", "3", "1", "4"))
    sheet.flag("EXC10", (4, y - 2))
    sheet.flag("GND", (4, y - 4))
    for level, series, bias, shunt in (
        (plus, "R{}01", "R{}03", "C{}01"),
        (minus, "R{}02", "R{}04", "C{}02"),
    ):
        sheet.wire((4, level), (6, level))
        sheet.two(series.format(block), (6, level), (9, level))
        sheet.wire((9, level), (19, level))
        for x, part in ((10.0, bias), (13.0, shunt)):
            sheet.two(part.format(block), (x, level), (x, level - 2.2))
            sheet.flag("GND", (x, level - 2.2))
    sheet.two(f"C{block}03", (15.5, plus), (15.5, minus))
    sheet.box(
        f"U{block}01",
        (20, y),
        4,
        left=("IN+", "RG1", "RG2", "IN-"),
        right=("V+", "OUT", "REF", "V-"),
    )
    sheet.wire((19, y - 2), (17.8, y - 2))
    sheet.two(f"R{block}05", (17.8, y - 2), (17.8, y - 4))
    sheet.wire((17.8, y - 4), (19, y - 4))
    sheet.flag("12V", (25, y), "up")
    sheet.flag("GND", (25, y - 6))
    sheet.wire((25, y - 2), (26, y - 2))
    sheet.two(f"R{block}06", (26, y - 2), (29, y - 2))
    sheet.wire((29, y - 2), (36, y - 2))
    sheet.flag(ain, (36, y - 2))
    sheet.two(f"C{block}04", (30, y - 2), (30, y - 4))
    sheet.wire((25, y - 4), (30, y - 4))
    sheet.flag("REF", (30, y - 4))
    sheet.two(f"C{block}05", (33.5, y - 2), (33.5, y - 4.2))
    sheet.flag("GND", (33.5, y - 4.2))
    _shunts(sheet, 40, y - 2, ("12V", f"C{block}06"))


def supplies(board: Board) -> Sheet:
    """Protection, the three supplies, and the references made from the excitation."""
    sheet = Sheet(board)
    sheet.box("J1", (0, 0), 2.5, right=("1", "2"))
    sheet.flag("GND", (3.5, -2))
    sheet.wire((3.5, 0), (5, 0))
    sheet.two("F801", (5, 0), (8, 0))
    sheet.wire((8, 0), (12, 0))
    sheet.two("D801", (9.5, 0), (9.5, -2.5))
    sheet.flag("GND", (9.5, -2.5))
    sheet.box("Q801", (13, 0), 3, left=("D",), right=("S", "G"))
    sheet.wire((17, 0), (29, 0))
    sheet.flag("12V", (29, 0))
    sheet.wire((17, -2), (20.5, -2))
    sheet.two("D802", (20.5, -2), (20.5, 0))
    sheet.two("R801", (18, -2), (18, -4.5))
    sheet.flag("GND", (18, -4.5))
    for x, part in ((24.0, "C801"), (26.5, "C802")):
        sheet.two(part, (x, 0), (x, -2.5))
        sheet.flag("GND", (x, -2.5))

    y = -9.0
    sheet.box("U801", (2, y), 4.5, left=("IN", "SHUTDOWN", "GND"), right=("OUT", None, "FB"))
    sheet.flag("12V", (1, y), "up")
    _to_ground(sheet, (1, y - 2), (1, y - 4))
    sheet.wire((7.5, y), (18, y))
    sheet.flag("EXC10", (18, y))
    sheet.two("R802", (9, y), (9, y - 4))
    sheet.two("C803", (12, y), (12, y - 4))
    sheet.wire((7.5, y - 4), (12, y - 4))
    sheet.two("R803", (9, y - 4), (9, y - 6.5))
    sheet.flag("GND", (9, y - 6.5))
    sheet.two("C804", (15, y), (15, y - 2.5))
    sheet.flag("GND", (15, y - 2.5))

    sheet.box(
        "U802",
        (24, y),
        4.5,
        left=("IN", "SHUTDOWN", "GND"),
        right=("OUT", "SENSE", "TAP", "FB"),
    )
    sheet.flag("12V", (23, y), "up")
    _to_ground(sheet, (23, y - 2), (23, y - 4))
    sheet.wire((29.5, y), (39, y))
    sheet.flag("3V3", (39, y))
    sheet.wire((29.5, y - 2), (30.5, y - 2), (30.5, y))
    sheet.wire((29.5, y - 4), (30.5, y - 4), (30.5, y - 6), (29.5, y - 6))
    sheet.two("C805", (32.5, y), (32.5, y - 2.5))
    sheet.flag("GND", (32.5, y - 2.5))
    sheet.two("R804", (37, y), (37, y - 2.5))
    sheet.two("D803", (37, y - 5), (37, y - 2.5))
    sheet.flag("GND", (37, y - 5))

    y = -20.0
    sheet.box("U803", (7, y), 4, left=("IN", "GND"), right=("OUT",))
    sheet.wire((2, y), (6, y))
    sheet.flag("12V", (2, y), "up")
    sheet.two("C806", (3.5, y), (3.5, y - 2.5))
    sheet.flag("GND", (3.5, y - 2.5))
    sheet.flag("GND", (6, y - 2))
    sheet.wire((12, y), (16, y))
    sheet.flag("5V_ENC", (16, y))
    sheet.two("C807", (13.5, y), (13.5, y - 2.5))
    sheet.flag("GND", (13.5, y - 2.5))

    middle = _divider(sheet, 22, y + 1, "R404", "R405")
    sheet.wire(middle, (27, middle[1]))
    sheet.flag("REFIN1", (27, middle[1]))
    _to_ground_by(sheet, "C403", (25, middle[1]))
    middle = _divider(sheet, 31.5, y + 1, "R401", "R402")
    sheet.wire(middle, (34, middle[1]))
    sheet.two("R403", (34, middle[1]), (37, middle[1]))
    sheet.wire((37, middle[1]), (44, middle[1]))
    sheet.flag("AIN7", (44, middle[1]))
    _to_ground_by(sheet, "C401", (38.5, middle[1]))
    _to_ground_by(sheet, "C402", (41.5, middle[1]))

    y = -29.0
    middle = _divider(sheet, 2, y, "R406", "R407")
    level = middle[1]
    sheet.wire(middle, (9, level))
    _to_ground_by(sheet, "C404", (5.5, level))
    sheet.box("U401", (10, level), 4, left=("IN+", "IN-"), right=("OUT", "V+", "V-"))
    sheet.wire((9, level - 2), (8.4, level - 2), (8.4, level + 2.3), (16.5, level + 2.3))
    sheet.wire((16.5, level + 2.3), (16.5, level), (15, level))
    sheet.wire((16.5, level), (18, level))
    sheet.flag("REF", (18, level))
    sheet.flag("3V3", (15, level - 2))
    sheet.flag("GND", (15, level - 4))
    _shunts(sheet, 23, level, ("3V3", "C405"))
    return sheet


def converter(board: Board) -> Sheet:
    """Accelerometer and ADC."""
    sheet = Sheet(board)
    sheet.box("J4", (0, 0), 3, right=("3", None, "4", None, "5", None, "6", "1", "2"))
    for number, y in ((1, 0.0), (2, -4.0), (3, -8.0)):
        sheet.wire((4, y), (8, y))
        _to_ground_by(sheet, f"C30{number}", (5, y))
        sheet.two(f"R30{number}", (8, y), (11, y))
        sheet.flag(f"AIN{3 + number}", (11, y))
    sheet.wire((4, -12), (8, -12))
    sheet.two("R304", (11, -12), (8, -12))
    sheet.flag("ST_3V3", (11, -12))
    sheet.wire((7, -12), (7, -13))
    _to_ground_by(sheet, "R305", (7, -13))
    sheet.flag("3V3", (4, -14))
    sheet.flag("GND", (4, -16))

    inputs = [f"AIN{n}" for n in range(8)]
    grounded = [f"AIN{n}" for n in range(8, 16)]
    left = [*inputs, "REFIN1+", "REFOUT", "REFIN1-", *grounded]
    digital = ["CS", "SCLK", "DIN", "DOUT", "SYNC"]
    right = ["AVDD", "IOVDD", None, *digital, None, "REGCAPA", "REGCAPD", None]
    right += ["AVSS", "DGND", "EP"]
    pitch = 1.2
    sheet.box("U501", (19, 0), 6, left=left, right=right, pitch=pitch)
    for name in [*inputs, "REFIN1+", "REFOUT"]:
        sheet.flag(board.net_of("U501", name), sheet.pins["U501", name], "left")
    for name in ["AVDD", "IOVDD", *digital, "REGCAPA", "REGCAPD"]:
        sheet.flag(board.net_of("U501", name), sheet.pins["U501", name])
    _to_ground(sheet, *(sheet.pins["U501", name] for name in ["REFIN1-", *grounded]))
    _to_ground(sheet, *(sheet.pins["U501", name] for name in ("AVSS", "DGND", "EP")))
    _shunts(sheet, 33, 0, ("REGCAPA", "C501"), ("REGCAPD", "C502"), ("REFOUT", "C503"))
    _shunts(sheet, 33, -7, ("3V3", "C504"), ("3V3", "C505"), ("3V3", "C506"))
    sheet.flag("3V3", (33, -13), "up")
    sheet.two("R501", (33, -15.5), (33, -13))
    sheet.flag("DOUT_3V3", (33, -15.5))
    return sheet


def logic(board: Board) -> Sheet:
    """Mega, level shifters and encoders."""
    sheet = Sheet(board)
    for y, block, connector, name in ((0.0, 70, "J5", "CRANK"), (-14.0, 71, "J6", "CARRIAGE")):
        sheet.box(connector, (0, y), 2.5, right=("3", None, None, "4", "1", "2"))
        for number, track, level in ((1, "A", y), (2, "B", y - 6)):
            sheet.wire((3.5, level), (7, level))
            sheet.two(f"R{block}{number}", (5, level), (5, level + 2.5))
            sheet.flag("5V", (5, level + 2.5), "up")
            sheet.two(f"R{block}{number + 2}", (7, level), (10, level))
            sheet.wire((10, level), (13, level))
            _to_ground_by(sheet, f"C{block}{number}", (11.5, level))
            sheet.flag(f"{name}_{track}", (13, level))
        sheet.flag("5V_ENC", (3.5, y - 8))
        sheet.flag("GND", (3.5, y - 10))

    for number, block in enumerate((701, 702, 711, 712)):
        _clamp(sheet, f"D{block}", (2 + 9 * number, -30))

    encoders = ["PD0", "PD1", "PD2", "PD3"]
    drive = ["PH3", "PH4", "PH5"]
    spi = ["PB0", "PB1", "PB2", "PB3", "PE4", "PL0", "PL1"]
    sheet.box(
        "A601",
        (22, 0),
        6,
        left=["VIN", "5V", "GND", None, *encoders],
        right=[*spi, None, *drive],
        pitch=1.5,
    )
    for name in encoders:
        sheet.flag(board.net_of("A601", name), sheet.pins["A601", name], "left")
    sheet.wire((21, 0), (20, 0), (20, 1.5))
    sheet.two("R604", (20, 4), (20, 1.5))
    sheet.flag("12V", (20, 4), "up")
    sheet.flag("5V", (21, -1.5), "left")
    sheet.flag("GND", (21, -3))
    for name in (*spi, *drive):
        sheet.flag(board.net_of("A601", name), sheet.pins["A601", name])

    shifted = ["1A1", "1A2", "1A3", "1A4", "2A1"]
    spare = ["2A2", "2A3", "2A4"]
    sheet.box(
        "U601",
        (38, 0),
        5,
        left=[*shifted, None, "1OE", "2OE", *spare],
        right=[*(name.replace("A", "Y") for name in shifted), None, "VCC", "GND"],
        pitch=1.5,
    )
    for name in shifted:
        sheet.flag(board.net_of("U601", name), sheet.pins["U601", name], "left")
        shifted_pin = name.replace("A", "Y")
        sheet.flag(board.net_of("U601", shifted_pin), sheet.pins["U601", shifted_pin])
    _to_ground(sheet, *(sheet.pins["U601", name] for name in ("1OE", "2OE", *spare)))
    sheet.flag("3V3", sheet.pins["U601", "VCC"])
    sheet.flag("GND", sheet.pins["U601", "GND"])

    sheet.box("U602", (24, -21), 4, left=("A", "OE", "GND"), right=("Y", "VCC"))
    sheet.flag("DOUT_3V3", (23, -21), "left")
    _to_ground(sheet, (23, -23), (23, -25))
    sheet.flag("DOUT", (29, -21))
    sheet.flag("5V", (29, -23))

    sheet.flag("3V3", (35, -20), "up")
    sheet.two("R601", (35, -22.5), (35, -20))
    sheet.flag("CS", (35, -22.5))
    _shunts(sheet, 38, -20, ("SYNC", "R602"), ("ST", "R603"))
    _shunts(sheet, 45, -20, ("3V3", "C601"), ("5V", "C602"))
    return sheet


def drive(board: Board) -> Sheet:
    """The connector of the crank's drive."""
    sheet = Sheet(board)
    for y, pull_down, series, signal in (
        (0, "R723", "R721", "PWM"),
        (-6, "R724", "R722", "ENABLE"),
    ):
        sheet.flag(f"DRIVE_{signal}", (0, y), "left")
        sheet.wire((0, y), (2, y), (5, y))
        _to_ground_by(sheet, pull_down, (2, y))
        sheet.two(series, (5, y), (8, y))
        sheet.wire((8, y), (11, y))
    sheet.flag("E_STOP", (0, -12), "left")
    sheet.wire((0, -12), (2, -12), (5, -12))
    _to_ground_by(sheet, "C721", (2, -12))
    sheet.two("R726", (5, -12), (8, -12))
    sheet.wire((8, -12), (9.5, -12), (11, -12))
    sheet.two("R725", (9.5, -12), (9.5, -9.5))
    sheet.flag("5V", (9.5, -9.5), "up")
    sheet.box("J7", (12, 0), 4, left=("1", None, None, "2", None, None, "3", "4"))
    sheet.flag("GND", (11, -14))
    for number in range(3):
        _clamp(sheet, f"D72{number + 1}", (22, -5 * number))
    return sheet


SHEETS = {
    "1_pressure": pressure,
    "2_supplies": supplies,
    "3_converter": converter,
    "4_logic": logic,
    "5_drive": drive,
}


def draw(board: Board) -> dict[str, Sheet]:
    """All sheets by the name of their file."""
    schemdraw.use("svg")
    sheets = {name: sheet(board) for name, sheet in SHEETS.items()}
    for sheet in sheets.values():
        sheet.dot_junctions()
    return sheets


def _clamp(sheet: Sheet, part: str, place: tuple[float, float]) -> None:
    """Two diodes that keep a net between ground and 5 V, each pin with its flag."""
    x, y = place
    sheet.box(part, place, 3, left=("COM",), right=("K", "A"))
    sheet.flag(sheet.board.net_of(part, "COM"), (x - 1, y), "left")
    sheet.flag("5V", (x + 4, y))
    sheet.flag("GND", (x + 4, y - 2))


def _to_ground(sheet: Sheet, *points: tuple[float, float]) -> None:
    """Joins points that lie above one another, and grounds the lowest."""
    sheet.wire(points[0], points[-1])
    sheet.flag("GND", points[-1])


def _to_ground_by(sheet: Sheet, part: str, point: tuple[float, float]) -> None:
    x, y = point
    sheet.two(part, point, (x, y - 2.2))
    sheet.flag("GND", (x, y - 2.2))


def _shunts(sheet: Sheet, x: float, y: float, *parts: tuple[str, str]) -> None:
    """Parts from a flag to ground, side by side."""
    for number, (net, part) in enumerate(parts):
        place = (x + 3.5 * number, y)
        sheet.flag(net, place, "up" if net in ("12V", "3V3", "5V") else "right")
        _to_ground_by(sheet, part, place)


def _divider(sheet: Sheet, x: float, y: float, top: str, bottom: str) -> tuple[float, float]:
    """Two resistors from the excitation to ground; gives the point between them."""
    sheet.flag("EXC10", (x, y), "up")
    sheet.two(top, (x, y), (x, y - 2.5))
    sheet.two(bottom, (x, y - 2.5), (x, y - 5))
    sheet.flag("GND", (x, y - 5))
    return (x, y - 2.5)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, sheet in draw(build()).items():
        (FOLDER / f"{name}.svg").write_text(sheet.svg(), encoding="utf-8")
