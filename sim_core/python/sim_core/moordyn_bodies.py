# SPDX-License-Identifier: Apache-2.0
"""Rods and bodies of a MoorDyn v2 file as bodies of sim_core."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Body
from sim_core.added_mass import about_origin
from sim_core.moordyn_tables import Row
from sim_core.system import Triple

Vector = NDArray[np.float64]

FIXED = ("fixed", "fix", "anchor")
COUPLED = ("coupled", "cpld", "vessel", "ves", "fairlead")
PINNED = ("pinned", "pin")
COUPLED_PINNED = ("coupledpinned", "cpldpin", "vesselpinned", "vespin")
FREE = ("free", "point", "connect", "con")

_ROD_TYPE = ("TypeName", "Diam", "Mass/m", "Cd", "Ca", "CdEnd", "CaEnd")


@dataclass(frozen=True)
class RodType:
    diameter: float  # m
    mass_per_length: float  # kg/m
    drag: float
    added_mass: float
    end_drag: float
    end_added_mass: float


@dataclass(frozen=True)
class Rod:
    row: Row
    kind: str  #: prescribed, pinned, free, or rigid and hinged on a body
    type: RodType
    ends: tuple[Vector, Vector]  #: A and B, m; on a body in its axes
    axis: Vector  #: unit vector from A to B; both may be at one place; zero where that is unknown
    length: float  #: m; 0 for a mere direction
    body: int  #: that it is on; 0: none


@dataclass(frozen=True)
class Carrier:
    """A body of the file."""

    row: Row
    kind: str  #: free, prescribed or pinned
    position: Vector  #: m
    turn: Vector  #: (3, 3), its axes → those of the file
    mass: float  #: kg
    centre_of_gravity: Vector  #: m
    inertia: Vector  #: kg·m², about the centre of gravity
    volume: float  #: m³, at its origin
    drag_area: Vector  #: (3,) m²
    turning_drag: Vector  #: (3,) m⁵
    added_mass: Vector  #: (3,) of the volume


@dataclass(frozen=True)
class Hull:
    """The axes of a Body in those of the file: origin at mid-rod, x along the rod to its nose."""

    origin: Vector  #: m
    axes: Vector  #: (3, 3), unit vectors in rows
    length: float  #: m

    def place(self, place: Vector) -> Triple:
        return triple(self.axes @ (place - self.origin))


def triple(vector: Vector) -> Triple:
    x, y, z = vector.tolist()
    return (x, y, z)


def read_rod_types(rows: list[Row]) -> dict[str, RodType]:
    types: dict[str, RodType] = {}
    for row in rows:
        row.require(_ROD_TYPE)
        if row.words[0] in types:
            raise row.error(f"a second type '{row.words[0]}'")
        types[row.words[0]] = RodType(*(row.real(i, _ROD_TYPE[i]) for i in range(1, 7)))
    return types


def read_carrier(row: Row) -> Carrier:
    """Return the body that a row describes. Raises InvalidInput naming the line."""
    kind = row.words[1].lower()
    if kind in COUPLED_PINNED:
        kind = "pinned"
    elif kind in (*FIXED, *COUPLED):
        kind = "prescribed"
    elif kind != "free":
        raise row.error(f"a body of the kind {row.words[1]} is not known")
    centre, inertia = row.reals(9, "CG"), row.reals(10, "I")
    drag, added = row.reals(12, "CdA"), row.reals(13, "Ca")
    if len(centre) == 1:
        centre = [0.0, 0.0, *centre]
    if len(inertia) == 1:
        inertia = 3 * inertia
    if len(drag) in (1, 2):  # along all axes, and about all
        drag = 3 * drag[:1] + 3 * drag[-1:]
    elif len(drag) == 3:
        drag = drag + drag
    if len(added) == 1:
        added = 3 * added
    if (len(centre), len(inertia), len(drag), len(added)) != (3, 3, 6, 3):
        raise row.error("CG, I and Ca have one value or three, CdA one, two, three or six")
    return Carrier(
        row=row,
        kind=kind,
        position=row.vector(2, "X0"),
        turn=_turn(np.radians(row.vector(5, "r0"))),
        mass=row.real(8, "Mass"),
        centre_of_gravity=np.array(centre),
        inertia=np.array(inertia),
        volume=row.real(11, "Volume"),
        drag_area=np.array(drag[:3]),
        turning_drag=np.array(drag[3:]),
        added_mass=np.array(added),
    )


def _turn(angles: Vector) -> Vector:
    """(3, 3): about x, then y and z of the turned axes (rad), as MoorDyn turns bodies."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    turned: Vector = about_x @ about_y @ about_z
    return turned


