# SPDX-License-Identifier: Apache-2.0
"""What some samples of a study did over time, for its report and for a look at details."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from towtank_study.evaluation import UNSOLVED, changed, parsed
from towtank_study.tow_run import PLACES, Record, TowRun, simulate
from towtank_study.variables import Value

COLUMNS: dict[str, str] = {
    "time": "s",
    "tow_point_height": "m",
    "depressor_height": "m",
    **{f"fish_height_{place}": "m" for place in PLACES},
    "fish_pitch": "deg",
    "top_tension": "N",
}
"""Names and units; heights are z in tank axes, pitch is bow up."""


@dataclass(frozen=True)
class TowHistory:
    """Simulates samples of a study again: `history(number, values)` is the number and the run, or
    None where it cannot be solved."""

    study_text: str
    rig_text: str

    def __call__(self, number: int, values: Mapping[str, Value]) -> tuple[int, TowRun | None]:
        study, rig = parsed(self.study_text, self.rig_text)
        try:
            return number, simulate(*changed(study, rig, values))
        except UNSOLVED:
            return number, None


def histories_table(runs: Iterable[tuple[int, TowRun | None]]) -> pa.Table:
    """Return a row for each sample of time: number of the sample, `stretch` (first or measured),
    and COLUMNS."""
    parts = []
    for number, run in runs:
        if run is None:
            continue
        for stretch, record in (("first", run.first), ("measured", run.measured)):
            if record is not None:
                parts.append(_part(number, stretch, record))
    return pa.Table.from_batches(parts, schema=_SCHEMA)


_SCHEMA = pa.schema(
    [
        pa.field("sample", pa.int64()),
        pa.field("stretch", pa.string()),
        *(pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in COLUMNS.items()),
    ]
)


def _part(number: int, stretch: str, record: Record) -> pa.RecordBatch:
    values = {
        "time": record.time,
        "tow_point_height": record.tow_point,
        "depressor_height": record.depressor,
        **{f"fish_height_{place}": heights for place, heights in record.fish.items()},
        "fish_pitch": np.degrees(record.pitch),
        "top_tension": record.top_tension,
    }
    count = len(record.time)
    arrays = [pa.array([number] * count, pa.int64()), pa.array([stretch] * count, pa.string())]
    return pa.record_batch([*arrays, *(pa.array(values[name]) for name in COLUMNS)], schema=_SCHEMA)
