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

_EYE = 0.012  # inner radius of the eye-bolt, m; an example, as are the next three
_FIN = (0.07, 0.08)  # length and height of the fin, m
_FIN_THICKNESS = 0.003  # m
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
    side = sheet.view((142.0, 165.0), scale, "Side view, from starboard", below=-113.0)
    top = sheet.view((340.0, 165.0), scale, "From above", below=-113.0)
    for view in (side, top):
        _body(sheet, view, rig, from_above=view is top)
    radius = depressor.diameter.value / 2.0
    x = side.at((radius, 0.0))[0] + 14.0
    sheet.vertical(side, (0.0, -radius), (0.0, radius), x, length_label(depressor.diameter, "⌀"))
    line = rig.lines.depressor
    rope = side.at((line.diameter.value / 2.0, radius + 2 * _EYE + 0.02))
    label = length_label(line.diameter, "⌀")
    sheet.callout(
        rope, (rope[0] + 12.0, rope[1] + 4.0), f"depressor cable {label.text}", label.assumed
    )
    _port(sheet, side, top, rig)
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
            "The port: where the flow neither presses nor sucks, ahead of\n"
            " where it leaves the sphere. The fin keeps it there.",
            "Pocket, cap and cable: see assembly.md, waterproofing.",
        ),
    )
    return sheet


def port_angle(rig: Rig) -> float:
    """Return the angle between the depressor's bow and its pressure port, at its centre, rad."""
    x, y, z = rig.sensors.depressor_pressure.position.value
    return math.atan2(math.hypot(y, z), x)


def _port(sheet: Sheet, side: View, top: View, rig: Rig) -> None:
    port = rig.sensors.depressor_pressure.position
    assumed = any(getattr(port, axis).basis == "assumed" for axis in "xyz")
    for view, axis in ((side, "z"), (top, "y")):
        sheet.dot(view.at((port.x.value, getattr(port, axis).value)))
    parts = [f"{axis} {length_label(getattr(port, axis)).text}" for axis in "xyz"]
    place = side.at((port.x.value, port.z.value))
    words = "pressure port\n" + ", ".join(parts)
    sheet.callout(place, (side.origin[0] - 44.0, side.origin[1] - 62.0), words, assumed)
    if port.x.value == port.y.value == 0.0:
        return  # the rig has it at the centre: it does not tell where on the sphere
    place = top.at((port.x.value, port.y.value))
    sheet.line([top.origin, place], width=0.18, style="centre", order=5)
    label = follows(f"{math.degrees(port_angle(rig)):.1f}° from the bow", (port.x, port.y, port.z))
    foot = ((top.origin[0] + place[0]) / 2.0, (top.origin[1] + place[1]) / 2.0)
    sheet.callout(foot, (foot[0] - 70.0, foot[1] - 40.0), label.text, label.assumed)
    radius = rig.depressor.diameter.value / 2.0
    right, low = top.at((radius, -radius))
    if port.x.value:
        sheet.horizontal(
            top, (0.0, 0.0), (port.x.value, port.y.value), low - 9.0, length_label(port.x)
        )
    if port.y.value:
        sheet.vertical(
            top, (0.0, 0.0), (port.x.value, port.y.value), right + 8.0, length_label(port.y)
        )


def _body(sheet: Sheet, view: View, rig: Rig, *, from_above: bool) -> None:
    radius = rig.depressor.diameter.value / 2.0
    factor = 1e3 * view.scale
    half = rig.lines.depressor.diameter.value / 2.0
    length, height = _FIN
    start, end = -0.6 * radius, -radius - length
    if from_above:
        edge = [(start, -_FIN_THICKNESS / 2), (end, -_FIN_THICKNESS / 2)]
        sheet.outline(view.all(edge + [(u, -v) for u, v in reversed(edge)]), order=3)
        sheet.circle(view.at((0.0, 0.0)), radius * factor, order=4)
        sheet.circle(view.at((0.0, 0.0)), half * factor, order=6)
    else:
        eye = radius + _EYE
        cable = [(-half, eye), (half, eye), (half, radius + 0.05), (-half, radius + 0.05)]
        sheet.outline(view.all(cable), order=2)
        sheet.circle(view.at((0.0, eye)), (_EYE + 0.004) * factor, order=3)
        sheet.circle(view.at((0.0, eye)), _EYE * factor, order=3)
        fin = [(start, -height / 2), (end, -height / 2), (end, height / 2), (start, height / 2)]
        sheet.outline(view.all(fin), order=3)
        sheet.circle(view.at((0.0, 0.0)), radius * factor, order=4)
        foot = view.at((end, -height / 2.0))
        sheet.callout(foot, (foot[0] + 8.0, foot[1] - 12.0), "fin (example)")
    _pocket(sheet, view, rig, from_above=from_above)
    over = radius + 8.0 / factor
    sheet.axis(view.at((-over, 0.0)), view.at((over, 0.0)))
    sheet.axis(view.at((0.0, -over)), view.at((0.0, over)))


def _pocket(sheet: Sheet, view: View, rig: Rig, *, from_above: bool) -> None:
    """A bore from the port towards the sphere's middle, closed by a cap."""
    x, y, z = rig.sensors.depressor_pressure.position.value
    out = math.hypot(x, y)
    if out == 0.0:
        return
    radius = rig.depressor.diameter.value / 2.0
    half, depth = _POCKET[0] / 2.0, _POCKET[1]
    mouth = math.sqrt(radius**2 - half**2)
    along, across = (x / out, y / out), (-y / out, x / out)
    if not from_above:
        middle = view.at((mouth * along[0], z))
        size = 2e3 * view.scale * half
        sheet.ellipse(middle, size * abs(along[1]), size, order=5)
        place = (middle[0] + 0.2 * size, middle[1] + 0.3 * size)
        sheet.callout(
            place, (place[0] + 22.0, place[1] + 62.0), "cap of the sensor's\npocket (example)"
        )
        return
    corners = [(mouth, half), (mouth - depth, half), (mouth - depth, -half), (mouth, -half)]
    edge = [(a * along[0] + b * across[0], a * along[1] + b * across[1]) for a, b in corners]
    sheet.line(view.all(edge), width=0.25, style="dashed", order=6)
