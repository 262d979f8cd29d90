# SPDX-License-Identifier: Apache-2.0
"""What a manoeuvre study leaves: table of histories, summary, and report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa

from towtank_study.charts import PALETTE
from towtank_study.manoeuvre import Manoeuvre
from towtank_study.manoeuvre_run import FIGURES, Passage
from towtank_study.report import page_html
from towtank_study.results import table_with_units

GIVEN = "as given"
"""Name of the case that changes nothing."""


def passages_table(passages: Sequence[Passage], metadata: dict[str, str]) -> pa.Table:
    """Return a row for each case and instant: positions of ship and body, velocity of the body,
    top tension."""
    columns: dict[str, tuple[str, pa.Array]] = {
        "case": ("", pa.array([p.case for p in passages for _ in p.time], pa.string())),
        "time": ("s", pa.array(np.concatenate([p.time for p in passages]))),
    }
    for name, unit in (("ship", "m"), ("body", "m"), ("body_velocity", "m/s")):
        stacked = np.concatenate([getattr(p, name) for p in passages])
        for place, axis in enumerate("xyz"):
            columns[f"{name}_{axis}"] = (unit, pa.array(np.ascontiguousarray(stacked[:, place])))
    columns["top_tension"] = ("N", pa.array(np.concatenate([p.top_tension for p in passages])))
    return table_with_units(columns, metadata)


def summary(study: Manoeuvre, passages: Sequence[Passage]) -> dict[str, Any]:
    """Return the figures by case, with their units."""
    return {
        "study": study.name,
        "statement": study.statement,
        "units": {name: FIGURES[name] for name in passages[0].figures},
        "cases": {
            passage.case: {
                "changes": study.cases.get(passage.case, {}),
                "figures": passage.figures,
            }
            for passage in passages
        },
    }


def report_html(study: Manoeuvre, passages: Sequence[Passage], found: dict[str, Any]) -> str:
    """The report as text, one file that needs nothing else."""
    figures = [
        ("Seen from above", _plan_view(passages)),
        ("Depth of the body", _over_time(passages, lambda p: -p.body[:, 2], "depth, m", True)),
        ("Tension at the ship", _over_time(passages, lambda p: p.top_tension, "tension, N", False)),
    ]
    return page_html(
        "manoeuvre.html.j2", figures, study=study, summary=found, assumptions=_assumptions(study)
    )


def _assumptions(study: Manoeuvre) -> list[tuple[str, Any]]:
    """Return path and quantity of all that is assumed."""
    sections = {"water": study.water, "cable": study.cable, "body": study.body}
    return [
        (f"{name}.{key}", quantity)
        for name, section in sections.items()
        for key, quantity in section
        if getattr(quantity, "basis", "") == "assumed"
    ]


def _plan_view(passages: Sequence[Passage]) -> go.Figure:
    """Tracks of the bodies, and of the ship where it takes another one than in the first case."""
    figure = go.Figure()
    first = passages[0].ship
    for place, passage in enumerate(passages):
        colour = PALETTE[place % len(PALETTE)]
        tracks = [(f"body, {passage.case}", passage.body, {"color": colour})]
        if place == 0 or not np.array_equal(passage.ship, first):
            tracks.insert(
                0, (f"ship, {passage.case}", passage.ship, {"color": colour, "dash": "dash"})
            )
        for name, track, line in tracks:
            figure.add_scatter(x=track[:, 0], y=track[:, 1], name=name, line=line)
    figure.update_yaxes(title_text="y, m", scaleanchor="x", scaleratio=1)
    return _finish(figure, "x, m", 520)


def _over_time(passages: Sequence[Passage], values: Any, title: str, downward: bool) -> go.Figure:
    figure = go.Figure()
    for place, passage in enumerate(passages):
        figure.add_scatter(
            x=passage.time,
            y=values(passage),
            name=passage.case,
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
