# SPDX-License-Identifier: Apache-2.0
"""Drawing of the crank mechanism that heaves the tow point, with the heave over its angle.

A sine motion needs a Scotch yoke (the pin drives a slot across the yoke), a slider crank a rod; the
drawing shows the one that the rig's motion law belongs to.
"""

from __future__ import annotations

import math

import numpy as np
from towtank_rig import Quantity, Rig
from towtank_rig.motion import TowPointMotion, tow_point_motion

from towtank_workshop.equilibrium import hang, shaping
from towtank_workshop.sheet import (
    Point,
    Sheet,
    View,
    derived_label,
    follows,
    length_label,
    scale_for,
    scale_text,
)

_SHOWN_ANGLE = math.radians(40.0)
_YOKE = 0.02  # half width of slot and rod, m; an example
_CURVE_WIDTH = 150.0  # mm for a turn
_ROOM = 125.0  # mm for crank and rod


def stroke(motion: TowPointMotion) -> float:
    """Return the way from the lowest to the highest place of the tow point, m."""
    heave = motion.heave(np.linspace(0.0, 2.0 * math.pi, 721))
    return float(np.ptp(heave))


def draw(rig: Rig, number: int, count: int) -> Sheet:
    """Return the sheet of the crank mechanism."""
    law = rig.tow_point.motion
    motion = tow_point_motion(rig.tow_point)
    sheet = Sheet(rig, "Crank mechanism", number, count)
    radius = law.crank_radius.value
    rod = law.rod_length.value if law.rod_length else 0.0
    # A sine motion's tow point may hang anywhere below: half of a stroke is drawn.
    below = rod or 2.0 * radius
    scale = scale_for(2.0 * radius + below, _ROOM)
    over = 1e3 * scale * (radius + 2.0 * _YOKE)
    view = sheet.view((90.0, 262.0 - over), scale, "Along the crank's shaft", below=-over - 8.0)
    pin, tow = _mechanism(sheet, view, rig, below)
    sheet.aligned(view, (0.0, 0.0), pin, length_label(law.crank_radius, "R"), 7.0)
    if law.rod_length:
        sheet.aligned(view, tow, pin, length_label(law.rod_length), aside=9.0)
    _shaft(sheet)
    _curve(sheet, rig, motion, scale)
    _table(sheet, rig, motion)
    return sheet


def _mechanism(sheet: Sheet, view: View, rig: Rig, below: float) -> tuple[Point, Point]:
    """Draw crank and yoke or rod; return the crank's pin and the tow point, m."""
    law = rig.tow_point.motion
    radius, factor = law.crank_radius.value, 1e3 * view.scale
    angle = _SHOWN_ANGLE
    if law.rod_length:
        pin = (radius * math.sin(angle), -radius * math.cos(angle))
        tow = (0.0, pin[1] - math.sqrt(law.rod_length.value**2 - pin[0] ** 2))
        sheet.line(view.all([pin, tow]), width=1.4, order=6)
        block = [(-0.6, -1.0), (0.6, -1.0), (0.6, 1.0), (-0.6, 1.0)]
        sheet.outline(view.all([(_YOKE * u, tow[1] + _YOKE * v) for u, v in block]), order=5)
        guide = (tow[1] - 1.2 * radius, tow[1] + 1.2 * radius)
    else:
        pin = (radius * math.cos(angle), radius * math.sin(angle))
        tow = (0.0, pin[1] - below - radius)
        wide = radius + 1.5 * _YOKE
        corners = [(-wide, -_YOKE), (wide, -_YOKE), (wide, _YOKE), (-wide, _YOKE)]
        sheet.outline(view.all([(u, pin[1] + v) for u, v in corners]), order=4)
        end = radius + 0.6 * _YOKE
        slot = [(-end, 0.4), (end, 0.4), (end, -0.4), (-end, -0.4)]
        sheet.outline(view.all([(u, pin[1] + _YOKE * v) for u, v in slot]), order=5)
        stem = [(-0.3, pin[1] - _YOKE), (0.3, pin[1] - _YOKE), (0.3, tow[1]), (-0.3, tow[1])]
        sheet.outline(view.all([(_YOKE * u, v) for u, v in stem]), order=4)
        guide = (tow[1] + 0.3 * radius, tow[1] + 1.2 * radius)
    gap = 0.65 if law.rod_length else 0.35
    for side in (-1.0, 1.0):
        for reach in (gap, gap + 0.15):
            sheet.line(view.all([(side * reach * _YOKE, z) for z in guide]), width=0.35, order=6)
    sheet.circle(view.at((0.0, 0.0)), (radius + 0.5 * _YOKE) * factor, order=2)
    sheet.circle(view.at((0.0, 0.0)), 0.35 * _YOKE * factor, fill="#dddddd", order=6)
    sheet.line(view.all([(0.0, 0.0), pin]), width=0.9, order=7)
    sheet.circle(view.at(pin), 0.3 * _YOKE * factor, fill="#dddddd", order=8)
    over = radius + 2.0 * _YOKE
    sheet.axis(view.at((-over, 0.0)), view.at((over, 0.0)))
    sheet.axis(view.at((0.0, over)), view.at((0.0, tow[1] - 0.5 * _YOKE)))
    sheet.dot(view.at(tow), radius=1.2)
    right = view.at((over, 0.0))[0] + 8.0
    counts = rig.sensors.crank_encoder.counts_per_revolution
    shaft = view.at((0.2 * _YOKE, 0.2 * _YOKE))
    words = f"shaft, with the encoder on its end\n{counts} counts a turn"
    sheet.callout(shaft, (right, view.origin[1] - 18.0), words)
    sheet.callout(
        view.at(tow), (right, view.at(tow)[1] - 2.0), "tow point: end of the primary cable"
    )
    middle = (gap * _YOKE, guide[1] - 0.1 * radius)
    sheet.callout(view.at(middle), (right, view.at(middle)[1]), "guide, vertical")
    return pin, tow


