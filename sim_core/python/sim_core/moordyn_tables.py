# SPDX-License-Identifier: Apache-2.0
"""The text of a MoorDyn v2 input file as tables whose rows know their line numbers.

Format: MoorDyn documentation, "The V2 Input File". Sections begin with a header, dashes around a
key phrase; most hold a table below two lines of column names and units; ``#`` begins a comment.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim_core._core import InvalidInput

# What a header may say, by the name that the section has here.
_PHRASES = {
    "LINE TYPES": ("LINE TYPES", "LINE DICTIONARY"),
    "ROD TYPES": ("ROD TYPES", "ROD DICTIONARY"),
    "BODIES": ("BODIES", "BODY LIST", "BODY PROPERTIES"),
    "RODS": ("RODS", "ROD LIST", "ROD PROPERTIES"),
    "POINTS": (
        "POINTS",
        "POINT LIST",
        "POINT PROPERTIES",
        "CONNECTION PROPERTIES",
        "NODE PROPERTIES",
    ),
    "LINES": ("LINES", "LINE LIST", "LINE PROPERTIES"),
    "EXTERNAL LOADS": ("EXTERNAL LOADS",),
    "FAILURE": ("FAILURE",),
    "CONTROL": ("CONTROL",),
    "SYROPE IC": ("SYROPE IC",),
    "OPTIONS": ("OPTIONS",),
    "OUTPUTS": ("OUTPUTS",),
}
_WITHOUT_COLUMN_HEADS = ("OPTIONS", "OUTPUTS")


@dataclass(frozen=True)
class Row:
    """A line of a table."""

    source: str  #: name of the file
    number: int  #: of the line, from 1
    words: Sequence[str]

    def error(self, what: str) -> InvalidInput:
        """Return the error to raise about this row."""
        return InvalidInput(f"{self.source}:{self.number}: {what}")

    def require(self, columns: Sequence[str]) -> None:
        """Refuse a row that is shorter than its table."""
        if len(self.words) < len(columns):
            missing = ", ".join(columns[len(self.words) :])
            raise self.error(f"{len(self.words)} values, and none for {missing}")

    def real(self, column: int, name: str, text: str | None = None) -> float:
        """Return the finite number in a column, or in a part of it."""
        text = self.words[column] if text is None else text
        try:
            value = float(text)
        except ValueError:
            raise self.error(f"{name} is no number: '{text}'") from None
        if not math.isfinite(value):
            raise self.error(f"{name} is not finite: '{text}'")
        return value

    def reals(self, column: int, name: str) -> list[float]:
        """Return the numbers in a column that bars separate."""
        return [self.real(column, name, text) for text in self.words[column].split("|")]

    def vector(self, column: int, name: str) -> NDArray[np.float64]:
        """Return the three numbers from a column on; name is that of the first."""
        return np.array([self.real(column + i, name) for i in range(3)])

    def integer(self, column: int, name: str) -> int:
        try:
            return int(self.words[column])
        except ValueError:
            raise self.error(f"{name} is no whole number: '{self.words[column]}'") from None


def text_beside(row: Row, file: str, folder: Path) -> str:
    """Return the text of a file that a row names: in the folder, by its path or its name alone.

    Raises the row's error for one that is not there.
    """
    path = next((p for p in (folder / file, folder / Path(file).name) if p.is_file()), None)
    if path is None:
        raise row.error(f"there is no file {file} beside {row.source}: put it there")
    return path.read_text(encoding="utf-8", errors="replace")


def numbers_of_file(
    row: Row, file: str, folder: Path, *, heads: int, columns: int
) -> list[list[float]]:
    """Return the numbers of a file that a row names, line by line, after that many heads or more.

    Raises the row's error for a file that is not there (see text_beside), and for lines with fewer
    numbers than columns.
    """
    lines: list[list[float]] = []
    for number, line in enumerate(text_beside(row, file, folder).splitlines(), start=1):
        if number <= heads or not line.strip():
            continue
        try:
            values = [float(word) for word in line.split()]
        except ValueError:
            if not lines:
                continue  # one more line of heads
            values = []
        if len(values) < columns or not all(map(math.isfinite, values)):
            raise row.error(f"{file}:{number}: there must be {columns} numbers or more")
        lines.append(values)
    if not lines:
        raise row.error(f"{file} holds no numbers")
    return lines


@dataclass(frozen=True)
class Tables:
    """The sections of a file; those that it lacks are empty."""

    source: str
    sections: dict[str, list[Row]]
    unknown: list[Row]  #: headers of sections of no known name

    def __getitem__(self, name: str) -> list[Row]:
        return self.sections.get(name, [])


def read_tables(text: str, source: str) -> Tables:
    """Split the text of a file; ``source`` names it in errors.

    Raises InvalidInput for a section that stands twice and for a table without its two heads.
    """
    sections: dict[str, list[Row]] = {}
    unknown: list[Row] = []
    heads = 0  # lines of column names and units still to come
    rows: list[Row] | None = None  # of the present section, if it is known
    header = Row(source, 1, [])
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("#")[0].strip()
        if not line:
            continue
        row = Row(source, number, line.split())
        if "---" in line:
            _require_heads(header, heads)
            header, name, rows, heads = row, _section(line), None, 0
            if name in sections:
                raise row.error(f"a second section {name}")
            if name is not None:
                rows = sections[name] = []
                heads = 0 if name in _WITHOUT_COLUMN_HEADS else 2
        elif heads > 0:
            heads -= 1
        elif rows is not None:
            rows.append(row)
        elif sections and header not in unknown:  # not the title, which comes before them
            unknown.append(header)
    _require_heads(header, heads)
    if not sections:
        raise InvalidInput(f"{source}:1: no MoorDyn v2 file: it has none of the known sections")
    return Tables(source, sections, unknown)


def _require_heads(header: Row, heads: int) -> None:
    if heads > 0:
        raise header.error("the section ends before its lines of column names and units")


def _section(line: str) -> str | None:
    """The section that a header begins, by the phrase that it begins with."""
    said = " ".join(line.strip("- ").upper().split()).removeprefix("SOLVER ")
    for name, phrases in _PHRASES.items():
        if any(re.match(rf"{phrase}\b", said) for phrase in phrases):
            return name
    return None
