# SPDX-License-Identifier: Apache-2.0
"""The description of a system: its parts by name, to be read, changed, copied and built.

    tow = System(
        points={"tow_point": PrescribedPoint(), "depressor": FreePoint(mass=6.2, volume=0.7e-3)},
        lines={"cable": Line("tow_point", "depressor", cable, segments=20)},
    )
    longer = tow.replace({"lines.cable.properties.length": 5.0})
    model = longer.build()

Everything here is a value: parts compare by what they hold, and a change makes a copy.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, TypeVar

from sim_core._core import Body, InvalidInput, LineProperties, Model, ModelBuilder, Tank, Water
from sim_core.arguments import require_finite

Triple = tuple[float, float, float]
Described = TypeVar("Described", bound="_Described")


class _Described:
    """What the parts below have in common with those of the compiled library."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_finite(type(self).__name__, name, value)

    def replace(self: Described, **changes: object) -> Described:
        """A copy with other values."""
        known = [f.name for f in dataclasses.fields(self)]  # type: ignore[arg-type]
        for name in changes:
            if name not in known:
                kind, names = type(self).__name__, ", ".join(known) or "no values"
                raise InvalidInput(f"{kind} has no '{name}', it has {names}")
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


@dataclass(frozen=True)
class PrescribedPoint(_Described):
    """A point that moves as prescribed: a tow point or an anchor."""


@dataclass(frozen=True, kw_only=True)
class FreePoint(_Described):
    """A point with mass that moves freely: a junction, or a sphere-like depressor.

    drag_area and added_mass are one number, or one for each tank axis.
    """

    mass: float = 0.0  #: kg
    volume: float = 0.0  #: m³
    drag_area: float | Triple = 0.0  #: Cd A, m²
    added_mass: float | Triple = 0.0  #: kg


@dataclass(frozen=True, kw_only=True)
class Weathervane(_Described):
    """A depressor with a fin, which turns its axis into the horizontal flow at once.

    drag_area and added_mass are along the axis, across it, and vertical.
    """

    mass: float  #: kg
    volume: float  #: m³
    drag_area: Triple  #: Cd A, m²
    added_mass: Triple = (0.0, 0.0, 0.0)  #: kg
    turning_speed: float = 0.05  #: m/s, below which the flow does not turn it


@dataclass(frozen=True)
class Line(_Described):
    """A line from one point or body to another; an attachment is needed exactly at a body."""

    start: str  #: name of a point or body
    end: str  #: name of a point or body
    properties: LineProperties
    _: KW_ONLY
    segments: int
    attachment: Triple | None = None  #: m in body axes, of the end
    start_attachment: Triple | None = None  #: m in body axes, of the start
    start_direction: Triple | None = None  #: clamped so at the start, see ModelBuilder.add_line
    end_direction: Triple | None = None  #: clamped so at the end
    paid_out: float | None = None  #: m out at first; puts a winch at the start


@dataclass(frozen=True)
class SectionedLine(_Described):
    """A line of several uniform sections, from its start to its end."""

    start: str  #: name of a point or body
    end: str  #: name of a point or body
    _: KW_ONLY
    sections: tuple[tuple[LineProperties, int], ...]  #: each with its number of segments
    attachment: Triple | None = None  #: m in body axes, of the end
    start_attachment: Triple | None = None  #: m in body axes, of the start
    start_direction: Triple | None = None  #: clamped so at the start, see ModelBuilder.add_line
    end_direction: Triple | None = None  #: clamped so at the end
    paid_out: float | None = None  #: m out at first; puts a winch at the start

    def as_uniform(self) -> Line | None:
        """The same as a Line if it has one section only."""
        if len(self.sections) != 1:
            return None
        values = dict(vars(self))
        ((properties, segments),) = values.pop("sections")
        return Line(properties=properties, segments=segments, **values)


@dataclass(frozen=True)
class Joint(_Described):
    """A ball joint from one point or body to another; an attachment is needed exactly at a body.

    Both places are held together by a stiff spring and may turn about it.
    """

    start: str  #: name of a point or body
    end: str  #: name of a point or body
    _: KW_ONLY
    stiffness: float  #: N/m: the places part by force over stiffness
    damping: float = 0.0  #: N s/m
    attachment: Triple | None = None  #: m in body axes, of the end
    start_attachment: Triple | None = None  #: m in body axes, of the start


