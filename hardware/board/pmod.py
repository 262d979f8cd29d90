# SPDX-License-Identifier: Apache-2.0
"""Prints the wiring of the board's circuit to an EVAL-AD7124-8-PMDZ: the tables of pmod.md.

Nets are the netlist's, channels are board.yaml's; poles and solder jumpers of the evaluation board
are those of its maker's public user guide.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE.parents[1] / "firmware" / "protocol")]

from netlist import Board, build  # noqa: E402
from schema_hash import load_board  # noqa: E402

# Connector and poles of each pin of the ADC.
POLES: dict[str, tuple[str, tuple[int, ...]]] = {
    "CS": ("P1", (1,)),
    "DIN": ("P1", (2,)),
    "DOUT": ("P1", (3,)),
    "SCLK": ("P1", (4,)),
    "DGND": ("P1", (5, 11)),
    "IOVDD": ("P1", (6, 12)),
    **{f"AIN{n}": ("P2", (7 + n,)) for n in range(8)},
    "AVSS": ("P2", (2,)),
    "REFIN1+": ("P2", (15,)),
    "REFIN1-": ("P3", (2,)),
    **{f"AIN{n}": ("P3", (n - 5,)) for n in range(8, 16)},
    "SYNC": ("P3", (12,)),
    "AVDD": ("P3", (15,)),
}
# What stays on the evaluation board: capacitors, the pad, and pins that the firmware leaves alone.
ON_THE_EVALUATION_BOARD = {"REGCAPA", "REGCAPD", "REFOUT", "EP", "PSW", "CLK"}
# Joined there as delivered: no wire of its own is needed.
JUMPERS = {
    "P4": ("REFIN1- to GND", "leave closed"),
    "P5": ("AVDD to IOVDD", "leave closed: both are 3V3"),
    "P6": ("AVSS to GND", "leave closed"),
    "P7": ("REFIN1+ to REFOUT", "**open it**, before anything is wired to P2 pole 15"),
    "P8": ("DOUT to P1 pole 7", "leave closed, pole 7 stays open"),
}
_JUMPERED = {"REFIN1-": "P4", "AVDD": "P5", "AVSS": "P6"}


def wiring_table(board: Board) -> str:
    """Every pin of the ADC that is wired, in the order of the connectors."""
    lines = ["| connector | poles | ADC's pin | net |", "|---|---|---|---|"]
    for pin, (connector, poles) in sorted(POLES.items(), key=lambda item: item[1]):
        net = board.net_of("U501", pin)
        by = f", by jumper {_JUMPERED[pin]}" if pin in _JUMPERED else ""
        lines.append(f"| {connector} | {', '.join(map(str, poles))} | {pin} | {net}{by} |")
    return "\n".join(lines)


def channel_table() -> str:
    """The channel map by the evaluation board's poles."""
    description = load_board(HERE.parents[1] / "firmware" / "protocol" / "board.yaml")
    lines = ["| channel | + | − | setup | reference |", "|---|---|---|---|---|"]
    for channel in description["channels"]:
        ends = (_pole(channel[side]) for side in ("positive", "negative"))
        setup = channel["setup"]
        reference = description["adc"]["setups"][setup]["reference"]
        lines.append(f"| {channel['name']} | {' | '.join(ends)} | {setup} | {reference} |")
    return "\n".join(lines)


def jumper_table() -> str:
    lines = ["| solder jumper | as delivered | here |", "|---|---|---|"]
    lines += [f"| {name} | {joins} | {what} |" for name, (joins, what) in JUMPERS.items()]
    return "\n".join(lines)


def _pole(pin: str) -> str:
    connector, (pole, *_) = POLES[pin]
    return f"{pin}, {connector} pole {pole}"


def tables(board: Board) -> str:
    """All three tables in Markdown."""
    return "\n\n".join((jumper_table(), wiring_table(board), channel_table()))


if __name__ == "__main__":
    print(tables(build()))
