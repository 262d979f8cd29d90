# SPDX-License-Identifier: Apache-2.0
"""Drawing of the tow-fish: side, top and end view, and its centres enlarged.

A rig file knows the hull's length and diameter only. Nose and tail are drawn after the usual
practice of this kind of fish and say so; a fin follows from its area and the place of its centre of
pressure: half its span outside the hull, a quarter of its chord abaft its leading edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from towtank_rig import Quantity, Rig
from towtank_rig.quantity import Vector
from towtank_rig.tow import Fin, Fish

from towtank_workshop.sheet import (
    DrawingError,
    Point,
    Sheet,
    View,
    derived_label,
    follows,
    length_label,
    scale_for,
)

_NOSE = 1.0  # length of the nose, in diameters
_TAIL = 1.5  # length of the tail cone, in diameters
_TAIL_END = 0.45  # diameter of the tail's end, in diameters
_FIN_THICKNESS = 0.003  # m, for a plane fin seen on its edge
_LENGTH_ROOM, _WIDTH_ROOM = 262.0, 66.0  # mm on the sheet


@dataclass(frozen=True)
class FinShape:
    """A plane rectangular fin: span outside the hull, chord, and its leading edge's x, m."""

    span: float
    chord: float
    leading_edge: float
    side: float
    """+1 or -1: to which side of the hull it stands out."""


def fin_shape(fin: Fin, fish: Fish) -> FinShape:
    """Return the rectangle of a fin. DrawingError where its centre lies inside of the hull."""
    aside = (fin.position.y if fin.plane == "horizontal" else fin.position.z).value
    span = 2.0 * (abs(aside) - fish.diameter.value / 2.0)
    if span <= 0.0:
        raise DrawingError(
            f"fin {fin.name}: its centre of pressure lies inside of the hull; correct its position"
        )
    chord = fin.area.value / span
    leading_edge = fin.position.x.value + chord / 4.0
    return FinShape(span, chord, leading_edge, math.copysign(1.0, aside))


def hull_profile(fish: Fish, steps: int = 24) -> list[Point]:
    """Return the outline of the hull in its plane of symmetry, m: x forward, the other upwards."""
    half, radius = fish.length.value / 2.0, fish.diameter.value / 2.0
    nose = _NOSE * fish.diameter.value
    tail = _TAIL * fish.diameter.value
    upper = [(-half, _TAIL_END * radius), (-half + tail, radius), (half - nose, radius)]
    for step in range(1, steps + 1):
        angle = math.pi / 2.0 * (1.0 - step / steps)
        upper.append((half - nose + nose * math.cos(angle), radius * math.sin(angle)))
    return upper + [(x, -z) for x, z in reversed(upper[:-1])]


def draw(rig: Rig, number: int, count: int) -> Sheet:
    """Return the sheet of the tow-fish."""
    fish = rig.fish
    sheet = Sheet(rig, "Tow-fish", number, count)
    width = max([fish.diameter.value, *(2 * _reach(fin, fish) for fin in fish.fins)])
    scale = min(scale_for(fish.length.value, _LENGTH_ROOM), scale_for(width, _WIDTH_ROOM))
    side = sheet.view((160.0, 240.0), scale, "Side view, from starboard", below=-41.0)
    top = sheet.view((160.0, 122.0), scale, "Top view", below=-41.0)
    end = sheet.view((357.0, 240.0), scale, "From aft", below=-41.0)
    _side(sheet, side, rig)
    _top(sheet, top, rig)
    _end(sheet, end, rig)
    _centres(sheet, fish)
    sheet.quantities(
        (137.0, 62.0),
        (40.0, 38.0),
        {
            "mass in air, drained": fish.dry_mass,
            "mass in water, filled": fish.mass_in_water_filled,
            "displaced mass": follows(
                f"{fish.displaced_mass:g} kg",
                (fish.mass_in_water_filled, fish.apparent_mass_in_water),
            ),
            "apparent mass in water": fish.apparent_mass_in_water,
            "pitch inertia, filled": fish.pitch_inertia,
            "roll inertia": fish.roll_inertia,
        },
    )
    sheet.notes(
        (16.0, 61.0),
        (
            "Origin at mid-hull, the centre of buoyancy; x forward,\n y to port, z up.",
            "Nose and tail: the rig gives length and diameter only;\n their shape is an example.",
            "Fins: rectangles by their area, half the span outside the hull, centre of\n"
            " pressure at a quarter of the chord; plane sections.",
            "Ballast: rings inside the hull, masses and places from towtank masses and\n"
            " towtank trim; on the underside first, the fish must stand upright.",
            "The hull floods: holes at its highest and lowest place, fore\n and aft.",
        ),
    )
    return sheet


