# SPDX-License-Identifier: Apache-2.0
"""The results of a study as a table, and its Parquet file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from towtank_study.designs import Sample
from towtank_study.evaluation import Outcome
from towtank_study.tow_run import OUTPUTS
from towtank_study.variables import Variable


def results_table(
    variables: Sequence[Variable],
    samples: Sequence[Sample],
    outcomes: Sequence[Outcome],
) -> pa.Table:
    """Return a row for each sample: its number, the parameters, the outputs, and `error`.

    Columns hold their `unit` in their metadata; outputs of a failed sample are null.
    """
    outputs = list(outcomes[0].outputs)
    columns = {
        "sample": ("1", pa.array([outcome.sample for outcome in outcomes], pa.int64())),
        **{
            variable.path: (variable.unit, _parameter([s[variable.path] for s in samples]))
            for variable in variables
        },
        **{
            name: (
                OUTPUTS[name],
                pa.array([o.outputs[name] for o in outcomes], pa.float64(), from_pandas=True),
            )
            for name in outputs
        },
        "error": ("", pa.array([outcome.error for outcome in outcomes], pa.string())),
    }
    return table_with_units(columns)


def table_with_units(columns: Mapping[str, tuple[str, pa.Array]]) -> pa.Table:
    """Return a table of columns, each with its unit (`1` for plain numbers, empty for text)."""
    schema = pa.schema(
        [
            pa.field(name, array.type, metadata={"unit": unit} if unit else None)
            for name, (unit, array) in columns.items()
        ]
    )
    return pa.table([array for _, array in columns.values()], schema=schema)


def _parameter(values: Sequence[object]) -> pa.Array:
    if any(isinstance(value, str) for value in values):
        return pa.array([str(value) for value in values], pa.string())
    return pa.array([float(value) for value in values], pa.float64())  # type: ignore[arg-type]


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table so that a kill leaves either no file or the whole one."""
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        pq.write_table(table, file)
        file.flush()
        os.fsync(file.fileno())
    partial.rename(path)


def read_metadata(path: Path) -> dict[str, str]:
    """Return the metadata of a table's file."""
    raw = pq.read_schema(path).metadata or {}
    return {key.decode(): value.decode() for key, value in raw.items()}


def unit_of(table: pa.Table, column: str) -> str:
    """Return the unit of a column, `1` for plain numbers and text."""
    metadata = table.schema.field(column).metadata or {}
    return metadata.get(b"unit", b"1").decode()
