# SPDX-License-Identifier: Apache-2.0
"""MoorDyn v2 input files as descriptions of systems.

| MoorDyn | here |
|---|---|
| line type | LineProperties; EA may be a table; of static\\|dynamic EA two sections a segment |
| point: free; fixed or coupled | FreePoint, added mass Ca ρ V; PrescribedPoint |
| rod: free | Body: an evenly filled cylinder, no Munk moment, CdEnd and CaEnd at both ends |
| fixed or coupled | its ends are PrescribedPoints |
| pinned | a Body on a Joint at its end A |
| of no length, free | a FreePoint, or joins two lines with bending stiffness to a SectionedLine |
| body: free | Body: its rigid rod with mass, inertia, volume, drag and added mass of both |
| … with several rods | one Body each, welded by three Joints |
| fixed or coupled; pinned | its points and rods are prescribed; a Body on a Joint |
| water, sea floor | Water and Tank, see sim_core.moordyn_water |

The end of a rod clamps a line with bending stiffness, as in MoorDyn: the line leaves along the rod.
What is adrift, held by no line, hangs on a thread that pulls with a billionth of its weight: so
that it has a prescribed point.

What changes the result and has no counterpart here is an error, which names line, cause and mend.
What changes a run alone, not the shape at rest, can be accepted by its name in LEFT_OUT; that, and
what is without effect, is told in one warning. Output and MoorDyn's solver do not matter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sim_core._core import Body, InvalidInput, LineProperties
from sim_core.moordyn_bodies import (
    COUPLED,
    COUPLED_PINNED,
    FIXED,
    FREE,
    PINNED,
    Carrier,
    Hull,
    Rod,
    Vector,
    hull_of_carrier,
    hull_of_rod,
    make_body,
    read_carrier,
    read_rod_types,
    triple,
)
from sim_core.moordyn_lines import LineType, read_line_types
from sim_core.moordyn_tables import Row, Tables, read_tables
from sim_core.moordyn_water import Options, floor, floor_of_file, read_water
from sim_core.system import (
    FreePoint,
    Joint,
    Line,
    PrescribedPoint,
    SectionedLine,
    System,
    Triple,
)

_BODY = (
    *("ID", "Attachment", "X0", "Y0", "Z0", "r0", "p0", "y0"),
    *("Mass", "CG", "I", "Volume", "CdA", "Ca"),
)
_ROD = ("ID", "RodType", "Attachment", "Xa", "Ya", "Za", "Xb", "Yb", "Zb", "NumSegs")
_POINT = ("ID", "Attachment", "X", "Y", "Z", "Mass", "Volume", "CdA", "Ca")
_FAILURE = ("FailureID", "Point", "Lines", "FailTime", "FailTen")
_LINE = ("ID", "LineType", "AttachA", "AttachB", "UnstrLen", "NumSegs")

#: What changes a run and has no counterpart here, by the name that accepts that it is left out.
LEFT_OUT = {
    "viv": "vortex-induced vibration (Cl)",
    "failure": "the failure of lines",
    "control": "the control of lines",
}
_THREAD = 1000.0  # m
_STEEL = 7850.0  # kg/m³
_JOINT_GAP = 1e-5  # of a body's length, under the weight of everything


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
    warnings: tuple[str, ...]  #: what was left out or assumed, as "file:line: what"


def read_moordyn(
    path: str | Path, *, water_depth: float | None = None, accept: Collection[str] = ()
) -> MoorDynDeck:
    """Read a MoorDyn v2 input file.

    water_depth: m, in place of the file's; infinite: without a sea floor. A file that has none, as
    where OpenFAST gives it, gets the depth of its anchors if they are the deepest points.
    accept: of what changes a run and is not simulated, what may be left out: "viv" (vortex-induced
    vibration), "failure" and "control" (of lines). The deck's warnings then say so.
    Files that it names (tables, waves, currents) are looked for beside it.

    Raises InvalidInput, naming file, line and mend, for a malformed file and for what changes the
    result, has no counterpart here and is not accepted; OSError if the file cannot be read.
    """
    if isinstance(accept, str) or not set(accept) <= set(LEFT_OUT):
        raise InvalidInput(f"accept: {accept!r} is not a set of names among {sorted(LEFT_OUT)}")
    path = Path(path)
    tables = read_tables(path.read_text(encoding="utf-8", errors="replace"), path.name)
    return _Reader(tables, path.parent, water_depth, frozenset(accept)).deck()


_Key = tuple[str, int]  # ("point", 3), ("rod A", 1), ("rod B", 1)


@dataclass(frozen=True)
class _End:
    """Where a line ends: at a point or a body, there at a place in its axes (m)."""

    name: str
    place: Triple | None = None
    #: unit vector in which a line with bending stiffness leaves; in body or tank axes
    outward: Vector | None = None


@dataclass(frozen=True)
class _LineRow:
    name: str
    row: Row
    ends: tuple[_Key, _Key]
    sections: list[tuple[LineProperties, int]]

    def bends_at(self, key: _Key) -> bool:
        section = self.sections[0 if key == self.ends[0] else -1][0]
        return section.bending_stiffness > 0.0

    def reversed(self) -> _LineRow:
        return replace(self, ends=self.ends[::-1], sections=self.sections[::-1])


@dataclass
class _Parts:
    """What has been made of the file so far."""

    points: dict[str, PrescribedPoint | FreePoint] = field(default_factory=dict)
    positions: dict[str, Triple] = field(default_factory=dict)  # of prescribed points
    anchors: list[float] = field(default_factory=list)  # depths of fixed places, m
    bodies: dict[str, Body] = field(default_factory=dict)
    places: dict[str, Vector] = field(default_factory=dict)  # of bodies and free points, m
    joints: dict[str, tuple[_End, _End]] = field(default_factory=dict)
    ends: dict[_Key, _End] = field(default_factory=dict)

    def prescribe(self, name: str, place: Vector) -> _End:
        self.points[name], self.positions[name] = PrescribedPoint(), triple(place)
        return _End(name)


class _Reader:
    def __init__(
        self, tables: Tables, folder: Path, water_depth: float | None, accepted: frozenset[str]
    ) -> None:
        self._tables = tables
        self._folder = folder
        self._given_depth = water_depth
        self._accepted = accepted
        self._notes: list[tuple[Row, str]] = []
        self._left_out: dict[str, list[Row]] = {}
        self._ambiguous: set[_Key] = set()
        self._parts = _Parts()
        self._density = 1025.0
        self._hulls: dict[int, Hull] = {}  # of bodies by number
        self._frames: dict[int, Carrier] = {}

    def deck(self) -> MoorDynDeck:
        options = Options.of(self._tables["OPTIONS"], self._folder)
        self._density = options.real("rhow", self._density)
        self._note_the_rest(options)
        types = read_line_types(
            self._tables["LINE TYPES"], self._folder, lambda row: self._omit(row, "viv")
        )
        carriers = {n: read_carrier(row) for n, row in self._rows("BODIES", _BODY)}
        rods = self._rods(carriers)
        lines = self._lines(types, rods)
        point_rows = dict(self._rows("POINTS", _POINT))
        for line in lines:
            for key in line.ends:
                self._require_there(line.row, key, point_rows, rods)
        lines = self._joined(lines, rods)
        held = {key for line in lines for key in line.ends}
        attached = self._points(point_rows, carriers, held)
        for number, carrier in carriers.items():
            if carrier.kind != "prescribed":
                self._body(number, carrier, rods, attached, held)
        self._lone_rods(rods, held)
        described = {line.name: self._line(line) for line in lines}
        depth = self._depth(options)
        water = read_water(options, depth)
        used = [(types[row.words[1]], row.real(4, "UnstrLen")) for row in self._tables["LINES"]]
        tank = None if depth is None else floor(options, depth, used, water)
        weight = self._weight(described, water.gravity)
        self._tie_what_is_adrift(described)
        parts = self._parts
        system = System(
            water=water,
            points=parts.points,
            bodies=parts.bodies,
            lines=described,
            joints=self._joints(weight),
            tank=tank,
        )
        return MoorDynDeck(
            system=system,
            positions=parts.positions,
            water_depth=depth,
            time_step=options.real("dtm", 0.0) or None,
            warnings=self._warnings(),
        )

    # ------------------------------------------------------------------------ rows and notes

    def _leave_out(self, row: Row, what: str) -> None:
        self._left_out.setdefault(what, []).append(row)

    def _omit(self, row: Row, name: str) -> None:
        """Leave out what has that name in LEFT_OUT, if it is accepted."""
        if name not in self._accepted:
            raise row.error(
                f"{LEFT_OUT[name]} changes a run and is not simulated: take it out, or accept that "
                f'it is left out, accept={{"{name}"}}'
            )
        self._leave_out(row, LEFT_OUT[name])

    def _warnings(self) -> tuple[str, ...]:
        texts = [f"{row.source}:{row.number}: {what}" for row, what in self._notes]
        if self._left_out:
            first = min((row for rows in self._left_out.values() for row in rows), key=_number)
            parts = [
                f"{what}, line {', '.join(str(row.number) for row in rows)}"
                for what, rows in sorted(self._left_out.items(), key=lambda item: item[1][0].number)
            ]
            texts.append(f"{first.source}:{first.number}: left out: {'; '.join(parts)}")
        return tuple(texts)

    def _note_the_rest(self, options: Options) -> None:
        for row in self._tables["EXTERNAL LOADS"]:
            raise row.error("external loads are not supported: take them out")
        for row in self._tables["FAILURE"]:
            row.require(_FAILURE)
            if max(row.real(i, _FAILURE[i]) for i in (3, 4)) > 0.0:  # a 0 is no such condition
                self._omit(row, "failure")
        for row in self._tables["CONTROL"]:
            self._omit(row, "control")
        for row in self._tables.unknown:
            what = f"a section '{' '.join(row.words).strip('- ')}' is not known"
            raise row.error(f"{what}: correct its name or take it out")
        for row in options.unknown:
            self._leave_out(row, f"option {row.words[1]}, of no known name")
        for row in options.left_to_the_caller:
            what = f"{row.words[1]} {row.words[0]} leaves waves and current to the calling program"
            self._notes.append((row, f"still water: {what}; give them to deck.system's water"))

    def _rows(self, section: str, columns: Sequence[str]) -> Iterator[tuple[int, Row]]:
        """The rows of a table by the ID in their first column.

        A second row with one ID gets the next free number, which nothing can refer to.
        """
        rows = self._tables[section]
        for row in rows:
            row.require(columns)
        numbers = [row.integer(0, "ID") for row in rows]
        free = max(numbers, default=0) + 1
        seen: set[int] = set()
        for number, row in zip(numbers, rows, strict=True):
            if number in seen:
                self._ambiguous.add((section, number))
                number, free = free, free + 1
            seen.add(number)
            yield number, row

    def _require_there(
        self, row: Row, key: _Key, points: dict[int, Row], rods: dict[int, Rod]
    ) -> None:
        kind, number = key
        section, known = ("POINTS", points) if kind == "point" else ("RODS", rods)
        if number not in known:
            raise row.error(f"there is no {kind.split()[0]} {number}")
        if (section, number) in self._ambiguous:
            raise row.error(f"there are two of the ID {number} in {section}: give one another ID")

    # ---------------------------------------------------------------------------------- rods

    def _carrier(self, row: Row, word: str, carriers: dict[int, Carrier]) -> tuple[int, bool]:
        """The number of the body that 'Body1' or 'Body1Pinned' names, or 0; and if it is pinned."""
        match = re.fullmatch(r"body(\d+)(pinned|pin)?", word.lower())
        if match is None:
            return 0, False
        number = int(match[1])
        if number not in carriers:
            raise row.error(f"there is no body {number}")
        if ("BODIES", number) in self._ambiguous:
            raise row.error(f"there are two of the ID {number} in BODIES: give one another ID")
        return number, match[2] is not None

    def _rods(self, carriers: dict[int, Carrier]) -> dict[int, Rod]:
        types = read_rod_types(self._tables["ROD TYPES"])
        rods: dict[int, Rod] = {}
        for number, row in self._rows("RODS", _ROD):
            if row.words[1] not in types:
                raise row.error(f"there is no rod type '{row.words[1]}'")
            word = row.words[2].lower()
            plain = word.rstrip("0123456789")  # of 'Pinned1' the number says nothing
            body, pinned = self._carrier(row, word, carriers)
            if body:
                kind = "hinged" if pinned else "rigid"
            elif plain in (*PINNED, *COUPLED_PINNED):
                kind = "pinned"
            elif plain in (*FIXED, *COUPLED):
                kind = "prescribed"
            elif plain in FREE:
                kind = "free"
            else:
                raise row.error(f"a rod of the kind {row.words[2]} is not known")
            a, b = row.vector(3, "Xa"), row.vector(6, "Xb")
            along = b - a
            if row.integer(9, "NumSegs") == 0:  # of no length: B is a direction
                along, b = b, a
            size = float(np.linalg.norm(along))
            if size == 0.0 and kind != "free":
                raise row.error("both ends of the rod are at one place")
            axis = along / size if size > 0.0 else along
            length = float(np.linalg.norm(b - a))
            if body and carriers[body].kind == "prescribed":
                frame = carriers[body]
                a, b = (frame.position + frame.turn @ place for place in (a, b))
                axis = frame.turn @ axis
                kind = "pinned" if pinned else "prescribed"
                body = 0
            if kind == "prescribed" and word in FIXED:
                self._parts.anchors += [-float(a[2]), -float(b[2])]
            rods[number] = Rod(row, kind, types[row.words[1]], (a, b), axis, length, body)
        return rods

    def _lone_rods(self, rods: dict[int, Rod], held: set[_Key]) -> None:
        """Rods that are no part of a body: prescribed, pinned, free and hinged ones."""
        parts = self._parts
        for number, rod in rods.items():
            keys = ((f"rod {letter}", number) for letter in "AB")
            ends = list(zip(keys, rod.ends, (-rod.axis, rod.axis), strict=True))
            name = f"rod{number}"
            if rod.kind == "prescribed":
                for key, place, outward in ends:
                    if key in held:
                        end = parts.prescribe(f"{name}{key[0][-1]}", place)
                        parts.ends[key] = replace(end, outward=outward)
            elif rod.kind == "rigid":
                continue
            elif rod.length == 0.0:
                if rod.kind == "free":
                    end = _End(name)
                    if any(key in held for key, _, _ in ends):
                        parts.points[name], parts.places[name] = FreePoint(), rod.ends[0]
                elif rod.kind == "pinned":
                    end = parts.prescribe(name, rod.ends[0])
                else:
                    end = self._end_on(rod.body, rod.ends[0])
                for key, _, _ in ends:
                    parts.ends[key] = end
            else:
                hull = hull_of_rod(rod, [place for key, place, _ in ends if key in held])
                self._add(name, make_body(rod, None, hull, self._density), hull, rod.body)
                for key, place, outward in ends:
                    parts.ends[key] = _End(name, hull.place(place), hull.axes @ outward)
                pin = None
                if rod.kind == "pinned":
                    pin = parts.prescribe(f"pin_{name}", rod.ends[0])
                elif rod.kind == "hinged":
                    pin = self._end_on(rod.body, rod.ends[0])
                if pin is not None:
                    parts.joints[f"pin_{name}"] = (pin, _End(name, hull.place(rod.ends[0])))

    # -------------------------------------------------------------------------------- bodies

    def _body(
        self,
        number: int,
        carrier: Carrier,
        rods: dict[int, Rod],
        attached: dict[int, list[tuple[int, Vector, FreePoint]]],
        held: set[_Key],
    ) -> None:
        """A free or pinned body with its rigid rods and its points."""
        parts, name = self._parts, f"body{number}"
        on_it = {n: rod for n, rod in rods.items() if rod.body == number and rod.kind == "rigid"}
        solid = {n: rod for n, rod in on_it.items() if rod.length > 0.0}
        places = [place for point, place, _ in attached.get(number, []) if ("point", point) in held]
        places += [
            place
            for n, rod in on_it.items()
            for letter, place in zip("AB", rod.ends, strict=True)
            if (f"rod {letter}", n) in held
        ]
        if not solid and carrier.mass == 0.0:
            carrier = self._with_masses(carrier, attached.get(number, []))
            attached = {**attached, number: [(n, at, FreePoint()) for n, at, _ in attached[number]]}
        main = next(iter(solid), None)
        if main is not None and carrier.drag_area.any():
            # drag acts at the body's own origin: with another middle the rod is welded on
            middle = 0.5 * (solid[main].ends[0] + solid[main].ends[1])
            if np.linalg.norm(middle) > 1e-9 * solid[main].length:
                main = None
        rod = None if main is None else solid[main]
        hull = hull_of_carrier(carrier) if rod is None else hull_of_rod(rod, places)
        self._hulls[number], self._frames[number] = hull, carrier
        self._add(name, make_body(rod, carrier, hull, self._density), hull, number)
        if carrier.kind == "pinned":
            pin = parts.prescribe(f"pin_{name}", carrier.position)
            parts.joints[f"pin_{name}"] = (pin, self._end_on(number, np.zeros(3)))
        for n, rod in on_it.items():
            for letter, place, outward in zip("AB", rod.ends, (-rod.axis, rod.axis), strict=True):
                parts.ends[f"rod {letter}", n] = _End(name, hull.place(place), hull.axes @ outward)
            if n != main and n in solid:
                self._weld(n, rod, number)
        for point, place, weight in attached.get(number, []):
            end = self._end_on(number, place)
            if weight != FreePoint():
                parts.points[f"point{point}"] = weight
                parts.places[f"point{point}"] = carrier.position + carrier.turn @ place
                parts.joints[f"point{point}"] = (end, _End(f"point{point}"))
            parts.ends["point", point] = end

    def _with_masses(
        self, carrier: Carrier, points: list[tuple[int, Vector, FreePoint]]
    ) -> Carrier:
        """A body without mass of its own with that of its points, as balls of steel."""
        mass = sum(point.mass for _, _, point in points)
        if mass == 0.0 or any(point.replace(mass=0.0) != FreePoint() for _, _, point in points):
            raise carrier.row.error("it has no mass: give it Mass and I")
        centre = sum((point.mass * place for _, place, point in points), np.zeros(3)) / mass
        inertia = np.diag(carrier.inertia)
        for _, place, point in points:
            arm = place - centre
            ball = 0.4 * point.mass * (3.0 * point.mass / (4.0 * math.pi * _STEEL)) ** (2.0 / 3.0)
            own = ball + point.mass * float(arm @ arm)
            inertia = inertia + own * np.eye(3) - point.mass * np.outer(arm, arm)
        if np.abs(inertia - np.diag(np.diag(inertia))).max() > 1e-9 * np.abs(inertia).max():
            raise carrier.row.error("masses of its points askew to its axes: give it Mass and I")
        return replace(carrier, mass=mass, centre_of_gravity=centre, inertia=np.diag(inertia))

    def _weld(self, number: int, rod: Rod, body: int) -> None:
        """Three joints at the ends of a rod and off its axis hold it on a body as one piece."""
        hull = hull_of_rod(rod, [])
        name = f"rod{number}"
        self._add(name, make_body(rod, None, hull, self._density), hull, body)
        aside = hull.origin + 0.25 * hull.length * hull.axes[1]
        for i, place in enumerate((*rod.ends, aside)):
            self._parts.joints[f"weld{i + 1}_{name}"] = (
                self._end_on(body, place),
                _End(name, hull.place(place)),
            )

    def _end_on(self, body: int, place: Vector) -> _End:
        """A place in the axes of a body of the file."""
        return _End(f"body{body}", self._hulls[body].place(place))

    def _add(self, name: str, body: Body, hull: Hull, carrier: int) -> None:
        self._parts.bodies[name] = body
        place = hull.origin
        if carrier:
            frame = self._frames[carrier]
            place = frame.position + frame.turn @ place
        self._parts.places[name] = place

    # --------------------------------------------------------------------- points and lines

    def _points(
        self, rows: dict[int, Row], carriers: dict[int, Carrier], held: set[_Key]
    ) -> dict[int, list[tuple[int, Vector, FreePoint]]]:
        """Makes the points; returns those on free and pinned bodies, by the bodies' numbers."""
        parts = self._parts
        attached: dict[int, list[tuple[int, Vector, FreePoint]]] = {}
        for number, row in rows.items():
            kind, place = row.words[1].lower(), row.vector(2, "X")
            if len(row.words) >= 12 and row.vector(7, "FX").any():
                raise row.error("a steady force on a point is not supported: take it out")
            column = 10 if len(row.words) >= 12 else 7
            mass, volume, drag, added = (
                row.real(i, name)
                for i, name in zip((5, 6, column, column + 1), _POINT[5:], strict=True)
            )
            displaced = self._density * volume  # kg
            point = FreePoint(
                mass=mass, volume=volume, drag_area=drag, added_mass=added * displaced
            )
            carrier, _ = self._carrier(row, row.words[1], carriers)
            name = f"point{number}"
            if carrier and carriers[carrier].kind != "prescribed":
                attached.setdefault(carrier, []).append((number, place, point))
                continue
            if carrier:
                place = carriers[carrier].position + carriers[carrier].turn @ place
                parts.prescribe(name, place)
            elif kind in (*FIXED, *COUPLED):
                parts.prescribe(name, place)
                if kind in FIXED:
                    parts.anchors.append(-float(place[2]))
            elif kind not in FREE:
                raise row.error(
                    f"a point of the kind {row.words[1]} is not known: give Fixed, Coupled or Free"
                )
            elif ("point", number) in held:
                parts.points[name], parts.places[name] = point, place
            else:
                self._leave_out(row, "a free point that holds no line")
            parts.ends["point", number] = _End(name)
        return attached

    def _lines(self, types: dict[str, LineType], rods: dict[int, Rod]) -> list[_LineRow]:
        lines = []
        for number, row in self._rows("LINES", _LINE):
            if row.words[1] not in types:
                raise row.error(f"there is no line type '{row.words[1]}'")
            length, segments = row.real(4, "UnstrLen"), row.integer(5, "NumSegs")
            if length <= 0.0 or segments < 1:
                raise row.error("UnstrLen and NumSegs must be positive")
            keys: list[_Key] = []
            for word in row.words[2:4]:
                match = re.fullmatch(
                    r"(?:(rod|r)(\d+)([ab])|(?:point|p|con|c)?(\d+))", word.lower()
                )
                if match is None:
                    raise row.error(
                        f"'{word}' is neither a point, as 3, nor the end of a rod, as R1A"
                    )
                rod_end = (f"rod {(match[3] or '').upper()}", int(match[2] or 0))
                keys.append(rod_end if match[1] else ("point", int(match[4])))
            sections = types[row.words[1]].sections(length, segments)
            lines.append(_LineRow(f"line{number}", row, (keys[0], keys[1]), sections))
        return lines

    def _joined(self, lines: list[_LineRow], rods: dict[int, Rod]) -> list[_LineRow]:
        """Lines with bending stiffness that a free rod of no length joins, as one line each.

        Such a rod hands on the bending moment, and so does the node between two sections.
        """
        for number, rod in rods.items():
            if rod.length > 0.0 or rod.kind in ("prescribed", "rigid"):
                continue
            keys = {("rod A", number), ("rod B", number)}
            stiff = [
                (ln, key) for ln in lines for key in ln.ends if key in keys and ln.bends_at(key)
            ]
            if len(stiff) < 2:
                continue
            (first, left), (second, right) = stiff[:2]
            others = [ln for ln in lines for key in ln.ends if key in keys]
            if rod.kind != "free" or len(others) > 2 or left == right or first is second:
                raise rod.row.error(
                    "a rod of no length hands on moments between two lines only, one at its end A "
                    "and one at B, and if it is free: give it a length"
                )
            if first.ends[0] == left:
                first = first.reversed()
            if second.ends[1] == right:
                second = second.reversed()
            whole = _LineRow(
                f"{first.name}+{second.name}",
                first.row,
                (first.ends[0], second.ends[1]),
                first.sections + second.sections,
            )
            at = min(i for i, ln in enumerate(lines) if ln in (stiff[0][0], stiff[1][0]))
            lines = [ln for ln in lines if ln not in (stiff[0][0], stiff[1][0])]
            lines.insert(at, whole)
        return lines

    def _line(self, line: _LineRow) -> Line | SectionedLine:
        start, end = (self._parts.ends[key] for key in line.ends)
        leaves, arrives = start.outward, end.outward
        if line.sections[0][0].bending_stiffness == 0.0:
            leaves = None
        if line.sections[-1][0].bending_stiffness == 0.0:
            arrives = None
        whole = SectionedLine(
            start.name,
            end.name,
            sections=tuple(line.sections),
            start_attachment=start.place,
            attachment=end.place,
            start_direction=None if leaves is None else triple(leaves),
            end_direction=None if arrives is None else triple(-arrives),
        )
        return whole.as_uniform() or whole

    # ---------------------------------------------------------------------- the whole system

    def _depth(self, options: Options) -> float | None:
        """The depth of the sea floor, m, at least that of the anchors; None without one."""
        parts = self._parts
        deepest = max(parts.anchors, default=0.0)
        depth: float | None = self._given_depth
        uneven = options.rows.get("seafloorfile")
        if uneven is not None and depth is not None:
            self._notes.append((uneven, f"water_depth {depth:g} m in place of SeafloorFile"))
        elif uneven is not None:
            depth = floor_of_file(uneven, self._folder)
        elif depth is None and "wtrdpth" in options.rows:
            depth = options.real("wtrdpth", 0.0)
        if depth is not None:
            return None if math.isinf(depth) else max(depth, deepest)
        others = [z for _, _, z in parts.positions.values()]
        others += [float(place[2]) for place in parts.places.values()]
        if deepest <= 0.0 or any(-z > deepest for z in others):
            return None
        what = f"no WtrDpth: the sea floor is taken at the deepest anchor, {deepest:g} m"
        row = (self._tables["OPTIONS"] or self._tables["LINES"] or self._tables["POINTS"])[0]
        self._notes.append((row, f"{what}; give water_depth if it is elsewhere"))
        return deepest

    def _weight(self, lines: dict[str, Line | SectionedLine], gravity: float) -> float:
        """N: of everything in air, and of the water that bodies and points displace."""
        parts: list[Body | FreePoint] = list(self._parts.bodies.values())
        parts += [p for p in self._parts.points.values() if isinstance(p, FreePoint)]
        mass = sum(part.mass + self._density * part.volume for part in parts)
        for line in lines.values():
            sections = line.sections if isinstance(line, SectionedLine) else [(line.properties, 1)]
            mass += sum(p.mass_per_length * p.length for p, _ in sections)
        return mass * (gravity or 1.0)

    def _joints(self, weight: float) -> dict[str, Joint]:
        joints = {}
        for name, (start, end) in self._parts.joints.items():
            bodies = [self._parts.bodies[e.name] for e in (start, end) if e.place is not None]
            length = min(body.length for body in bodies)
            joints[name] = Joint(
                start.name,
                end.name,
                stiffness=weight / (_JOINT_GAP * length),
                start_attachment=start.place,
                attachment=end.place,
            )
        return joints

    def _tie_what_is_adrift(self, lines: dict[str, Line | SectionedLine]) -> None:
        """Hang what no line holds on threads, from where their weight or buoyancy pulls."""
        parts = self._parts
        ties = [(line.start, line.end) for line in lines.values()]
        ties += [(start.name, end.name) for start, end in parts.joints.values()]
        left = {*parts.bodies, *(n for n, p in parts.points.items() if isinstance(p, FreePoint))}
        reached = set(parts.positions)
        while True:
            grown = {name for tie in ties if reached & {*tie} for name in tie} - reached
            reached |= grown
            if grown:
                continue
            adrift = [name for name in (*parts.bodies, *parts.points) if name in left - reached]
            if not adrift:
                return
            name = adrift[0]
            part = parts.bodies.get(name) or parts.points[name]
            assert isinstance(part, Body | FreePoint)
            place = parts.places[name]
            sink = 1.0 if part.mass >= self._density * part.volume else -1.0
            parts.prescribe(f"above_{name}", place + np.array([0.0, 0.0, sink * _THREAD]))
            thread = LineProperties(
                length=_THREAD,
                diameter=1e-20,
                mass_per_length=1e-12 * max(part.mass, 1e-3) / _THREAD,
                axial_stiffness=1e-6 * max(part.mass, 1e-3),
            )
            attachment = (0.0, 0.0, 0.0) if name in parts.bodies else None
            lines[f"thread_{name}"] = Line(
                f"above_{name}", name, thread, segments=1, attachment=attachment
            )
            reached.add(name)


def _number(row: Row) -> int:
    return row.number