_POINTS: dict[str, type[PrescribedPoint | FreePoint | Weathervane]] = {
    cls.__name__: cls for cls in (PrescribedPoint, FreePoint, Weathervane)
}


@dataclass(frozen=True, kw_only=True)
class System:
    """All parts of a system. Building checks them; until then any finite value may stand here."""

    water: Water = field(default_factory=Water)
    points: Mapping[str, PrescribedPoint | FreePoint | Weathervane]
    bodies: Mapping[str, Body] = field(default_factory=dict)
    lines: Mapping[str, Line | SectionedLine]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    tank: Tank | None = None

    def __post_init__(self) -> None:
        for name in ("points", "bodies", "lines", "joints"):
            object.__setattr__(self, name, dict(getattr(self, name)))

    @staticmethod
    def of(model: Model) -> System:
        """The description of a model, however that was built."""
        points, lines = {}, {}
        for name in model.points:
            kind, values = model._describe_point(name)
            points[name] = _POINTS[kind](**values)
        for name in model.lines:
            line = SectionedLine(**model._describe_line(name))
            lines[name] = line.as_uniform() or line
        bodies = {name: model._body(name) for name in model.bodies}
        joints = {name: Joint(**model._describe_joint(name)) for name in model.joints}
        return System(
            water=model.water,
            points=points,
            bodies=bodies,
            lines=lines,
            joints=joints,
            tank=model.tank,
        )

    def replace(self, changes: Mapping[str, object]) -> System:
        """A copy with other values at dotted paths; the rest is shared.

        changes: ``{"water.density": 1025.0, "bodies.fish.fins.0.area": 0.02}``. A path may also
        name a whole part, known or new: ``{"points.float": FreePoint(volume=1e-3)}``. A part may
        have dots in its name; of two names that a path begins with the longer is meant.
        Raises InvalidInput naming the path.
        """
        system = self
        for path, value in changes.items():
            try:
                system = _changed(system, path.split("."), value)
            except InvalidInput as error:
                raise InvalidInput(f"{path}: {error}") from None
        return system

    def build(self) -> Model:
        """The constant model.

        Raises InvalidInput naming the part for impossible values, for unknown or repeated names,
        and for what is not connected to a prescribed point.
        """
        builder = ModelBuilder(self.water)
        if self.tank is not None:
            builder.set_tank(self.tank)
        for name, point in self.points.items():
            match point:
                case PrescribedPoint():
                    builder.add_prescribed_point(name)
                case FreePoint():
                    builder.add_free_point(name, **vars(point))
                case Weathervane():
                    builder.add_weathervane(name, **vars(point))
                case _:
                    raise InvalidInput(f"point '{name}' is a {type(point).__name__}")
        for name, body in self.bodies.items():
            builder.add_body(name, body)
        for name, line in self.lines.items():
            builder.add_line(name, **vars(line))
        for name, joint in self.joints.items():
            builder.add_joint(name, **vars(joint))
        return builder.build()


def _changed(node: Any, keys: list[str], value: object) -> Any:
    """A copy of a part, a mapping or a sequence of parts with another value inside."""
    key, *deeper = keys
    if isinstance(node, Mapping):
        for last in range(len(keys), 1, -1):  # a name with dots
            if (dotted := ".".join(keys[:last])) in node:
                key, deeper = dotted, keys[last:]
                break
        if key not in node and deeper:
            raise InvalidInput(f"there is no '{key}', but {', '.join(node) or 'nothing'}")
        return {**node, key: _changed(node[key], deeper, value) if deeper else value}
    if isinstance(node, list | tuple):
        if not key.isdecimal() or int(key) >= len(node):
            raise InvalidInput(f"there is no '{key}' in {len(node)} of them, counted from 0")
        i = int(key)
        item = _changed(node[i], deeper, value) if deeper else value
        return type(node)([*node[:i], item, *node[i + 1 :]])
    if deeper:
        if not hasattr(node, key):
            raise InvalidInput(f"{type(node).__name__} has no '{key}'")
        value = _changed(getattr(node, key), deeper, value)
    if isinstance(node, System):
        if key not in vars(node):
            raise InvalidInput(f"System has no '{key}', it has {', '.join(vars(node))}")
        return System(**{**vars(node), key: value})
    if not hasattr(node, "replace"):
        raise InvalidInput(f"a {type(node).__name__} has no parts")
    return node.replace(**{key: value})
