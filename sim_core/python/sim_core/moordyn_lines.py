# SPDX-License-Identifier: Apache-2.0
"""Line types of a MoorDyn v2 file, and the lines made of them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sim_core._core import LineProperties
from sim_core.moordyn_tables import Row, numbers_of_file

_COLUMNS = ("TypeName", "Diam", "Mass/m", "EA", "BA", "EI", "Cd", "Ca", "CdAx", "CaAx")
_Stiffness = float | list[tuple[float, float]]  # EA, N, or tension (N) over strain

_CREEP = "give EA as static|dynamic stiffness or as a table"


@dataclass(frozen=True)
class LineType:
    """A type of line, of 1 m, and what depends on the length of a segment."""

    properties: LineProperties
    damping_ratio: float  #: of the critical damping of a segment; 0 if the damping is given
    #: stiffness and damping (N s) of a spring and dashpot in series with those of the properties
    fast: tuple[_Stiffness, float] | None

    def sections(self, length: float, segments: int) -> list[tuple[LineProperties, int]]:
        """Return the sections of a line of that type (length in m).

        A viscoelastic segment is two: its slow and its fast spring, each with its dashpot, in
        series. Of half the segment's length each, they have twice its strain at a tension.
        """
        whole = self.properties.replace(length=length)
        if self.damping_ratio:
            stiffness = whole.axial_stiffness
            assert isinstance(stiffness, float)  # a table takes no damping ratio
            unit = length / segments * math.sqrt(stiffness * whole.mass_per_length)
            whole = whole.replace(axial_damping=self.damping_ratio * unit)
        if self.fast is None:
            return [(whole, segments)]
        half = whole.replace(length=length / segments / 2)
        slow = half.replace(
            axial_stiffness=_at_twice_the_strain(half.axial_stiffness),
            axial_damping=0.5 * half.axial_damping,
        )
        fast = half.replace(
            axial_stiffness=_at_twice_the_strain(self.fast[0]), axial_damping=0.5 * self.fast[1]
        )
        return segments * [(slow, 1), (fast, 1)]


def read_line_types(
    rows: list[Row], folder: Path, without_vibration: Callable[[Row], None]
) -> dict[str, LineType]:
    """Return line types by name.

    folder: where files of tables are looked for; without_vibration is told the row of a type whose
    vortex-induced vibration is not simulated.
    Raises InvalidInput naming the line.
    """
    types: dict[str, LineType] = {}
    for row in rows:
        if len(row.words) == 9:
            raise row.error("a line type of MoorDyn v1, without EI: write it as v2")
        row.require(_COLUMNS)
        if row.words[0] in types:
            raise row.error(f"a second type '{row.words[0]}'")
        types[row.words[0]] = _line_type(row, folder)
        if len(row.words) > 10 and row.real(10, "Cl") != 0.0:
            without_vibration(row)
    return types


def _line_type(row: Row, folder: Path) -> LineType:
    ea, ba = row.words[3].split("|"), row.words[4].split("|")
    if ea[0].upper().startswith("SYROPE") or len(ea) > 3:
        raise row.error(f"EA {row.words[3]}: the history of polyester is not supported: {_CREEP}")
    for column, parts in ((4, ba), (5, [row.words[5]])):
        if len(parts) > len(ea) or not all(map(_is_number, parts)):
            what = f"{_COLUMNS[column]} {row.words[column]}"
            raise row.error(f"{what}: only a constant is supported: give a number")
    real = [0.0, *(row.real(i, _COLUMNS[i]) for i in (1, 2)), 0.0, 0.0]
    real += [row.real(i, _COLUMNS[i]) for i in range(5, 10)]
    damping = row.real(4, "BA", ba[0])
    stiffness: _Stiffness
    if _is_number(ea[0]):
        stiffness = row.real(3, "EA", ea[0])
    elif len(ea) > 1:
        raise row.error(f"EA {row.words[3]}: a table with a dynamic stiffness is not supported")
    else:
        stiffness = _table(row, ea[0], folder)
        if damping < 0.0:
            raise row.error("BA: a damping ratio takes a constant EA: give BA in N s")
    fast: tuple[_Stiffness, float] | None = None
    if len(ea) > 1:
        assert isinstance(stiffness, float)
        dynamic, *slope = (row.real(3, "EA", word) for word in ea[1:])
        if not dynamic > stiffness > 0.0 or min(slope, default=0.0) < 0.0:
            raise row.error(f"EA {row.words[3]}: the second, dynamic stiffness must be the larger")
        damper = row.real(4, "BA", ba[1]) if len(ba) == 2 else 0.0
        # in series with the dynamic spring the slow one makes the static stiffness
        if slope and slope[0] > 0.0:
            slow, quick = _springs_at_tension(stiffness, dynamic, slope[0])
            stiffness, fast = slow, (quick, damper)
        else:
            fast = (dynamic, damper)
            stiffness = dynamic * stiffness / (dynamic - stiffness)
    properties = LineProperties(
        length=1.0,
        diameter=real[1],
        mass_per_length=real[2],
        axial_stiffness=stiffness,
        axial_damping=max(damping, 0.0),
        bending_stiffness=real[5],
        normal_drag=real[6],
        added_mass=real[7],
        tangential_drag=real[8],
        tangential_added_mass=real[9],
    )
    return LineType(properties, max(-damping, 0.0), fast)


def _at_twice_the_strain(stiffness: _Stiffness) -> _Stiffness:
    if isinstance(stiffness, float):
        return 0.5 * stiffness
    return [(2.0 * strain, tension) for strain, tension in stiffness]


def _springs_at_tension(
    static: float, at_rest: float, slope: float
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Slow and fast spring where the dynamic stiffness is at_rest + slope · mean tension.

    The fast one, dT/dε = at_rest + slope T, has this stiffness about any mean; in series with the
    slow one it makes the static EA at all tensions. Up to a static strain of 0.2, then straight.
    """
    slow, fast = [(0.0, 0.0)], [(0.0, 0.0)]
    count = 40
    for i in range(1, count + 1):
        tension = 0.2 * static * (i / count) ** 2
        quick = math.log1p(slope * tension / at_rest) / slope
        fast.append((quick, tension))
        slow.append((tension / static - quick, tension))
    return slow, fast


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[-+]?[.\d]+([eE][-+]?\d+)?", word) is not None


def _table(row: Row, file: str, folder: Path) -> list[tuple[float, float]]:
    """Read strain and tension (N) from a file."""
    table = [(0.0, 0.0)]
    for strain, tension in numbers_of_file(row, file, folder, heads=2, columns=2):
        if strain <= 0.0:
            if strain == 0.0 and tension != 0.0:
                raise row.error(f"EA {file}: there must be no tension at no strain")
        elif strain <= table[-1][0] or tension <= table[-1][1]:
            raise row.error(f"EA {file}: strains and tensions must increase")
        else:
            table.append((strain, tension))
    if len(table) < 2:
        raise row.error(f"EA {file}: there are no tensions at strains above 0")
    return table
