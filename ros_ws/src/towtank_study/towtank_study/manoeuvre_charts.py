# SPDX-License-Identifier: Apache-2.0
"""Charts of a manoeuvre study's report, of its table of histories."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from towtank_study.charts import PALETTE

Array = NDArray[np.float64]


def manoeuvre_figures(histories: pa.Table) -> Iterator[tuple[str, go.Figure]]:
    """Yield headings and figures: plan view, and depth and tension over time of all cases."""
    cases = {
        name: histories.filter(pc.equal(histories["case"], name))
        for name in dict.fromkeys(histories["case"].to_pylist())
    }
    yield "Seen from above", _plan_view(cases)
    depths = {name: -_values(case, "body_z") for name, case in cases.items()}
    yield "Depth of the body", _over_time(cases, depths, "depth, m", downward=True)
    tensions = {name: _values(case, "top_tension") for name, case in cases.items()}
    yield "Tension at the ship", _over_time(cases, tensions, "tension, N", downward=False)


def _values(case: pa.Table, column: str) -> Array:
    values: Array = case[column].to_numpy()
    return values


def _plan_view(cases: dict[str, pa.Table]) -> go.Figure:
    """Tracks of the bodies, and of the ship where it takes another one than in the first case."""
    figure = go.Figure()
    first = next(iter(cases.values()))
    for place, (name, case) in enumerate(cases.items()):
        colour = PALETTE[place % len(PALETTE)]
        parts = [("body", {"color": colour})]
        if place == 0 or not case.select(_SHIP).equals(first.select(_SHIP)):
            parts.insert(0, ("ship", {"color": colour, "dash": "dash"}))
        for part, line in parts:
            x, y = _values(case, f"{part}_x"), _values(case, f"{part}_y")
            figure.add_scatter(x=x, y=y, name=f"{part}, {name}", line=line)
    figure.update_yaxes(title_text="y, m", scaleanchor="x", scaleratio=1)
    return _finish(figure, "x, m", 520)


_SHIP = ["ship_x", "ship_y", "ship_z"]


def _over_time(
    cases: dict[str, pa.Table], values: dict[str, Array], title: str, *, downward: bool
) -> go.Figure:
    figure = go.Figure()
    for place, (name, case) in enumerate(cases.items()):
        figure.add_scatter(
            x=_values(case, "time"),
            y=values[name],
            name=name,
            line={"color": PALETTE[place % len(PALETTE)]},
        )
    figure.update_yaxes(title_text=title, autorange="reversed" if downward else None)
    return _finish(figure, "time, s", 380)


def _finish(figure: go.Figure, x_title: str, height: int) -> go.Figure:
    figure.update_xaxes(title_text=x_title)
    return figure.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 70, "r": 10, "t": 40, "b": 50},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 1.0, "xanchor": "right"},
        font={"size": 13},
    )
