# SPDX-License-Identifier: Apache-2.0
"""A drawing sheet: views to scale, dimensions with arrows, notes and the title block.

Places on the sheet are mm from its lower left corner; a view maps its body's coordinates, m, to
them. The sheet remembers what it has dimensioned and written, so that tests can measure it.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Patch, Polygon, Rectangle
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from towtank_rig import Quantity, Rig

Point = tuple[float, float]
Rows = Mapping[str, "Quantity | Label"]

WIDTH, HEIGHT = 420.0, 297.0  # A3
MARGIN = 10.0
TITLE_WIDTH, TITLE_HEIGHT = 190.0, 40.0
SCALES = (5.0, 2.0, 1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50, 1 / 100, 1 / 200)  # ISO 5455

INK = "black"
ASSUMED = "#1f4e9c"
WATER = "#3a7ca5"
_ARROW = (2.2, 0.35)  # length and half width, mm
_GAP = 1.0  # between an outline and its extension line, mm
_FONT = 7.5  # pt
_ROW = 5.2  # of a table, mm
_MM_PER_INCH = 25.4


class DrawingError(Exception):
    """What the rig describes cannot be drawn; one line."""


def scale_for(length: float, room: float) -> float:
    """Return the largest standard scale at which `length`, m, takes no more than `room`, mm."""
    for scale in SCALES:
        if 1e3 * length * scale <= room:
            return scale
    raise DrawingError(
        f"{length:g} m do not fit a sheet: they are more than a rig of this kind has"
    )


def scale_text(scale: float) -> str:
    """Return a scale as drawings write it: 1:5, 2:1."""
    return f"{scale:g}:1" if scale >= 1.0 else f"1:{1.0 / scale:g}"


def millimetres(value: float, decimals: int = 1) -> str:
    """Return a length, m, in mm."""
    text = f"{1e3 * value:.{decimals}f}".removesuffix(".0")
    return "0" if text == "-0" else text.replace("-", "−")


def quantity_text(quantity: Quantity) -> str:
    """Return any quantity with its unit, an assumed one with its range."""
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    spread = ""
    if quantity.basis == "assumed" and quantity.range is not None:
        spread = f" [{quantity.range[0]:g} … {quantity.range[1]:g}]"
    return f"{quantity.value:g}{spread}{unit}".replace("-", "−").replace("^2", "²")


@dataclass(frozen=True)
class Label:
    """The text of a dimension, rounded to so many decimals; `assumed` is drawn distinctly."""

    text: str
    assumed: bool
    decimals: int = 1

    @property
    def colour(self) -> str:
        return ASSUMED if self.assumed else INK


def length_label(quantity: Quantity, before: str = "") -> Label:
    """Return a length in mm; an assumed one with its range, in brackets."""
    text = before + millimetres(quantity.value)
    if quantity.basis != "assumed":
        return Label(text, False)
    assert quantity.range is not None  # the schema demands it of an assumption
    low, high = (millimetres(end) for end in quantity.range)
    return Label(f"{text} [{low} … {high}]", True)


def follows(text: str, parts: Iterable[Quantity]) -> Label:
    """Return the text of what follows from others, one of them perhaps assumed; in parentheses."""
    return Label(f"({text})".replace("-", "−"), any(part.basis == "assumed" for part in parts))


def derived_label(value: float, parts: Iterable[Quantity], decimals: int = 1) -> Label:
    """Return the label of a length, m, that follows from others."""
    return replace(follows(millimetres(value, decimals), parts), decimals=decimals)


@dataclass(frozen=True)
class Dimension:
    """A drawn dimension: its text, what it measures (m), its ends (mm) and its view's scale."""

    label: Label
    value: float
    ends: tuple[Point, Point]
    scale: float


@dataclass(frozen=True)
class View:
    """A place on the sheet for a body: `origin` (mm) is where its coordinates are zero."""

    origin: Point
    scale: float

    def at(self, point: Point) -> Point:
        """Return the place on the sheet, mm, of a point in the view's plane, m."""
        u, v = point
        factor = 1e3 * self.scale
        return (self.origin[0] + factor * u, self.origin[1] + factor * v)

    def all(self, points: Iterable[Point]) -> list[Point]:
        return [self.at(point) for point in points]