def hull_of_rod(rod: Rod, held: list[Vector]) -> Hull:
    """The nose is the end nearer to what the lines hold: end A if both are as near."""
    a, b = rod.ends
    middle = 0.5 * (a + b)
    pull = sum(float(np.dot(place - middle, b - a)) for place in held)
    forward = (b - a if pull > 0.0 else a - b) / rod.length
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    port = np.cross(up, forward)
    port /= np.linalg.norm(port)
    return Hull(middle, np.array([forward, port, np.cross(forward, port)]), rod.length)


def hull_of_carrier(carrier: Carrier) -> Hull:
    """That of a body without a rod: its axes, as long and wide as its volume (at least 1 cm)."""
    size = max(1e-2, (carrier.volume * 4.0 / math.pi) ** (1.0 / 3.0))
    return Hull(np.zeros(3), np.eye(3), size)


def make_body(rod: Rod | None, carrier: Carrier | None, hull: Hull, density: float) -> Body:
    """A rod as a body, with what a carrier adds to it; or the carrier alone.

    Raises InvalidInput naming the line where nothing has mass or inertia.
    """
    mass, volume = 0.0, 0.0
    inertia = np.zeros((3, 3))
    centre = buoyant = np.zeros(3)
    added_mass = np.zeros((6, 6))
    drag_area = turning_drag = np.zeros((3, 3))
    diameter = hull.length
    if rod is not None:
        kind, length = rod.type, hull.length
        diameter = kind.diameter
        radius = 0.5 * diameter
        section = math.pi * radius**2
        mass, volume = kind.mass_per_length * length, section * length
        across = mass * (length**2 / 12.0 + radius**2 / 4.0)
        inertia = np.diag([0.5 * mass * radius**2, across, across])
        added_across = kind.added_mass * density * section * length
        # Each end carries CaEnd of half a sphere.
        added_along = 2.0 * kind.end_added_mass * density * 2.0 / 3.0 * math.pi * radius**3
        turning = added_across * length**2 / 12.0
        added_mass = np.diag([added_along, added_across, added_across, 0.0, turning, turning])
    if carrier is not None:
        at = np.array(hull.place(carrier.centre_of_gravity))
        origin = np.array(hull.place(np.zeros(3)))
        turned = hull.axes @ np.diag(carrier.inertia) @ hull.axes.T
        inertia = inertia + turned + carrier.mass * (at @ at * np.eye(3) - np.outer(at, at))
        if mass + carrier.mass > 0.0:
            centre = carrier.mass * at / (mass + carrier.mass)
        mass += carrier.mass
        if volume + carrier.volume > 0.0:
            buoyant = carrier.volume * origin / (volume + carrier.volume)
        volume += carrier.volume
        own = np.zeros((6, 6))
        own[:3, :3] = hull.axes @ np.diag(carrier.added_mass) @ hull.axes.T
        own *= density * carrier.volume
        added_mass = added_mass + about_origin(own, origin.tolist())
        drag_area = hull.axes @ np.diag(carrier.drag_area) @ hull.axes.T
        turning_drag = hull.axes @ np.diag(carrier.turning_drag) @ hull.axes.T
        if rod is None and not carrier.inertia.any():  # a mass: a ball of the hull's size
            inertia = inertia + 0.1 * carrier.mass * hull.length**2 * np.eye(3)
    row = carrier.row if carrier is not None else rod.row if rod is not None else None
    assert row is not None
    about_centre = inertia - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    if mass <= 0.0 or np.linalg.eigvalsh(about_centre)[0] <= 0.0:
        raise row.error("what moves needs mass, and inertia about each axis: give it Mass and I")
    return Body(
        mass=mass,
        inertia=inertia.tolist(),
        centre_of_gravity=centre.tolist(),
        volume=volume,
        centre_of_buoyancy=buoyant.tolist(),
        diameter=diameter,
        length=hull.length,
        added_mass=added_mass.tolist(),
        axial_drag=0.0 if rod is None else 2.0 * rod.type.end_drag,
        cross_flow_drag=0.0 if rod is None else rod.type.drag,
        drag_area=drag_area.tolist(),
        turning_drag=turning_drag.tolist(),
        munk_moment=0.0,
    )
