# SPDX-License-Identifier: Apache-2.0
"""MoorDyn v2 input files as descriptions of systems.

What sim_core has too is mapped; a part that it cannot represent is an error, and what surrounds
the parts and is left out (waves, friction, output, options of MoorDyn's own solver) a warning in
the deck. Both name the line of the file.

| MoorDyn | here |
|---|---|
| line type | LineProperties; CaAx and Cl (vortex-induced vibration) are left out |
| point: free; fixed or coupled | FreePoint, added mass Ca ρ V; PrescribedPoint |
| free rod | Body: an evenly filled cylinder, no Munk moment, CdEnd and CaEnd at both ends |
| free body with one rigid rod | one Body: the rod with the mass, inertia and volume of both |
| fixed or coupled body, not turned | its points are PrescribedPoints |
| fixed rod | its ends are PrescribedPoints |

The end of a rod clamps a line with bending stiffness, as in MoorDyn: the line leaves along the rod.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Body, LineProperties, Water
from sim_core.moordyn_tables import Row, Tables, read_tables
from sim_core.system import FreePoint, Line, PrescribedPoint, System, Triple

Vector = NDArray[np.float64]

_FIXED = ("fixed", "fix", "anchor")
_COUPLED = ("coupled", "cpld", "vessel", "ves", "fairlead")
_FREE = ("free", "point", "connect", "con")

_LINE_TYPE = ("TypeName", "Diam", "Mass/m", "EA", "BA", "EI", "Cd", "Ca", "CdAx", "CaAx")
_ROD_TYPE = ("TypeName", "Diam", "Mass/m", "Cd", "Ca", "CdEnd", "CaEnd")
_BODY = (
    *("ID", "Attachment", "X0", "Y0", "Z0", "r0", "p0", "y0"),
    *("Mass", "CG", "I", "Volume", "CdA", "Ca"),
)
_ROD = ("ID", "RodType", "Attachment", "Xa", "Ya", "Za", "Xb", "Yb", "Zb", "NumSegs")
_POINT = ("ID", "Attachment", "X", "Y", "Z", "Mass", "Volume", "CdA", "Ca")
_LINE = ("ID", "LineType", "AttachA", "AttachB", "UnstrLen", "NumSegs")

_OPTIONS_LEFT_OUT = {
    "wavekin": "waves",
    "waterkin": "waves and current",
    "currents": "current",
    "seafloorfile": "the shape of the sea floor",
    "frictioncoefficient": "friction on the sea floor",
    "mu_kt": "friction on the sea floor",
    "mu_ka": "friction on the sea floor",
}
_SECTIONS_LEFT_OUT = {
    "FAILURE": "the failure of lines",
    "CONTROL": "the control of lines",
    "SYROPE IC": "the history of polyester lines",
    "OUTPUTS": "the choice of output",
}


@dataclass(frozen=True)
class MoorDynDeck:
    """What a MoorDyn file describes.

    deck = read_moordyn("tow.dat")
    state = steady_tow(deck.system.build(), position=deck.positions, velocity=(1, 0, 0))
    """

    system: System  #: parts are named after kind and number: point1, line2, rod1, body1
    positions: dict[str, Triple]  #: m, of the prescribed points
    water_depth: float | None  #: m
    time_step: float | None  #: s, MoorDyn's; sim_core's implicit integrators take larger ones
    warnings: tuple[str, ...]  #: what was left out, as "file:line: what"


def read_moordyn(path: str | Path) -> MoorDynDeck:
    """Read a MoorDyn v2 input file.

    Raises InvalidInput, naming file and line, for a malformed file and for parts that sim_core
    does not have: viscoelastic or tabulated lines, pinned or driven rods, bodies with drag of
    their own, external loads. Raises OSError if the file cannot be read.
    """
    path = Path(path)
    tables = read_tables(path.read_text(encoding="utf-8", errors="replace"), path.name)
    return _Reader(tables).deck()


@dataclass(frozen=True)
class _RodType:
    diameter: float  # m
    mass_per_length: float  # kg/m
    drag: float
    added_mass: float
    end_drag: float
    end_added_mass: float


@dataclass(frozen=True)
class _Rod:
    row: Row
    type: _RodType
    ends: tuple[Vector, Vector]  # A and B, m
    axis: Vector  # unit vector from A to B; both may be at one place
    fixed: bool
    body: int  # that carries it; 0: none


@dataclass(frozen=True)
class _BodyRow:
    row: Row
    kind: str  # free, fixed or coupled
    position: Vector  # m
    mass: float  # kg
    centre_of_gravity: Vector  # m
    inertia: Vector  # kg·m², about the centre of gravity
    volume: float  # m³, at its origin


@dataclass(frozen=True)
class _Hull:
    """The axes of a Body in those of the file: origin at mid-rod, x along the rod to its nose."""

    origin: Vector  # m
    axes: Vector  # (3, 3), unit vectors in rows
    length: float  # m

    def place(self, place: Vector) -> Triple:
        return _triple(self.axes @ (place - self.origin))


@dataclass(frozen=True)
class _End:
    """Where a line ends: at a point or a body, there at a place in its axes (m)."""

    name: str
    place: Triple | None = None
    #: unit vector in which a line with bending stiffness leaves; in body or tank axes
    outward: Vector | None = None


_Key = tuple[str, int]  # ("point", 3), ("rod A", 1), ("rod B", 1)


class _Reader:
    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._warnings: list[tuple[int, str]] = []
        self._gravity, self._density = 9.80665, 1025.0  # MoorDyn's
        self._water_depth: float | None = None
        self._time_step: float | None = None

    def deck(self) -> MoorDynDeck:
        self._read_options()
        self._note_other_sections()
        line_types, rod_types = self._line_types(), self._rod_types()
        carriers = self._body_rows()
        rods = self._rods(rod_types, carriers)
        held = [key for row in self._rows("LINES", _LINE) for key in self._line_ends(row, rods)]
        points, positions, attached = self._points(carriers, held)
        bodies, ends = self._bodies(carriers, rods, attached, held)
        ends |= {("point", number): _End(f"point{number}") for number in points}
        named = {f"point{number}": point for number, point in points.items()}
        places = {f"point{number}": place for number, place in positions.items()}
        for key, end, place in self._fixed_ends(rods, held):
            ends[key], named[end.name], places[end.name] = end, PrescribedPoint(), place
        return MoorDynDeck(
            system=System(
                water=Water(density=self._density, gravity=self._gravity),
                points=named,
                bodies=bodies,
                lines=self._lines(line_types, rods, ends),
            ),
            positions=places,
            water_depth=self._water_depth,
            time_step=self._time_step,
            warnings=tuple(what for _, what in sorted(self._warnings)),
        )

    # ------------------------------------------------------------------ options and the rest

    def _warn(self, row: Row, what: str) -> None:
        self._warnings.append((row.number, f"{row.source}:{row.number}: {what}"))

    def _read_options(self) -> None:
        for row in self._tables["OPTIONS"]:
            row.require(("value", "name of the option"))
            name = row.words[1]
            option = name.lower()
            if option in ("g", "gravity"):
                self._gravity = row.real(0, name)
            elif option in ("rho", "rhow", "wtrdnsty"):
                self._density = row.real(0, name)
            elif option in ("dtm", "dt"):
                self._time_step = row.real(0, name)
            elif option == "wtrdpth":
                self._water_depth = row.real(0, name)
                self._warn(row, f"{name}: contact with the sea floor is left out")
            elif option not in _OPTIONS_LEFT_OUT:
                self._warn(row, f"option {name} is not used")
            elif row.words[0] not in ("0", "0.0"):
                self._warn(row, f"{name}: {_OPTIONS_LEFT_OUT[option]}: left out")

    def _note_other_sections(self) -> None:
        for row in self._tables["EXTERNAL LOADS"]:
            raise row.error("external loads are not supported")
        for section, what in _SECTIONS_LEFT_OUT.items():
            for row in self._tables[section][:1]:
                self._warn(row, f"{section}: {what} is left out")
        for row in self._tables.unknown:
            self._warn(row, f"'{' '.join(row.words).strip('- ')}': a section of no known name")

    def _rows(self, section: str, columns: Sequence[str]) -> Iterator[Row]:
        """The rows of a table with an ID in its first column, which must count from 1."""
        for expected, row in enumerate(self._tables[section], start=1):
            row.require(columns)
            if row.integer(0, "ID") != expected:
                raise row.error(f"ID {row.words[0]} in {section}: the next is {expected}")
            yield row

    # -------------------------------------------------------------------------------- types

    def _line_types(self) -> dict[str, LineProperties]:
        """By name; of 1 m, and with a negative damping where the file has a damping ratio."""
        types: dict[str, LineProperties] = {}
        for row in self._tables["LINE TYPES"]:
            if len(row.words) == 9:
                raise row.error("a line type of MoorDyn v1, without EI: write it as v2")
            row.require(_LINE_TYPE)
            _require_new(row, types)
            for column in (3, 4):
                if not re.fullmatch(r"[-+.\d]+([eE][-+]?\d+)?", row.words[column]):
                    what = f"{_LINE_TYPE[column]} {row.words[column]}"
                    raise row.error(f"{what}: only a constant is supported, no table or creep")
            real = [0.0, *(row.real(i, _LINE_TYPE[i]) for i in range(1, 10))]
            types[row.words[0]] = LineProperties(
                length=1.0,
                diameter=real[1],
                mass_per_length=real[2],
                axial_stiffness=real[3],
                axial_damping=real[4],
                bending_stiffness=real[5],
                normal_drag=real[6],
                added_mass=real[7],
                tangential_drag=real[8],
            )
            if real[9] != 0.0:
                self._warn(row, "CaAx: added mass along a line is left out")
            if len(row.words) > 10 and row.real(10, "Cl") != 0.0:
                self._warn(row, "Cl: vortex-induced vibration is left out")
        return types

    def _rod_types(self) -> dict[str, _RodType]:
        types: dict[str, _RodType] = {}
        for row in self._tables["ROD TYPES"]:
            row.require(_ROD_TYPE)
            _require_new(row, types)
            types[row.words[0]] = _RodType(*(row.real(i, _ROD_TYPE[i]) for i in range(1, 7)))
        return types

    # ---------------------------------------------------------------------- bodies and rods

    def _body_rows(self) -> dict[int, _BodyRow]:
        rows = {}
        for number, row in enumerate(self._rows("BODIES", _BODY), start=1):
            kind = row.words[1].lower()
            if kind not in ("free", *_FIXED, *_COUPLED):
                raise row.error(f"a body of the kind {row.words[1]} is not supported")
            centre = row.reals(9, "CG")
            inertia = row.reals(10, "I")
            body = _BodyRow(
                row=row,
                kind="free" if kind == "free" else "prescribed",
                position=row.vector(2, "X0"),
                mass=row.real(8, "Mass"),
                centre_of_gravity=np.array([0.0, 0.0, *centre] if len(centre) == 1 else centre),
                inertia=np.array(3 * inertia if len(inertia) == 1 else inertia),
                volume=row.real(11, "Volume"),
            )
            if body.centre_of_gravity.shape != (3,) or body.inertia.shape != (3,):
                raise row.error("CG and I have one value or three")
            if body.kind == "free" and (any(row.reals(12, "CdA")) or any(row.reals(13, "Ca"))):
                raise row.error("CdA and Ca of a body are not supported: give them to its rod")
            if body.kind != "free" and any(row.vector(5, "r0")):
                raise row.error("a fixed or coupled body that is turned is not supported")
            rows[number] = body
        return rows

    def _rods(self, types: dict[str, _RodType], carriers: dict[int, _BodyRow]) -> dict[int, _Rod]:
        rods: dict[int, _Rod] = {}
        for number, row in enumerate(self._rows("RODS", _ROD), start=1):
            if row.words[1] not in types:
                raise row.error(f"there is no rod type '{row.words[1]}'")
            carrier = _carrier(row, row.words[2], carriers)
            fixed = row.words[2].lower() in _FIXED
            if not (fixed or carrier or row.words[2].lower() == "free"):
                raise row.error(f"a rod of the kind {row.words[2]} is not supported")
            if carrier and carriers[carrier].kind != "free":
                raise row.error("a rod on a fixed or coupled body is not supported")
            if carrier in {rod.body for rod in rods.values()} - {0}:
                raise row.error(f"a second rod on body {carrier} is not supported")
            a, b = row.vector(3, "Xa"), row.vector(6, "Xb")
            along = b - a
            if row.integer(9, "NumSegs") == 0:  # of no length: B is a direction
                if not fixed:
                    raise row.error("a rod of no length (NumSegs 0) must be fixed")
                along, b = b, a
            length = float(np.linalg.norm(along))
            if length == 0.0:
                raise row.error("both ends of the rod are at one place")
            rod_type = types[row.words[1]]
            rods[number] = _Rod(row, rod_type, (a, b), along / length, fixed, carrier)
        for number, body in carriers.items():
            if body.kind == "free" and number not in {rod.body for rod in rods.values()}:
                raise body.row.error("a free body without a rigid rod is not supported")
        return rods

    def _bodies(
        self,
        carriers: dict[int, _BodyRow],
        rods: dict[int, _Rod],
        attached: dict[int, tuple[int, Vector]],
        held: list[_Key],
    ) -> tuple[dict[str, Body], dict[_Key, _End]]:
        """The bodies that the rods make, and where lines end on them."""
        bodies: dict[str, Body] = {}
        ends: dict[_Key, _End] = {}
        for number, rod in rods.items():
            if rod.fixed:
                continue
            places: dict[_Key, Vector] = {
                ("rod A", number): rod.ends[0],
                ("rod B", number): rod.ends[1],
            }
            if rod.body:
                places |= {
                    ("point", point): place
                    for point, (carrier, place) in attached.items()
                    if carrier == rod.body
                }
            hull = _hull(rod, [places[key] for key in held if key in places])
            name = f"body{rod.body}" if rod.body else f"rod{number}"
            bodies[name] = _body(rod, carriers.get(rod.body), hull, self._density)
            outward = {
                ("rod A", number): hull.axes @ -rod.axis,
                ("rod B", number): hull.axes @ rod.axis,
            }
            ends |= {
                key: _End(name, hull.place(place), outward.get(key))
                for key, place in places.items()
            }
        return bodies, ends

    def _fixed_ends(
        self, rods: dict[int, _Rod], held: list[_Key]
    ) -> Iterator[tuple[_Key, _End, Triple]]:
        """The ends of fixed rods that hold a line, and where they are."""
        for number, rod in rods.items():
            for letter, place, outward in zip("AB", rod.ends, (-rod.axis, rod.axis), strict=True):
                key = (f"rod {letter}", number)
                if rod.fixed and key in held:
                    yield key, _End(f"rod{number}{letter}", None, outward), _triple(place)

    # --------------------------------------------------------------------- points and lines

    def _points(
        self, carriers: dict[int, _BodyRow], held: list[_Key]
    ) -> tuple[
        dict[int, PrescribedPoint | FreePoint], dict[int, Triple], dict[int, tuple[int, Vector]]
    ]:
        """Points by number, positions of the prescribed ones, and places on free bodies."""
        points: dict[int, PrescribedPoint | FreePoint] = {}
        positions: dict[int, Triple] = {}
        attached: dict[int, tuple[int, Vector]] = {}
        for number, row in enumerate(self._rows("POINTS", _POINT), start=1):
            kind, place = row.words[1].lower(), row.vector(2, "X")
            forces = row.vector(7, "FX").any() if len(row.words) >= 12 else False
            if forces:
                raise row.error("a steady force on a point is not supported")
            column = 10 if len(row.words) >= 12 else 7
            mass, volume, drag, added = (
                row.real(i, name)
                for i, name in zip((5, 6, column, column + 1), _POINT[5:], strict=True)
            )
            carrier = _carrier(row, row.words[1], carriers)
            if ("point", number) not in held:
                self._warn(row, f"point {number} holds no line and is left out")
            elif carrier and carriers[carrier].kind == "free":
                if any((mass, volume, drag, added)):
                    raise row.error("a point with mass, volume or drag on a body is not supported")
                attached[number] = (carrier, place)
            elif carrier or kind in (*_FIXED, *_COUPLED):
                points[number] = PrescribedPoint()
                origin = carriers[carrier].position if carrier else np.zeros(3)
                positions[number] = _triple(origin + place)
            elif kind in _FREE:
                points[number] = FreePoint(
                    mass=mass,
                    volume=volume,
                    drag_area=drag,
                    added_mass=added * self._density * volume,
                )
            else:
                raise row.error(f"a point of the kind {row.words[1]} is not known")
        return points, positions, attached

    def _line_ends(self, row: Row, rods: dict[int, _Rod]) -> tuple[_Key, _Key]:
        """What a line is attached to: '3', 'Point3', or 'R1A'."""
        keys: list[_Key] = []
        for word in row.words[2:4]:
            match = re.fullmatch(r"(?:(rod|r)(\d+)([ab])|(?:point|p|con|c)?(\d+))", word.lower())
            if match is None:
                raise row.error(f"'{word}' is neither a point, as 3, nor the end of a rod, as R1A")
            if match[1]:
                key, there = (f"rod {match[3].upper()}", int(match[2])), int(match[2]) in rods
            else:
                number = int(match[4])
                key, there = ("point", number), 1 <= number <= len(self._tables["POINTS"])
            if not there:
                raise row.error(f"'{word}' is not there")
            keys.append(key)
        return keys[0], keys[1]

    def _lines(
        self, types: dict[str, LineProperties], rods: dict[int, _Rod], ends: dict[_Key, _End]
    ) -> dict[str, Line]:
        lines = {}
        for row in self._rows("LINES", _LINE):
            if row.words[1] not in types:
                raise row.error(f"there is no line type '{row.words[1]}'")
            length, segments = row.real(4, "UnstrLen"), row.integer(5, "NumSegs")
            if length <= 0.0 or segments < 1:
                raise row.error("UnstrLen and NumSegs must be positive")
            properties = types[row.words[1]].replace(length=length)
            if properties.axial_damping < 0.0:
                # A ratio to the critical damping of a segment, as MoorDyn counts it.
                stiffness = properties.axial_stiffness
                assert isinstance(stiffness, float)  # tables are refused above
                unit = length / segments * math.sqrt(stiffness * properties.mass_per_length)
                properties = properties.replace(axial_damping=-properties.axial_damping * unit)
            start, end = (ends[key] for key in self._line_ends(row, rods))
            leaves, arrives = start.outward, end.outward
            if properties.bending_stiffness == 0.0:
                leaves = arrives = None
            lines[f"line{row.words[0]}"] = Line(
                start.name,
                end.name,
                properties,
                segments=segments,
                start_attachment=start.place,
                attachment=end.place,
                start_direction=None if leaves is None else _triple(leaves),
                end_direction=None if arrives is None else _triple(-arrives),
            )
        return lines


def _triple(vector: Vector) -> Triple:
    x, y, z = vector.tolist()
    return (x, y, z)


def _require_new(row: Row, types: dict[str, LineProperties] | dict[str, _RodType]) -> None:
    if row.words[0] in types:
        raise row.error(f"a second type '{row.words[0]}'")


def _carrier(row: Row, word: str, carriers: dict[int, _BodyRow]) -> int:
    """The number of the body that an attachment such as 'Body1' names, or 0."""
    match = re.fullmatch(r"body(\d+)", word.lower())
    if match is None:
        return 0
    if int(match[1]) not in carriers:
        raise row.error(f"there is no body {match[1]}")
    return int(match[1])


def _hull(rod: _Rod, held: list[Vector]) -> _Hull:
    """The nose is the end nearer to what the lines hold: end A if both are as near."""
    a, b = rod.ends
    middle = 0.5 * (a + b)
    pull = sum(float(np.dot(place - middle, b - a)) for place in held)
    length = float(np.linalg.norm(b - a))
    forward = (b - a if pull > 0.0 else a - b) / length
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    port = np.cross(up, forward)
    port /= np.linalg.norm(port)
    return _Hull(middle, np.array([forward, port, np.cross(forward, port)]), length)


def _body(rod: _Rod, carrier: _BodyRow | None, hull: _Hull, density: float) -> Body:
    """The rod as a body, with what a carrier adds to its mass, inertia and volume."""
    kind, length = rod.type, hull.length
    radius = 0.5 * kind.diameter
    section = math.pi * radius**2
    mass, volume = kind.mass_per_length * length, section * length
    across = mass * (length**2 / 12.0 + radius**2 / 4.0)
    inertia = np.diag([0.5 * mass * radius**2, across, across])
    centre = buoyant = np.zeros(3)
    if carrier is not None:
        at = np.array(hull.place(carrier.centre_of_gravity))
        turned = hull.axes @ np.diag(carrier.inertia) @ hull.axes.T
        inertia = inertia + turned + carrier.mass * (at @ at * np.eye(3) - np.outer(at, at))
        centre = carrier.mass * at / (mass + carrier.mass)
        mass += carrier.mass
        buoyant = carrier.volume * np.array(hull.place(np.zeros(3))) / (volume + carrier.volume)
        volume += carrier.volume
    added_across = kind.added_mass * density * section * length
    # Each end carries CaEnd of half a sphere.
    added_along = 2.0 * kind.end_added_mass * density * 2.0 / 3.0 * math.pi * radius**3
    added_turning = added_across * length**2 / 12.0
    return Body(
        mass=mass,
        inertia=inertia.tolist(),
        centre_of_gravity=centre.tolist(),
        volume=volume,
        centre_of_buoyancy=buoyant.tolist(),
        diameter=kind.diameter,
        length=length,
        added_mass=(added_along, added_across, added_across, 0.0, added_turning, added_turning),
        axial_drag=2.0 * kind.end_drag,
        cross_flow_drag=kind.drag,
        munk_moment=0.0,
    )