def _reach(fin: Fin, fish: Fish) -> float:
    return fish.diameter.value / 2.0 + fin_shape(fin, fish).span


def _hull(sheet: Sheet, view: View, fish: Fish) -> None:
    half, radius = fish.length.value / 2.0, fish.diameter.value / 2.0
    sheet.outline(view.all(hull_profile(fish)), order=3)
    for x in (half - _NOSE * fish.diameter.value, -half + _TAIL * fish.diameter.value):
        sheet.line(view.all([(x, -radius), (x, radius)]), width=0.18, order=4)
    over = 5.0 / (1e3 * view.scale)
    sheet.axis(view.at((-half - over, 0.0)), view.at((half + over, 0.0)))
    sheet.axis(view.at((0.0, -radius - over)), view.at((0.0, radius + over)))


def _fins(sheet: Sheet, view: View, fish: Fish, flat: str) -> None:
    """Fins whose plane is `flat` are seen flat, the others on their edge."""
    for fin in fish.fins:
        shape = fin_shape(fin, fish)
        aft = shape.leading_edge - shape.chord
        if fin.plane == flat:
            reach = shape.side * _reach(fin, fish)
            corners = [(shape.leading_edge, 0.0), (shape.leading_edge, reach), (aft, reach)]
            sheet.outline(view.all([*corners, (aft, 0.0)]), order=2)
        else:
            edge = _FIN_THICKNESS / 2.0
            corners = [(shape.leading_edge, edge), (aft, edge), (aft, -edge)]
            sheet.outline(view.all([*corners, (shape.leading_edge, -edge)]), order=4)


def _place(vector: Vector, axes: str) -> Point:
    first, second = (getattr(vector, axis).value for axis in axes)
    return (first, second)


def _coordinates(vector: Vector) -> tuple[str, bool]:
    parts = [f"{axis} {length_label(getattr(vector, axis)).text}" for axis in "xyz"]
    return ", ".join(parts), any(getattr(vector, axis).basis == "assumed" for axis in "xyz")


def _stations(rig: Rig) -> list[tuple[str, Vector]]:
    fish, sensors = rig.fish, rig.sensors
    return [
        ("tow point, eye-bolt", fish.tow_point),
        ("pressure port", sensors.fish_pressure.position),
        ("accelerometer", sensors.accelerometer.position),
    ]


def _side(sheet: Sheet, view: View, rig: Rig) -> None:
    fish = rig.fish
    half, radius = fish.length.value / 2.0, fish.diameter.value / 2.0
    _fins(sheet, view, fish, "vertical")
    _hull(sheet, view, fish)
    low = view.at((0.0, -radius))[1]
    rows = [low - 9.0 - 8.0 * row for row in range(5)]
    level = view.at((0.0, radius))[1] + 9.0
    # Words over the hull from the tail to the nose, so that leaders do not cross.
    for (name, vector), dx in zip(
        sorted(_stations(rig), key=lambda item: item[1].x.value), (-24.0, -5.0, 10.0), strict=True
    ):
        place = view.at(_place(vector, "xz"))
        sheet.dot(place)
        text, assumed = _coordinates(vector)
        at = (place[0] + dx, level + (9.0 if dx == -5.0 else 0.0))
        sheet.callout(place, at, f"{name}\n{text}", assumed)
    sheet.horizontal(
        view, (0.0, 0.0), _along(fish.tow_point.x), rows[1], length_label(fish.tow_point.x)
    )
    port = rig.sensors.fish_pressure.position.x
    if port.value:
        sheet.horizontal(view, (0.0, 0.0), _along(port), rows[0], length_label(port))
    for fin in fish.fins[:1]:
        sheet.horizontal(
            view, _along(fin.position.x), (0.0, 0.0), rows[1], length_label(fin.position.x)
        )
    sheet.horizontal(view, (-half, 0.0), (half, 0.0), rows[2], length_label(fish.length))
    x = view.at((half, 0.0))[0] + 12.0
    middle = half - _NOSE * fish.diameter.value
    sheet.vertical(view, (middle, -radius), (middle, radius), x, length_label(fish.diameter, "⌀"))


