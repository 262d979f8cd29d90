# SPDX-License-Identifier: Apache-2.0
"""Froude scaling of a rig: the same tow, λ times as long.

With gravity and the water as they are, equal Froude numbers U²/(g L) leave one free scale: lengths
go by λ, times by √λ, and masses, the water's density being the same, by λ³. Each quantity's factor
follows from its unit, which the schema states; none is listed here.

What the laboratory buys is not scaled: board, sensors and their calibrations stay, except where a
sensor sits and how fast the water passes it. What similarity then does not hold for is named by
towtank_lab.scale_effects.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from towtank_rig import Quantity, Rig, parse_rig
from towtank_rig.loading import replaced
from towtank_rig.quantity import Tolerance

Exponents = tuple[float, float, float]
"""Of length, time and mass."""

_BASE: dict[str, Exponents] = {
    "m": (1, 0, 0),
    "s": (0, 1, 0),
    "kg": (0, 0, 1),
    "N": (1, -2, 1),
    "Pa": (-1, -2, 1),
    "Hz": (0, -1, 0),
    "rad": (0, 0, 0),
    "1": (0, 0, 0),
    # Electricity and temperature are the same at every scale.
    "V": (0, 0, 0),
    "K": (0, 0, 0),
    "degC": (0, 0, 0),
}
_TOKEN = re.compile(r"\s*([A-Za-z]+|1|\^-?\d+|[/()])")

_HEAD = """\
# {origin} by `towtank similitude`. Comments below are those of
# the original and speak of its numbers.
"""

_INSTRUMENTS = re.compile(r"board\.|calibrations\.|sensors\.(?!.*(\.position\.|\.surge_speed$))")


def dimension(unit: str) -> Exponents:
    """Return the exponents of length, time and mass of a unit as the schema writes it.

    A blank multiplies, ``/`` divides by the next factor, a bracket holds a product: ``V/(m/s^2)``.
    Raises ValueError for a unit that cannot be read.
    """
    tokens = [match[1] for match in _TOKEN.finditer(unit)]
    if "".join(tokens) != unit.replace(" ", ""):
        raise ValueError(f"unit {unit!r} cannot be read")
    return _product(iter(tokens), unit)


def _product(tokens: Iterator[str], unit: str) -> Exponents:
    """Return the exponents up to the end of the bracket or of the unit."""
    factors: list[tuple[Exponents, float]] = []  # exponents and power
    sign = 1
    for token in tokens:
        if token == ")":
            break
        if token == "/":
            sign = -1
        elif token.startswith("^"):
            base, power = factors.pop()
            factors.append((base, power * int(token[1:])))
        else:
            if token != "(" and token not in _BASE:
                raise ValueError(f"unit {unit!r} has {token!r}, whose dimension is not known")
            factors.append((_product(tokens, unit) if token == "(" else _BASE[token], sign))
            sign = 1
    length, time, mass = (sum(base[i] * power for base, power in factors) for i in range(3))
    return length, time, mass


def froude_factor(unit: str, scale: float) -> float:
    """Return by what a quantity of this unit grows if lengths do by ``scale`` (λ)."""
    length, time, mass = dimension(unit)
    return scale ** (length + time / 2.0 + 3.0 * mass)


def is_scaled(path: str) -> bool:
    """Return whether the quantity at a dotted path belongs to the tow, not the instruments."""
    return _INSTRUMENTS.match(path) is None


def scale_rig(rig: Rig, scale: float, name: str) -> Rig:
    """Return the Froude-scaled rig, with a text of its own that says where it comes from.

    Args:
        rig: The rig to scale.
        scale: λ, new length over old.
        name: Name of the new rig.

    Raises:
        ValueError: λ is not a positive number.
        RigError: a scaled value is impossible.
    """
    if not 0.0 < scale < float("inf"):
        raise ValueError(f"length scale {scale:g} is impossible: give a positive number")
    origin = f"Froude-scaled by {scale:g} from {rig.name}"
    changes: dict[str, object] = {
        path: _scaled(quantity, scale, origin)
        for path, quantity in rig.quantities()
        if is_scaled(path) and froude_factor(quantity.unit, scale) != 1.0 and _stands(rig, path)
    }
    changes["name"] = name
    changes["description"] = f"{rig.description.strip()} ({origin}.)"
    return parse_rig(_HEAD.format(origin=origin) + replaced(rig, changes).text, f"{name}.yaml")


def _stands(rig: Rig, path: str) -> bool:
    """Whether the file states the quantity; defaults of the schema are zero at any scale."""
    node: object = rig._document.data
    for key in path.split("."):
        if isinstance(node, dict) and key in node:
            node = node[key]
        elif isinstance(node, list):
            node = node[int(key)]
        else:
            return False
    return True


def _scaled(quantity: Quantity, scale: float, origin: str) -> dict[str, object]:
    factor = froude_factor(quantity.unit, scale)
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    value = factor * quantity.value
    new: dict[str, object] = {"value": f"{value!r}{unit}"}
    if quantity.range is not None:
        new["range"] = [factor * limit for limit in quantity.range]
    # A measured length is none at another scale; what is assumed or set stays so.
    kept = quantity.basis in ("assumed", "stated")
    new["basis"] = quantity.basis if kept else "derived"
    new["source"] = f"{quantity.source}; {origin}" if quantity.source else origin
    if isinstance(quantity, Tolerance):
        new["distribution"] = quantity.distribution
    return new
