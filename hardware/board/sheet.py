# SPDX-License-Identifier: Apache-2.0
"""A sheet of the schematic: draws parts of the netlist, and knows which pins its lines join.

What is drawn is judged by geometry: pins and lines that touch are joined, and `Sheet.nets` gives
the result, which the tests compare with the netlist. Coordinates are schemdraw's units, y upwards.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import schemdraw
import schemdraw.elements as elm
from netlist import Board
from wiring import CONNECTORS

Point = tuple[float, float]

SUPPLIES = ("12V", "12V_IN", "EXC10", "3V3", "5V", "5V_ENC")
_FLAG = "#1f4e9c"
_STUB = 1.0


@dataclass
class Sheet:
    """Parts, lines and flags of one sheet.

    pins: the point of each drawn pin, by reference and pin name. flags: net names at points.
    """

    board: Board
    pins: dict[tuple[str, str], Point] = field(default_factory=dict)
    flags: list[tuple[str, Point]] = field(default_factory=list)
    lines: list[tuple[Point, Point]] = field(default_factory=list)
    drawing: schemdraw.Drawing = field(default_factory=lambda: schemdraw.Drawing(show=False))

    def two(self, reference: str, first: Point, second: Point) -> None:
        """A part with two pins from `first` (the kind's first pin) to `second`."""
        kind = self.board.kinds[reference]
        names = [name for _, name, _ in kind.pins]
        self._pin(reference, names[0], first)
        self._pin(reference, names[1], second)
        # A diode's symbol begins at the anode.
        start, end = (second, first) if names[0] == "K" else (first, second)
        symbol = _symbol(reference)
        self.drawing += symbol.endpoints(start, end)
        x, y = (first[0] + second[0]) / 2, (first[1] + second[1]) / 2
        if first[0] == second[0]:
            aside = 1.0 if isinstance(symbol, elm.LED) else 0.55  # beside its arrows
            self._text(f"{reference}\n{kind.name}", (x + aside, y), "left")
        else:
            self._text(reference, (x, y + 0.65), "center")
            self._text(kind.name, (x, y - 0.65), "center")

    def box(
        self,
        reference: str,
        corner: Point,
        width: float,
        left: Sequence[str | None] = (),
        right: Sequence[str | None] = (),
        pitch: float = 2.0,
    ) -> None:
        """A part as a box: `corner` is level with the first pins, whose ends lie one unit outside.

        left, right: names of pins from the top, None for a gap.
        """
        kind = self.board.kinds[reference]
        numbers = {name: number for number, name, _ in kind.pins}
        device, wired = CONNECTORS.get(reference, ("", ()))
        x, y = corner
        height = pitch * (max(len(left), len(right)) - 1) + 2.0
        frame = elm.Rect(corner1=(0, 0), corner2=(width, -height))
        self.drawing += frame.at((x, y + 1.0)).theta(0)
        title = f"{reference}  {device or kind.name}"
        self._text(title, (x + width / 2, y + 1.45), "center")
        for names, edge, out, halign in ((left, x, -1, "left"), (right, x + width, 1, "right")):
            for slot, name in enumerate(names):
                if name is None:
                    continue
                level = y - pitch * slot
                end = (edge + out * _STUB, level)
                self.drawing += elm.Line().endpoints((edge, level), end)
                self._pin(reference, name, end)
                inside = wired[int(name) - 1] if wired else name
                self._text(inside, (edge - out * 0.2, level), halign)
                if numbers[name] != inside:
                    self._text(numbers[name], (edge + out * 0.5, level + 0.3), "center", size=7)

    def wire(self, *points: Point) -> None:
        """A line through points; it joins what its points and stretches touch."""
        for a, b in pairwise(points):
            self.lines.append((a, b))
            self.drawing += elm.Line().endpoints(a, b)

    def flag(self, net: str, point: Point, side: str = "right") -> None:
        """The name of a net at a point; ground and supplies have their signs."""
        self.flags.append((net, point))
        x, y = point
        if net == "GND":
            self.drawing += elm.Ground().at(point).theta(0)
        elif net in SUPPLIES and side == "up":
            self.drawing += elm.Vdd().at(point).theta(0)
            self._text(net, (x, y + 0.95), "center", colour=_FLAG)
        else:
            out = {"right": 0.2, "left": -0.2}[side]
            halign = {"right": "left", "left": "right"}[side]
            self.drawing += elm.Dot(radius=0.06).at(point)
            self._text(net, (x + out, y), halign, colour=_FLAG)

    def dot_junctions(self) -> None:
        """Marks where three lines or more meet; lines that only cross are not joined."""
        ends = [point for line in self.lines for point in line]
        for point in sorted({*ends, *self.pins.values()}):
            branches = ends.count(point) + list(self.pins.values()).count(point)
            branches += 2 * sum(
                _between(point, a, b) and point not in (a, b) for a, b in self.lines
            )
            if branches >= 3:
                self.drawing += elm.Dot(radius=0.09).at(point)

    def svg(self) -> str:
        """The drawing; numbers rounded, so that it is the same on every machine."""
        self.drawing.config(bgcolor="white", margin=0.5)
        text = self.drawing.get_imagedata("svg").decode("utf-8")
        return re.sub(r"-?\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", text) + "\n"

    def nets(self) -> list[tuple[set[str], set[tuple[str, str]]]]:
        """What is joined: for each piece of drawn net its flags and its pins."""
        points = {*self.pins.values(), *(p for _, p in self.flags)}
        points |= {point for line in self.lines for point in line}
        piece = {point: point for point in points}

        def root(point: Point) -> Point:
            while piece[point] != point:
                point = piece[point]
            return point

        for a, b in self.lines:
            for point in points:
                if _between(point, a, b):
                    piece[root(point)] = root(a)
        found: dict[Point, tuple[set[str], set[tuple[str, str]]]] = {}
        for net, point in self.flags:
            found.setdefault(root(point), (set(), set()))[0].add(net)
        for pin, point in self.pins.items():
            found.setdefault(root(point), (set(), set()))[1].add(pin)
        return list(found.values())

    def _pin(self, reference: str, name: str, point: Point) -> None:
        if (reference, name) in self.pins:
            raise ValueError(f"{reference} {name} is drawn twice")
        self.pins[reference, name] = point

    def _text(
        self, text: str, point: Point, halign: str, size: float = 9, colour: str = "black"
    ) -> None:
        label = elm.Label().at(point).theta(0).color(colour)
        self.drawing += label.label(
            text, loc="center", ofst=0, halign=halign, valign="center", fontsize=size
        )


def _symbol(reference: str) -> elm.Element:
    symbols = {
        "C": elm.Capacitor,
        "D801": elm.Zener,
        "D802": elm.Zener,
        "D803": elm.LED,
        "F": elm.FuseIEC,
        "R": elm.ResistorIEC,
    }
    return (symbols.get(reference) or symbols[reference[0]])()


def _between(point: Point, a: Point, b: Point) -> bool:
    (x, y), (ax, ay), (bx, by) = point, a, b
    aside = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    return (
        abs(aside) < 1e-9
        and min(ax, bx) - 1e-9 <= x <= max(ax, bx) + 1e-9
        and min(ay, by) - 1e-9 <= y <= max(ay, by) + 1e-9
    )
