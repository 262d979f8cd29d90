# SPDX-License-Identifier: Apache-2.0
"""Prints the bill of materials of the netlist as CSV: bom.csv.

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

HEADER = ("references", "quantity", "value", "maker", "order number", "description")


def bill(board: Board) -> str:
    """One line a kind of part, in the order of its first reference."""
    references: dict[str, list[str]] = {}
    for reference in sorted(board.parts, key=_order):
        references.setdefault(board.kinds[reference].order_number, []).append(reference)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(HEADER)
    for number, users in references.items():
        kind = board.kinds[users[0]]
        row = (" ".join(users), len(users), kind.name, kind.maker, number, kind.description)
        writer.writerow(row)
    return out.getvalue()


def _order(reference: str) -> tuple[str, int]:
    letter, number = re.fullmatch(r"([A-Z]+)(\d+)", reference).groups()
    return letter, int(number)


if __name__ == "__main__":
    print(bill(build()), end="")
