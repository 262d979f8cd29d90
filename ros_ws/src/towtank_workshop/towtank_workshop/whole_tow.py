# SPDX-License-Identifier: Apache-2.0
"""Drawing of the whole tow in the tank: at rest and as towed, in its computed equilibrium."""

from __future__ import annotations

import math

from towtank_rig import Rig

from towtank_workshop.equilibrium import Equilibrium, hang, shaping
from towtank_workshop.sheet import (
    WATER,
    Label,
    Point,
    Sheet,
    View,
    derived_label,
    follows,
    length_label,
    quantity_text,
    scale_for,
    scale_text,
)
from towtank_workshop.tow_fish import hull_profile

_HEIGHT_ROOM, _WIDTH_ROOM = 178.0, 335.0  # mm for water and air; for both views and their gap
_GAP = 85.0  # between the views, mm
_AHEAD = 0.35  # m of water ahead of the tow point
_DECK = 0.25  # m from the tow point, or the water, up to the carriage


def clearance(rig: Rig, state: Equilibrium) -> float:
    """Return the least distance of depressor and fish from the tank's floor, m."""
    floor = -rig.tank.depth.value
    depressor = state.depressor[1] - rig.depressor.diameter.value / 2.0
    return min(depressor, min(z for _, z in _hull(rig, state))) - floor


def draw(rig: Rig, number: int, count: int) -> Sheet:
    """Return the sheet of the whole tow; it says so where the tow would lie on the floor."""
    speed = rig.run.carriage_speed.value
    rest, towed = hang(rig, 0.0), hang(rig, speed)
    sheet = Sheet(rig, "Tow in the tank", number, count)
    top = max(rig.tow_point.height.value, 0.0) + _DECK
    sunk = max(0.0, -clearance(rig, rest), -clearance(rig, towed))  # below the floor
    bottom = rig.tank.depth.value + sunk
    tall, wide = bottom + top, _astern(rig, rest) + _astern(rig, towed) + 2 * _AHEAD
    scale = min(scale_for(tall, _HEIGHT_ROOM), scale_for(wide, _WIDTH_ROOM - _GAP))
    middle_of_room = 76.0 + _HEIGHT_ROOM / 2.0
    surface = middle_of_room + 1e3 * scale * (tall / 2.0 - top)
    feet = surface - 1e3 * scale * bottom - 18.0
    left = 46.0 + 1e3 * scale * _astern(rig, rest)
    right = left + 1e3 * scale * (_AHEAD + _astern(rig, towed)) + _GAP
    for x, state, title in ((left, rest, "At rest"), (right, towed, f"Towed at {speed:g} m/s")):
        view = sheet.view((x, surface), scale)
        edge = x - 1e3 * scale * _astern(rig, state)
        sheet.text((edge, feet), f"{title}, {scale_text(scale)}", size=9)
        _tank(sheet, view, rig, state)
        _tow(sheet, view, rig, state)
        _dimensions(sheet, view, rig, state)
    _words(sheet, View((right, surface), scale), towed)
    _table(sheet, rig, rest, towed)
    return sheet


def _astern(rig: Rig, state: Equilibrium) -> float:
    """How far the tow reaches abaft the tow point, m."""
    return -min(x for x, _ in _hull(rig, state)) + 0.1


def _hull(rig: Rig, state: Equilibrium) -> list[Point]:
    """The fish's outline where it hangs."""
    (x, z), (c, s) = state.fish, state.forward
    return [(x + c * u - s * v, z + s * u + c * v) for u, v in hull_profile(rig.fish)]


def _tank(sheet: Sheet, view: View, rig: Rig, state: Equilibrium) -> None:
    depth, aft = rig.tank.depth.value, -_astern(rig, state)
    sheet.line(view.all([(aft, 0.0), (_AHEAD, 0.0)]), width=0.35, colour=WATER)
    mark = view.at((aft, 0.0))
    triangle = [(mark[0] + 3.0, mark[1] + 0.2), (mark[0] + 1.5, mark[1] + 3.0)]
    triangle.append((mark[0] + 4.5, mark[1] + 3.0))
    sheet.line([*triangle, triangle[0]], width=0.25, colour=WATER)
    floor = view.all([(aft, -depth), (_AHEAD, -depth)])
    below = [(x, y - 3.0) for x, y in reversed(floor)]
    sheet.outline([*floor, *below], fill="#e8e4dc", order=2, hatch="///")
    deck = max(rig.tow_point.height.value, 0.0) + _DECK
    beam = view.all([(-0.3, deck), (0.3, deck)])
    sheet.outline([*beam, *((x, y + 2.5) for x, y in reversed(beam))], fill="#dddddd")
    sheet.line(view.all([(0.0, deck), (0.0, rig.tow_point.height.value)]), width=0.9)


