# SPDX-License-Identifier: Apache-2.0
"""Drawing of the junction of the three cables, as they leave it in steady towing."""

from __future__ import annotations

import math

from towtank_rig import Rig

from towtank_workshop.equilibrium import Equilibrium, hang, shaping
from towtank_workshop.sheet import (
    Point,
    Sheet,
    View,
    follows,
    length_label,
    quantity_text,
    scale_for,
    scale_text,
)

_RING = 0.016  # m; ring, swivels and thimbles are examples
_SWIVEL = (0.009, 0.030)  # width and length, m
_CABLE = 0.05  # drawn length of a cable, m


def directions(state: Equilibrium) -> dict[str, Point]:
    """Return the unit vectors (x forward, z up) in which the cables leave the junction."""
    nodes = {"primary": state.lines["primary"][::-1], "depressor": state.lines["depressor"]}
    nodes["secondary"] = state.lines["secondary"]
    found = {}
    for name, (here, there, *_) in nodes.items():
        length = math.dist(here, there)
        found[name] = ((there[0] - here[0]) / length, (there[1] - here[1]) / length)
    return found


def draw(rig: Rig, number: int, count: int) -> Sheet:
    """Return the sheet of the junction."""
    sheet = Sheet(rig, "Junction", number, count)
    speed = rig.run.carriage_speed.value
    state = hang(rig, speed)
    scale = scale_for(2.0 * (_RING + _SWIVEL[1] + _CABLE), 230.0)
    title = f"From starboard, as towed at {speed:g} m/s"
    view = sheet.view((150.0, 172.0), scale)
    sheet.text((30.0, 277.0), f"{title}, {scale_text(scale)}", size=9)
    factor = 1e3 * scale
    sheet.circle(view.at((0.0, 0.0)), _RING * factor, order=4)
    sheet.circle(view.at((0.0, 0.0)), 0.7 * _RING * factor, order=4)
    for name, direction in directions(state).items():
        _cable(sheet, view, rig, name, direction)
    rows = {}
    for name, (x, z) in directions(state).items():
        lean = math.degrees(math.atan2(abs(x), abs(z)))
        way = "up" if z > 0.0 else "down"
        tension = f"{state.at_junction[name]:.3g} N"
        rows[f"{name} cable, tension here"] = follows(tension, shaping(rig))
        rows[f"{name} cable, from the vertical"] = follows(f"{lean:.1f}°, {way}", shaping(rig))
    sheet.quantities((245.0, 150.0), (75.0, 45.0), rows)
    cables = {}
    for name in ("primary", "depressor", "secondary"):
        line = getattr(rig.lines, name)
        cables[f"{name}: length"] = line.length
        cables[f"{name}: mass in air"] = line.mass_per_length
        cables[f"{name}: weighs in water"] = line.weight_in_water_per_length
    sheet.quantities((245.0, 108.0), (75.0, 45.0), cables)
    sheet.notes(
        (16.0, 56.0),
        (
            "Ring, swivels and terminals are examples; diameters\n"
            " and directions of the cables are true.",
            "One swivel in each leg: ropes turn under load,\n and a twisted sensor cable breaks.",
            "Sensor cables pass the ring beside the swivels, with\n"
            " a loop of 0.3 m, taped to the ropes on both sides.",
            "No terminal may be weaker than the rope; secure shackles\n with wire.",
        ),
    )
    return sheet


def _cable(sheet: Sheet, view: View, rig: Rig, name: str, direction: Point) -> None:
    ux, uz = direction
    line = getattr(rig.lines, name)

    def strip(start: float, end: float, half: float) -> list[Point]:
        corners = [(start, half), (end, half), (end, -half), (start, -half)]
        return view.all([(a * ux - b * uz, a * uz + b * ux) for a, b in corners])

    width, length = _SWIVEL
    begin = 0.85 * _RING
    sheet.outline(strip(begin, begin + 0.4 * length, width / 3.0), order=5)
    sheet.outline(strip(begin + 0.25 * length, begin + length, width), order=5)
    start = begin + length
    sheet.outline(strip(start, start + _CABLE, line.diameter.value / 2.0), order=4)
    end = start + _CABLE
    sheet.axis(view.at((0.0, 0.0)), view.at((1.08 * end * ux, 1.08 * end * uz)))
    place = view.at((0.8 * end * ux, 0.8 * end * uz))
    label = length_label(line.diameter, "⌀")
    where = {"primary": "to the carriage", "depressor": "to the depressor"}.get(name, "to the fish")
    words = f"{name} cable {where}\n{label.text}, length {quantity_text(line.length)}"
    aside = (-6.0, 20.0) if name == "secondary" else (16.0, 6.0)
    at = (place[0] + aside[0], place[1] + aside[1])
    sheet.callout(place, at, words, label.assumed or line.length.basis == "assumed")
    swivel = view.at(((begin + 0.6 * length) * ux, (begin + 0.6 * length) * uz))
    if name == "primary":
        sheet.callout(swivel, (swivel[0] + 24.0, swivel[1]), "swivel and terminal")
