# SPDX-License-Identifier: Apache-2.0
"""Prints the netlist in KiCad's format, with footprints: board.net.

KiCad's layout editor imports it (File, Import, Netlist) with its own footprint libraries.
"""

from __future__ import annotations

import sys
import uuid
from pathlib import Path

from simp_sexp import Sexp

sys.path.append(str(Path(__file__).resolve().parent))

from netlist import Board, build

# So that a part keeps its place in a layout when the netlist is imported again.
_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_OID, "towtank board")


def export(board: Board) -> str:
    """The netlist as KiCad's s-expression, version E; the same for the same board."""
    references = sorted(board.parts)
    netlist = [
        "export",
        ["version", "E"],
        ["design", ["source", "hardware/board/netlist.py"], ["tool", "hardware/board/kicad.py"]],
        ["components", *(_component(board, reference) for reference in references)],
        ["nets", *(_net(board, code, name) for code, name in enumerate(sorted(board.nets), 1))],
    ]
    expression = Sexp(netlist)
    expression.add_quotes(lambda _: True)
    # KiCad's reader wants a blank behind the first word, no line end.
    return expression.to_str().replace("(export\n", "(export ", 1) + "\n"


def _component(board: Board, reference: str) -> list:
    kind = board.kinds[reference]
    library, _, symbol = kind.symbol.rpartition(":")
    fields = [
        ["field", ["name", name], value]
        for name, value in (("Maker", kind.maker), ("Order number", kind.order_number))
    ]
    return [
        "comp",
        ["ref", reference],
        ["value", kind.name],
        ["footprint", kind.footprint],
        ["fields", *fields],
        ["libsource", ["lib", library], ["part", symbol or kind.name]],
        ["tstamps", str(uuid.uuid5(_NAMESPACE, reference))],
    ]


def _net(board: Board, code: int, name: str) -> list:
    nodes = [
        ["node", ["ref", pin.part.ref], ["pin", pad], ["pinfunction", pin.name]]
        for pin in board.nets[name].pins
        for pad in board.kinds[pin.part.ref].pads_of(pin.num)
    ]
    return ["net", ["code", str(code)], ["name", name], *sorted(nodes)]


if __name__ == "__main__":
    print(export(build()), end="")