def _shaft(sheet: Sheet) -> None:
    """What sits on the shaft, in its order."""
    x, y = 34.0, 98.0
    sheet.text((x, y + 22.0), "On the shaft, in this order; not to scale", size=9)
    sheet.axis((x - 4.0, y), (x + 136.0, y))
    sheet.line([(x, y), (x + 128.0, y)], width=0.9)
    parts = (
        ("encoder", 0.0, 18.0, 8.0),
        ("bellows\ncoupling", 30.0, 10.0, 4.0),
        ("bearing", 52.0, 8.0, 6.0),
        ("gear wheel, from motor\nand brake", 76.0, 8.0, 12.0),
        ("bearing", 101.0, 8.0, 6.0),
        ("crank disc with\npin, at the free end", 122.0, 6.0, 14.0),
    )
    for number, (name, start, length, half) in enumerate(parts):
        left = x + start
        corners = [(left, y - half), (left + length, y - half), (left + length, y + half)]
        sheet.outline([*corners, (left, y + half)], order=5)
        level = y - 18.0 - 6.0 * (number % 2)
        sheet.text((left + length / 2.0, level), name, size=7, align="center")


def _curve(sheet: Sheet, rig: Rig, motion: TowPointMotion, scale: float) -> None:
    """Heave over a turn, its height at the mechanism's scale."""
    view = sheet.view((235.0, 205.0), scale)
    x, y = view.origin
    width = _CURVE_WIDTH
    angles = np.linspace(0.0, 2.0 * math.pi, 121)
    heave = motion.heave(angles)
    factor = 1e3 * scale
    places = [
        (x + width * angle / (2.0 * math.pi), y + factor * h)
        for angle, h in zip(angles.tolist(), heave.tolist(), strict=True)
    ]
    top = y + factor * float(heave.max())
    bottom = y + factor * float(heave.min())
    title = f"Heave of the tow point over a turn, height {scale_text(scale)}"
    sheet.text((x, top + 14.0), title, size=9)
    sheet.line([(x, y), (x + width, y)], width=0.18)
    sheet.line([(x, bottom - 4.0), (x, top + 4.0)], width=0.18)
    sheet.line(places, width=0.7)
    for degrees in (90, 180, 270, 360):
        at = x + width * degrees / 360.0
        sheet.line([(at, y - 1.0), (at, y + 1.0)], width=0.18)
        sheet.text((at, bottom - 5.0), f"{degrees}°", size=7, align="center")
    sheet.text((x, bottom - 8.0), "0", size=7, align="center")
    rate = abs(rig.run.crank_rate.value)
    if rate:
        period = f"one turn: {2.0 * math.pi / rate:.3g} s"
        sheet.text((x + width / 2.0, bottom - 12.0), period, size=7, align="center")
    at = _per_width(view, width)
    high, low = int(np.argmax(heave)), int(np.argmin(heave))
    label = derived_label(stroke(motion), _lengths(rig))
    sheet.vertical(
        view,
        (at * angles[low] / (2.0 * math.pi), float(heave[low])),
        (at * angles[high] / (2.0 * math.pi), float(heave[high])),
        x + width + 10.0,
        label,
    )


def _per_width(view: View, width: float) -> float:
    """Return the length, m, that takes a width, mm, in a view."""
    return width / (1e3 * view.scale)


def _lengths(rig: Rig) -> list[Quantity]:
    law = rig.tow_point.motion
    return [law.crank_radius, *([law.rod_length] if law.rod_length else [])]


def _table(sheet: Sheet, rig: Rig, motion: TowPointMotion) -> None:
    rate = rig.run.crank_rate
    angles = np.linspace(0.0, 2.0 * math.pi, 721)
    fastest = abs(rate.value) * float(np.abs(motion.slope(angles)).max())
    sharpest = rate.value**2 * float(np.abs(motion.curvature(angles)).max())
    tension = hang(rig, rig.run.carriage_speed.value).tensions["primary"]
    torque = tension * float(np.abs(motion.slope(angles)).max())
    moved = (rate, *_lengths(rig))
    pulled = shaping(rig)
    sheet.quantities(
        (235.0, 130.0),
        (72.0, 60.0),
        {
            "tow point over still water, zero heave": rig.tow_point.height,
            "crank's rate": rate,
            "crank's rate, a minute": follows(f"{rate.value * 30.0 / math.pi:.4g} rpm", (rate,)),
            "greatest heave velocity": follows(f"{fastest:.3g} m/s", moved),
            "greatest heave acceleration": follows(f"{sharpest:.3g} m/s²", moved),
            "steady tension of the tow at the top": follows(f"{tension:.3g} N", pulled),
            "greatest torque of that at the crank": follows(f"{torque:.3g} N m", (*moved, *pulled)),
        },
    )
    kind = "slider crank" if rig.tow_point.motion.rod_length else "Scotch yoke: heave is a sine"
    sheet.notes(
        (16.0, 61.0),
        (
            f"Motion law: {kind} of the crank's angle.",
            "Crank's radius and rod to scale; yoke, guide, slider and\n shaft are examples.",
            "Angle 0 is where the crank is zeroed; towtank calibrate crank\n"
            " finds direction and zero.",
            "The tow always pulls down: without a brake the crank\n falls when the drive is off.",
            "A guard over crank and yoke; emergency stop within\n reach of whoever stands at it.",
        ),
    )
