# SPDX-License-Identifier: Apache-2.0
"""Prints the bill of materials of netlist and connectors as CSV: bom.csv.

The order number is the maker's; every distributor finds a part by it.
"""

from __future__ import annotations

import csv
import io
import re
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))

from netlist import Board, build
from parts import OFF_BOARD, Kind

HEADER = ("references", "quantity", "value", "maker", "order number", "description", "place")


def bill(board: Board) -> str:
    """One line a kind of part, in the order of its first reference; then what is off the board.

    The references of the latter are the connectors that it goes to.
    """
    mounted: dict[Kind, list[str]] = {}
    for reference in sorted(board.parts, key=_order):
        mounted.setdefault(board.kinds[reference], []).append(reference)
    connected: dict[Kind, list[str]] = {}
    for connector, kinds in OFF_BOARD.items():
        for kind in kinds:
            connected.setdefault(kind, []).append(connector)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(HEADER)
    for place, users in (("board", mounted), ("off the board", connected)):
        for kind, references in users.items():
            row = (" ".join(references), len(references), kind.name, kind.maker)
            writer.writerow((*row, kind.order_number, kind.description, place))
    return out.getvalue()


def _order(reference: str) -> tuple[str, int]:
    letter, number = re.fullmatch(r"([A-Z]+)(\d+)", reference).groups()
    return letter, int(number)


if __name__ == "__main__":
    print(bill(build()), end="")