class Sheet:
    """One sheet. `title` names what it shows, `number` its place in the set."""

    def __init__(self, rig: Rig, title: str, number: int, count: int) -> None:
        self.dimensions: list[Dimension] = []
        self.texts: list[Text] = []
        self.shapes: list[Patch] = []  # filled or closed outlines of what is drawn
        self.title_block = (WIDTH - MARGIN - TITLE_WIDTH, MARGIN, TITLE_WIDTH, TITLE_HEIGHT)
        self._rig, self._title, self._number, self._count = rig, title, number, count
        self._scales: list[float] = []
        self._figure = Figure(figsize=(WIDTH / _MM_PER_INCH, HEIGHT / _MM_PER_INCH))
        self._axes = self._figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self._axes.set_xlim(0.0, WIDTH)
        self._axes.set_ylim(0.0, HEIGHT)
        self._axes.axis("off")
        self._frame()

    def view(self, origin: Point, scale: float, title: str = "", below: float = 0.0) -> View:
        """Add a view; its title stands `below` mm under the origin, the scale with it."""
        self._scales.append(scale)
        if title:
            x, y = origin
            self.text((x, y - below), f"{title}  {scale_text(scale)}", size=9, align="center")
        return View(origin, scale)

    def line(
        self,
        points: Sequence[Point],
        width: float = 0.5,
        style: str = "solid",
        colour: str = INK,
        order: int = 2,
    ) -> None:
        """A line through places on the sheet, mm."""
        xs, ys = zip(*points, strict=True)
        self._axes.plot(
            xs,
            ys,
            color=colour,
            linewidth=width * 72 / _MM_PER_INCH,
            linestyle=_STYLES[style],
            zorder=order,
            solid_capstyle="round",
        )

    def outline(
        self, points: Sequence[Point], fill: str = "white", order: int = 3, hatch: str = ""
    ) -> None:
        """A closed outline of a body."""
        self._add(Polygon(points, closed=True, **_body(fill, order, hatch)))

    def circle(self, centre: Point, radius: float, fill: str = "white", order: int = 3) -> None:
        """A circle, radius in mm."""
        self._add(Circle(centre, radius, **_body(fill, order, "")))

    def ellipse(self, centre: Point, width: float, height: float, order: int = 3) -> None:
        """An ellipse, its axes in mm."""
        self._add(Ellipse(centre, width, height, **_body("white", order, "")))

    def centre_of(self, place: Point, kind: str, radius: float = 1.6) -> None:
        """The mark of a centre: `gravity` a quartered disc, `buoyancy` a cross in a circle."""
        x, y = place
        self.circle(place, radius, order=6)
        if kind == "gravity":
            for start in (0.0, math.pi):
                arc = [start + step * math.pi / 16 for step in range(9)]
                wedge = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in arc]
                self.outline([place, *wedge], fill=INK, order=7)
        else:
            for dx, dy in ((radius, 0.0), (0.0, radius)):
                self.line([(x - dx, y - dy), (x + dx, y + dy)], width=0.25, order=7)

    def dot(self, place: Point, radius: float = 0.8, colour: str = INK) -> None:
        """A small filled disc: a tow point, a sensor's place."""
        self._axes.add_patch(Circle(place, radius, facecolor=colour, edgecolor="none", zorder=8))

    def axis(self, *points: Point) -> None:
        """A centre line."""
        self.line(points, width=0.18, style="centre", order=5)

    def horizontal(self, view: View, a: Point, b: Point, y: float, label: Label) -> None:
        """Dimension along the view's first axis between two points, m; its line at y, mm."""
        (ax, ay), (bx, by) = view.at(a), view.at(b)
        self._record(view, label, abs(b[0] - a[0]), ((ax, y), (bx, y)))
        for x, start in ((ax, ay), (bx, by)):
            self._extension((x, start), (x, y))
        self._arrows((ax, y), (bx, y), label)

    def vertical(self, view: View, a: Point, b: Point, x: float, label: Label) -> None:
        """Dimension along the view's second axis between two points, m; its line at x, mm."""
        (ax, ay), (bx, by) = view.at(a), view.at(b)
        self._record(view, label, abs(b[1] - a[1]), ((x, ay), (x, by)))
        for y, start in ((ay, ax), (by, bx)):
            self._extension((start, y), (x, y))
        self._arrows((x, ay), (x, by), label)

    def aligned(self, view: View, a: Point, b: Point, label: Label, aside: float = 0.0) -> None:
        """Dimension along the line between two points, m, moved to its left by `aside`, mm."""
        (ax, ay), (bx, by) = view.at(a), view.at(b)
        length = math.hypot(bx - ax, by - ay)
        nx, ny = -(by - ay) / length * aside, (bx - ax) / length * aside
        start, end = (ax + nx, ay + ny), (bx + nx, by + ny)
        self._record(view, label, math.dist(a, b), (start, end))
        for foot, head in (((ax, ay), start), ((bx, by), end)):
            if aside:
                self._extension(foot, head)
        self._arrows(start, end, label)

    def callout(self, place: Point, at: Point, text: str, assumed: bool = False) -> None:
        """Words about a place, with a leader; `at` is where the words begin."""
        colour = ASSUMED if assumed else INK
        right = at[0] >= place[0]
        shelf = at[0] - 1.0 if right else at[0] + 1.0
        self.line([place, (shelf, at[1])], width=0.18, colour=colour, order=6)
        self.text(at, text, colour=colour, align="left" if right else "right")

    def text(
        self,
        place: Point,
        text: str,
        size: float = _FONT,
        colour: str = INK,
        align: str = "left",
        rotation: float = 0.0,
        weight: str = "normal",
        vertical: str = "center",
    ) -> None:
        """Words on the sheet, by the middle of their height."""
        self.texts.append(
            self._axes.text(
                *place,
                text,
                fontsize=size,
                color=colour,
                ha=align,
                va=vertical,
                zorder=9,
                rotation=rotation,
                rotation_mode="anchor",
                weight=weight,
                family="DejaVu Sans",
                linespacing=1.35,
            )
        )

    def notes(self, place: Point, lines: Sequence[str]) -> None:
        """Numbered notes, downwards from a place; a new line in one is set in."""
        indent = "\n" + 4 * "\N{NO-BREAK SPACE}"
        text = "\n".join(f"{n}. {line}" for n, line in enumerate(lines, 1)).replace("\n ", indent)
        self.text(place, text, vertical="top")

    def quantities(self, place: Point, widths: tuple[float, float], rows: Rows) -> None:
        """A table of quantities and of what follows from them; `place`: its upper left corner."""
        x, y = place
        right = x + sum(widths)
        self.line([(x, y), (right, y)], width=0.35)
        for number, (name, entry) in enumerate(rows.items(), 1):
            bottom = y - _ROW * number
            self.line([(x, bottom), (right, bottom)], width=0.13)
            if isinstance(entry, Quantity):
                entry = Label(quantity_text(entry), entry.basis == "assumed")
            middle = bottom + _ROW / 2
            self.text((x + 1.0, middle), name, size=7)
            self.text((x + widths[0], middle), entry.text, 7, entry.colour)

    def text_boxes(self) -> list[tuple[str, Bbox]]:
        """Return each text with the box that it takes, mm."""
        renderer = FigureCanvasAgg(self._figure).get_renderer()
        to_sheet = self._axes.transData.inverted()
        return [
            (text.get_text(), to_sheet.transform_bbox(text.get_window_extent(renderer)))
            for text in self.texts
        ]

    def svg(self) -> str:
        """The drawing; numbers rounded, so that it is the same on every machine."""
        settings = {"svg.fonttype": "none", "svg.hashsalt": "towtank"}
        buffer = io.StringIO()
        with matplotlib.rc_context(settings):
            self._figure.savefig(
                buffer, format="svg", metadata={"Date": None, "Creator": None}, facecolor="white"
            )
        text = re.sub(r"<[^>]*>", _rounded_tag, buffer.getvalue())
        return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"

    def _frame(self) -> None:
        x, y, width, height = self.title_block
        edge = {"facecolor": "none", "edgecolor": INK, "linewidth": 0.5 * 72 / _MM_PER_INCH}
        inner = (WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN)
        self._axes.add_patch(Rectangle((MARGIN, MARGIN), *inner, zorder=1, **edge))
        self._axes.add_patch(Rectangle((x, y), width, height, zorder=1, **edge))
        for level in (12.0, 24.0):
            self.line([(x, y + level), (x + width, y + level)], width=0.25)
        self.text((x + 3, y + 32), f"{self._title}", size=13, weight="bold")
        self.text((x + width - 3, y + 32), f"{self._number} / {self._count}", 11, align="right")
        self.text((x + 3, y + 20.6), f"rig  {self._rig.name}", size=9, weight="bold")
        digest = self._rig.sha256[:16]
        self.text((x + 3, y + 15.2), f"rig file  SHA-256 {digest}…", size=7)
        self.text((x + width - 3, y + 20.6), "mm, first-angle projection", 7, align="right")
        self.text((x + width - 3, y + 15.2), "towtank drawings", size=7, align="right")
        self.text(
            (x + 3, y + 8.6), "123 \N{EM SPACE}measured, stated or derived in the rig file", size=7
        )
        self.text((x + width / 2 + 3, y + 8.6), "(123) \N{EM SPACE}follows from others", size=7)
        self.text(
            (x + 3, y + 3.6),
            "123 [100 … 150] \N{EM SPACE}assumed, with its range",
            7,
            colour=ASSUMED,
        )
        self.text(
            (x + width / 2 + 3, y + 3.6), "(123) \N{EM SPACE}hangs on an assumption", 7, ASSUMED
        )

    def _add(self, patch: Patch) -> None:
        self.shapes.append(patch)
        self._axes.add_patch(patch)

    def _record(self, view: View, label: Label, value: float, ends: tuple[Point, Point]) -> None:
        self.dimensions.append(Dimension(label, value, ends, view.scale))

    def _extension(self, foot: Point, head: Point) -> None:
        """From near the outline to a little beyond the dimension's line."""
        length = math.dist(foot, head)
        if length <= _GAP:
            return
        ux, uy = (head[0] - foot[0]) / length, (head[1] - foot[1]) / length
        start = (foot[0] + _GAP * ux, foot[1] + _GAP * uy)
        end = (head[0] + 1.5 * ux, head[1] + 1.5 * uy)
        self.line([start, end], width=0.13, order=4)

    def _arrows(self, a: Point, b: Point, label: Label) -> None:
        length = math.dist(a, b)
        ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        if ux < -1e-9 or (abs(ux) <= 1e-9 and uy < 0):
            a, b, ux, uy = b, a, -ux, -uy  # texts run to the right, or upwards
        angle = math.degrees(math.atan2(uy, ux))
        outside = length < 3 * _ARROW[0]
        reach = 2.5 * _ARROW[0] if outside else 0.0
        start = (a[0] - reach * ux, a[1] - reach * uy)
        end = (b[0] + reach * ux, b[1] + reach * uy)
        self.line([start, end], width=0.18, colour=label.colour, order=8)
        sense = -1.0 if outside else 1.0
        self._arrowhead(a, (-sense * ux, -sense * uy), label.colour)
        self._arrowhead(b, (sense * ux, sense * uy), label.colour)
        room = length - 1.0
        if self._width(label.text) <= room:
            middle = ((a[0] + b[0]) / 2 - 1.8 * uy, (a[1] + b[1]) / 2 + 1.8 * ux)
            self.text(middle, label.text, colour=label.colour, align="center", rotation=angle)
        else:
            beyond = (end[0] + 1.5 * ux, end[1] + 1.5 * uy)
            self.text(beyond, label.text, colour=label.colour, align="left", rotation=angle)

    def _arrowhead(self, tip: Point, direction: Point, colour: str) -> None:
        ux, uy = direction
        length, half = _ARROW
        base = (tip[0] - length * ux, tip[1] - length * uy)
        wings = [(base[0] - s * half * uy, base[1] + s * half * ux) for s in (1, -1)]
        self._axes.add_patch(
            Polygon([tip, *wings], closed=True, facecolor=colour, edgecolor="none", zorder=8)
        )

    def _width(self, text: str) -> float:
        """Width of a text in the ordinary size, mm."""
        probe = self._axes.text(0.0, 0.0, text, fontsize=_FONT, family="DejaVu Sans")
        box = probe.get_window_extent(FigureCanvasAgg(self._figure).get_renderer())
        probe.remove()
        return float(self._axes.transData.inverted().transform_bbox(box).width)


_STYLES: dict[str, object] = {
    "solid": "solid",
    "dashed": (0, (5, 3)),
    "centre": (0, (12, 3, 2, 3)),
}


def _body(fill: str, order: int, hatch: str) -> dict[str, object]:
    return {
        "facecolor": fill,
        "edgecolor": INK,
        "linewidth": 0.5 * 72 / _MM_PER_INCH,
        "zorder": order,
        "hatch": hatch or None,
    }


def _rounded_tag(tag: re.Match[str]) -> str:
    """Return a tag of SVG with its numbers rounded; what stands between tags is for people."""
    return re.sub(r"-?\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", tag[0])