def _tow(sheet: Sheet, view: View, rig: Rig, state: Equilibrium) -> None:
    for nodes in state.lines.values():
        sheet.line(view.all(nodes), width=0.45, order=4)
    radius = rig.depressor.diameter.value / 2.0
    sheet.circle(view.at(state.depressor), 1e3 * view.scale * radius, fill="#bbbbbb", order=5)
    sheet.outline(view.all(_hull(rig, state)), order=5)
    sheet.dot(view.at((0.0, rig.tow_point.height.value)), radius=0.9)
    sheet.dot(view.at(state.junction), radius=0.7)


def _follows(rig: Rig, value: float) -> Label:
    return derived_label(value, shaping(rig), 0)


def _dimensions(sheet: Sheet, view: View, rig: Rig, state: Equilibrium) -> None:
    depth, aft = rig.tank.depth.value, -_astern(rig, state)
    x = view.at((aft, 0.0))[0]
    sheet.vertical(view, (aft, -depth), (aft, 0.0), x - 9.0, length_label(rig.tank.depth))
    height = rig.tow_point.height
    right = view.at((_AHEAD, 0.0))[0] + 10.0
    if height.value:
        sheet.vertical(view, (0.0, 0.0), (0.0, height.value), right, length_label(height))
    dx, dz = state.depressor
    sheet.vertical(view, (dx, dz), (0.0, 0.0), right + 10.0, _follows(rig, -dz))
    fish = state.fish
    sheet.vertical(
        view, (aft, 0.0), fish, x - 2.0 + 1e3 * view.scale * 0.12, _follows(rig, -fish[1])
    )
    y = view.at((0.0, -depth))[1] - 10.0
    sheet.horizontal(view, fish, (0.0, fish[1]), y, _follows(rig, -fish[0]))


def _words(sheet: Sheet, view: View, towed: Equilibrium) -> None:
    places = (("primary", 6.0, 4.0), ("depressor", 6.0, 2.0), ("secondary", -4.0, 10.0))
    for name, dx, dy in places:
        nodes = towed.lines[name]
        place = view.at(nodes[len(nodes) // 2])
        sheet.callout(place, (place[0] + dx, place[1] + dy), name)


def _table(sheet: Sheet, rig: Rig, rest: Equilibrium, towed: Equilibrium) -> None:
    def both(at_rest: float, under_way: float, unit: str) -> Label:
        return follows(f"{at_rest:.1f} / {under_way:.1f} {unit}", shaping(rig))

    lean = [
        math.degrees(math.atan2(-s.junction[0], s.lines["primary"][0][1] - s.junction[1]))
        for s in (rest, towed)
    ]
    near = [1e3 * clearance(rig, state) for state in (rest, towed)]
    if min(near) <= 0.0:
        sheet.text((16.0, 49.0), "THE TOW LIES ON THE FLOOR: shorten its lines", 9, "#b00020")
    sheet.quantities(
        (125.0, 44.0),
        (42.0, 48.0),
        {
            "primary cable": rig.lines.primary.length,
            "depressor cable": rig.lines.depressor.length,
            "secondary cable": rig.lines.secondary.length,
            "rest / towed: tension": both(rest.tensions["primary"], towed.tensions["primary"], "N"),
            "primary cable leans": both(*lean, "°"),
            "clear of the floor": both(*near, "mm"),
        },
    )
    sheet.notes(
        (16.0, 44.0),
        (
            "Shapes: equilibrium by the twin's simulator without\n"
            " heave; measured to mid-hull and to the centres.",
            f"Tank: {quantity_text(rig.tank.length)} long,\n"
            f" {quantity_text(rig.tank.width)} wide; carriage and strut are an example.",
            "The clearance must exceed the heave amplitude with\n"
            " room to spare, also while the carriage stops.",
        ),
    )