def _along(quantity: Quantity) -> Point:
    return (quantity.value, 0.0)


def _top(sheet: Sheet, view: View, rig: Rig) -> None:
    fish = rig.fish
    _fins(sheet, view, fish, "horizontal")
    _hull(sheet, view, fish)
    for _, vector in _stations(rig):
        sheet.dot(view.at(_place(vector, "xy")))
    for fin in [fin for fin in fish.fins if fin.plane == "horizontal"][:1]:
        shape = fin_shape(fin, fish)
        reach = shape.side * _reach(fin, fish)
        aft = shape.leading_edge - shape.chord
        low = view.at((0.0, -abs(reach)))[1] - 9.0
        sheet.horizontal(
            view,
            (aft, -abs(reach)),
            (shape.leading_edge, -abs(reach)),
            low,
            derived_label(shape.chord, (fin.area, fin.position.y, fish.diameter)),
        )
        sheet.vertical(
            view,
            (shape.leading_edge, shape.side * fish.diameter.value / 2.0),
            (shape.leading_edge, reach),
            view.at((shape.leading_edge, 0.0))[0] + 12.0,
            derived_label(shape.span, (fin.position.y, fish.diameter)),
        )


def _end(sheet: Sheet, view: View, rig: Rig) -> None:
    fish = rig.fish
    radius = fish.diameter.value / 2.0
    reaches = [radius]
    for fin in fish.fins:
        shape = fin_shape(fin, fish)
        edge, reach = _FIN_THICKNESS / 2.0, shape.side * _reach(fin, fish)
        reaches.append(abs(reach))
        box = [(0.0, -edge), (reach, -edge), (reach, edge), (0.0, edge)]
        # Seen from aft, port (y > 0) is on the left.
        flat = fin.plane == "horizontal"
        sheet.outline(view.all([(-u, v) if flat else (v, u) for u, v in box]), order=2)
    factor = 1e3 * view.scale
    sheet.circle(view.at((0.0, 0.0)), radius * factor, order=3)
    sheet.circle(view.at((0.0, 0.0)), _TAIL_END * radius * factor, order=4)
    over = max(reaches) + 4.0 / factor
    sheet.axis(view.at((-over, 0.0)), view.at((over, 0.0)))
    sheet.axis(view.at((0.0, -over)), view.at((0.0, over)))
    horizontal = [fin for fin in fish.fins if fin.plane == "horizontal"]
    if len(horizontal) > 1:
        tips = [fin_shape(fin, fish).side * _reach(fin, fish) for fin in horizontal]
        low, high = min(tips), max(tips)
        label = derived_label(high - low, [fish.diameter, *(fin.position.y for fin in horizontal)])
        y = view.at((0.0, -max(reaches)))[1] - 9.0
        sheet.horizontal(view, (-high, 0.0), (-low, 0.0), y, label)
    left = view.at((-max(reaches), 0.0))[0]
    sheet.text((left, view.origin[1] + 6.0), "port", size=7)


def _centres(sheet: Sheet, fish: Fish) -> None:
    """The centres of buoyancy and gravity, enlarged: they lie a few millimetres apart."""
    gravity = fish.centre_of_gravity
    apart = max(abs(gravity.x.value), abs(gravity.z.value), 1e-3)
    scale = min(5.0, scale_for(apart, 30.0))
    view = sheet.view((330.0, 122.0), scale, "Centres at mid-hull, from starboard", below=-36.0)
    sheet.axis(view.at((0.0, 0.0)), (view.origin[0] - 22.0, view.origin[1]))
    sheet.axis((view.origin[0], view.origin[1] + 14.0), (view.origin[0], view.origin[1] - 36.0))
    buoyancy, place = view.origin, view.at(_place(gravity, "xz"))
    sheet.centre_of(place, "gravity")
    sheet.centre_of(buoyancy, "buoyancy")
    sheet.callout(buoyancy, (buoyancy[0] + 14.0, buoyancy[1] + 8.0), "centre of buoyancy (origin)")
    text, assumed = _coordinates(gravity)
    words = "centre of gravity, enclosed\nwater included\n" + text.replace(", ", "\n")
    sheet.callout(place, (place[0] + 14.0, place[1] - 9.0), words, assumed)
    if gravity.z.value:
        sheet.vertical(
            view, (0.0, 0.0), _place(gravity, "xz"), view.origin[0] - 18.0, length_label(gravity.z)
        )
