# SPDX-License-Identifier: Apache-2.0
"""Readings that were already taken, as CSV: a line of column names, then one line a reading."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from towtank_lab.errors import ProcedureError


def read_rows(path: Path, required: Sequence[str]) -> list[dict[str, float]]:
    """Return the rows by column name; lines that begin with # are comments.

    Raises ProcedureError for a file that cannot be read, a missing column or what is no number.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise ProcedureError(f"{path}: {error.strerror}: check the path") from None
    except UnicodeDecodeError:
        raise ProcedureError(f"{path}: not UTF-8 text: save it as UTF-8") from None
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    if not numbered:
        raise ProcedureError(f"{path}: there are no readings: write column names and rows")
    table = csv.reader(line for _, line in numbered)
    names = [name.strip() for name in next(table)]
    missing = [name for name in required if name not in names]
    if missing:
        raise ProcedureError(
            f"{path}:{numbered[0][0]}: no column {', '.join(missing)}: the columns are "
            f"{', '.join(required)}"
        )
    return [
        _row(f"{path}:{number}", names, cells)
        for (number, _), cells in zip(numbered[1:], table, strict=True)
    ]


def rows_text(rows: Sequence[Mapping[str, float]]) -> str:
    """Return rows of the same columns as the text of a readings file."""
    stream = io.StringIO()
    table = csv.DictWriter(stream, fieldnames=list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return stream.getvalue()


def _row(where: str, names: Sequence[str], cells: Iterable[str]) -> dict[str, float]:
    cells = list(cells)
    if len(cells) != len(names):
        raise ProcedureError(f"{where}: {len(cells)} values for {len(names)} columns: complete it")
    row = {}
    for name, cell in zip(names, cells, strict=True):
        try:
            row[name] = float(cell)
        except ValueError:
            raise ProcedureError(f"{where}: {name} is {cell!r}: write a number") from None
        if not math.isfinite(row[name]):
            raise ProcedureError(f"{where}: {name} is {cell!r}: write a finite number")
    return row
