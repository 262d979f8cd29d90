# SPDX-License-Identifier: Apache-2.0
"""Prints the connectors' poles, the channel map and the Mega's pins: the tables of README.md.

Each row's net is the netlist's, the channels are board.yaml's.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE.parents[1] / "firmware" / "protocol")]

from netlist import Board, build  # noqa: E402
from parts import MEGA_PINS  # noqa: E402
from schema_hash import load_board  # noqa: E402

# What is at the other end of each connector's poles.
CONNECTORS = {
    "J1": ("supply", ("+12 V", "0 V")),
    "J2": (
        "fish's MPX2050",
        ("pin 1, ground", "pin 2, +Vout", "pin 3, supply", "pin 4, −Vout"),
    ),
    "J3": (
        "depressor's MPX2050",
        ("pin 1, ground", "pin 2, +Vout", "pin 3, supply", "pin 4, −Vout"),
    ),
    "J4": ("LIS3L06AL", ("Vdd", "GND", "Voutx", "Vouty", "Voutz", "ST")),
    "J5": ("crank encoder", ("+5 V", "0 V", "A", "B")),
    "J6": ("carriage encoder", ("+5 V", "0 V", "A", "B")),
    "J7": ("crank drive", ("driver's PWM", "driver's enable", "emergency-stop button", "0 V")),
}


def connector_table(board: Board) -> str:
    lines = ["| connector | pole | net | wire to |", "|---|---|---|---|"]
    for connector, (device, ends) in CONNECTORS.items():
        for pole, end in enumerate(ends, start=1):
            net = board.net_of(connector, str(pole))
            lines.append(f"| {connector} | {pole} | {net} | {device}: {end} |")
    return "\n".join(lines)


def channel_table(board: Board) -> str:
    description = load_board(HERE.parents[1] / "firmware" / "protocol" / "board.yaml")
    lines = ["| channel | ADC inputs | nets | setup |", "|---|---|---|---|"]
    for channel in description["channels"]:
        inputs = (channel["positive"], channel["negative"])
        nets = " − ".join(board.net_of("U501", name) for name in inputs)
        lines.append(f"| {channel['name']} | {' − '.join(inputs)} | {nets} | {channel['setup']} |")
    return "\n".join(lines)


def mega_table(board: Board) -> str:
    lines = ["| Arduino Mega | ATmega2560 | net | pads of A601 |", "|---|---|---|---|"]
    ports = {**MEGA_PINS, "VIN": "", "5V": "", "GND": ""}
    for arduino, port in ports.items():
        net = board.net_of("A601", arduino) or "on the Mega itself"
        pads = ", ".join(board.kinds["A601"].pads_of(arduino))
        lines.append(f"| {arduino} | {port} | {net} | {pads} |")
    return "\n".join(lines)


def tables() -> str:
    board = build()
    return "\n\n".join((connector_table(board), channel_table(board), mega_table(board)))


if __name__ == "__main__":
    print(tables())
