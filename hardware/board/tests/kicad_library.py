# SPDX-License-Identifier: Apache-2.0
"""Symbols and footprints of KiCad's libraries, as far as the tests need them.

Debian's and Ubuntu's packages kicad-symbols and kicad-footprints hold the libraries. Of a library
of megabytes only the one symbol that is asked for is parsed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from simp_sexp import Sexp

LIBRARIES = Path("/usr/share/kicad")

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[()]')


@dataclass(frozen=True)
class Symbol:
    """A symbol: pins as {number: (name, electrical type)}, and the globs of its footprints."""

    pins: dict[str, tuple[str, str]]
    footprint_filters: tuple[str, ...]


@cache
def symbol(identifier: str) -> Symbol:
    """The symbol "library:name"; KeyError if there is none."""
    library, name = identifier.split(":")
    text = (LIBRARIES / "symbols" / f"{library}.kicad_sym").read_text(encoding="utf-8")
    expression = _expression(text, f'(symbol "{name}"')
    properties = {item[1]: item[2] for item in _lists(expression, "property")}
    filters = tuple(str(properties.get("ki_fp_filters", "")).split())
    for parent in _lists(expression, "extends"):
        found = symbol(f"{library}:{parent[1]}")
        return Symbol(found.pins, filters or found.footprint_filters)
    pins = {}
    for unit in _lists(expression, "symbol"):
        for pin in _lists(unit, "pin"):
            (named,), (number,) = _lists(pin, "name"), _lists(pin, "number")
            pins[str(number[1])] = (str(named[1]), str(pin[1]))
    return Symbol(pins, filters)


@cache
def pads(identifier: str) -> frozenset[str]:
    """Numbers of a footprint's pads, those without a number left out; OSError if there is none."""
    library, name = identifier.split(":")
    path = LIBRARIES / "footprints" / f"{library}.pretty" / f"{name}.kicad_mod"
    found = (str(pad[1]) for pad in _lists(Sexp(path.read_text(encoding="utf-8")), "pad"))
    return frozenset(number for number in found if number)


def _expression(text: str, start: str) -> Sexp:
    """The expression that begins with `start` and a blank or line end."""
    match = re.search(rf"^\s+{re.escape(start)}(?=\s)", text, re.MULTILINE)
    if match is None:
        raise KeyError(start)
    begin, depth = text.index("(", match.start()), 0
    for token in _TOKEN.finditer(text, begin):
        depth += {"(": 1, ")": -1}.get(token[0], 0)
        if depth == 0:
            return Sexp(text[begin : token.end()])
    raise KeyError(f"{start} does not end")


def _lists(expression: list, name: str) -> list[list]:
    return [item for item in expression if isinstance(item, list) and item and item[0] == name]
