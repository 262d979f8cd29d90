# SPDX-License-Identifier: Apache-2.0
"""Drawing of the depressor: the sphere, how the cable holds it, and where its sensor sits."""

from __future__ import annotations

import math

from towtank_rig import Rig

from towtank_workshop.sheet import (
    Sheet,
    View,
    follows,
    length_label,
    scale_for,
)

_EYE = 0.012  # inner radius of the eye-bolt, m; an example, as are the next two
_FIN = (0.07, 0.08)  # length and height of the fin, m
_POCKET = (0.024, 0.05)  # width and depth of the sensor's pocket, m
_ROOM = 115.0  # mm


def displaced_mass(rig: Rig) -> float:
    """Return the mass of the water that the depressor displaces by its two weights, kg."""
    return rig.depressor.mass.value - rig.depressor.apparent_mass_in_water.value


def sphere_volume(rig: Rig) -> float:
    """Return the volume of the sphere, m³."""
    return math.pi / 6.0 * rig.depressor.diameter.value**3


def draw(rig: Rig, number: int, count: int) -> Sheet:
    """Return the sheet of the depressor."""
    depressor = rig.depressor
    sheet = Sheet(rig, "Depressor", number, count)
    scale = scale_for(depressor.diameter.value, _ROOM)
    side = sheet.view((160.0, 165.0), scale, "Side view, from starboard", below=-113.0)
    aft = sheet.view((330.0, 165.0), scale, "From aft", below=-113.0)
    for view in (side, aft):
        _body(sheet, view, rig, from_aft=view is aft)
    radius = depressor.diameter.value / 2.0
    x = side.at((radius, 0.0))[0] + 14.0
    sheet.vertical(side, (0.0, -radius), (0.0, radius), x, length_label(depressor.diameter, "⌀"))
    line = rig.lines.depressor
    top = aft.at((line.diameter.value / 2.0, radius + 2 * _EYE + 0.02))
    label = length_label(line.diameter, "⌀")
    sheet.callout(
        top, (top[0] + 12.0, top[1] + 4.0), f"depressor cable {label.text}", label.assumed
    )
    port = rig.sensors.depressor_pressure.position
    parts = [f"{axis} {length_label(getattr(port, axis)).text}" for axis in "xyz"]
    place = side.at((port.x.value, port.z.value))
    sheet.dot(place)
    words = "pressure port\n" + ", ".join(parts)
    assumed = any(getattr(port, axis).basis == "assumed" for axis in "xyz")
    sheet.callout(place, (place[0] - 62.0, place[1] - 62.0), words, assumed)
    volume, displaced = sphere_volume(rig), displaced_mass(rig)
    density = depressor.mass.value / volume
    weights = (depressor.mass, depressor.apparent_mass_in_water)
    by_sphere = rig.water.density.value * volume
    sheet.quantities(
        (120.0, 62.0),
        (52.0, 40.0),
        {
            "mass in air": depressor.mass,
            "apparent mass in water": depressor.apparent_mass_in_water,
            "displaced, by the two": follows(f"{displaced:.3f} kg", weights),
            "displaced, by the sphere": follows(f"{by_sphere:.3f} kg", (rig.water.density,)),
            "mean density": follows(f"{density:.0f} kg/m³", weights),
            "drag on its frontal area": depressor.drag,
        },
    )
    sheet.notes(
        (16.0, 61.0),
        (
            "Centre of the sphere is the origin; x forward, y to port,\n z up.",
            "Eye-bolt, fin and pocket are examples: the rig has no\n measures of them.",
            "Eye-bolt through to an anchor plate in the concrete,\n on the vertical of the centre.",
            "The fin keeps the port at the same side of the flow.",
            "Pocket, cap and cable: see assembly.md, waterproofing.",
        ),
    )
    return sheet


def _body(sheet: Sheet, view: View, rig: Rig, *, from_aft: bool) -> None:
    radius = rig.depressor.diameter.value / 2.0
    factor = 1e3 * view.scale
    half = rig.lines.depressor.diameter.value / 2.0
    eye = radius + _EYE
    cable = [(-half, eye), (half, eye), (half, radius + 0.05), (-half, radius + 0.05)]
    sheet.outline(view.all(cable), order=2)
    sheet.circle(view.at((0.0, eye)), (_EYE + 0.004) * factor, order=3)
    sheet.circle(view.at((0.0, eye)), _EYE * factor, order=3)
    length, height = _FIN
    if from_aft:
        fin = [(-0.0015, -height / 2), (0.0015, -height / 2), (0.0015, height / 2)]
        fin.append((-0.0015, height / 2))
        sheet.circle(view.at((0.0, 0.0)), radius * factor, order=4)
        sheet.outline(view.all(fin), order=5)
    else:
        start, end = -0.6 * radius, -radius - length
        fin = [(start, -height / 2), (end, -height / 2), (end, height / 2), (start, height / 2)]
        sheet.outline(view.all(fin), order=3)
        sheet.circle(view.at((0.0, 0.0)), radius * factor, order=4)
        foot = view.at((end, -height / 2.0))
        sheet.callout(foot, (foot[0] + 8.0, foot[1] - 12.0), "fin (example)")
    _pocket(sheet, view, radius, from_aft=from_aft)
    over = radius + 8.0 / factor
    sheet.axis(view.at((-over, 0.0)), view.at((over, 0.0)))
    sheet.axis(view.at((0.0, -over)), view.at((0.0, over)))


def _pocket(sheet: Sheet, view: View, radius: float, *, from_aft: bool) -> None:
    """A bore from starboard to the sensor in the middle, closed by a cap."""
    half, depth = _POCKET[0] / 2.0, _POCKET[1]
    if not from_aft:
        sheet.circle(view.at((0.0, 0.0)), 1e3 * view.scale * half, order=5)
        place = view.at((0.7 * half, 0.7 * half))
        sheet.callout(
            place, (place[0] + 40.0, place[1] + 62.0), "cap of the sensor's\npocket (example)"
        )
        return
    mouth = math.sqrt(radius**2 - half**2)
    edge = [(mouth, half), (mouth - depth, half), (mouth - depth, -half), (mouth, -half)]
    sheet.line(view.all(edge), width=0.25, style="dashed", order=6)
