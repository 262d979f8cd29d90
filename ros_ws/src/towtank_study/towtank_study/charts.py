# SPDX-License-Identifier: Apache-2.0
"""Charts of a study's report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa
import pyarrow.compute as pc
from plotly.subplots import make_subplots

from towtank_study.curves import curves, is_a_grid
from towtank_study.optimisation import feasible_rows
from towtank_study.results import unit_of
from towtank_study.sensitivity import independent_rows
from towtank_study.study import Optimisation, Plot, Reference, Sobol, Study

PALETTE = (
    "#1f5fa8", "#d9730d", "#2a8a57", "#8a4fa3", "#6b6b6b", "#b0892f", "#3b8ea5", "#c2527e",
)  # fmt: skip
REFERENCE_COLOUR = "#b3261e"
SHOWN_INDICES = 20


def plot_figure(study: Study, table: pa.Table, plot: Plot) -> go.Figure:
    """The plot's outputs, one below the other, over its x, with the study's references."""
    figure = make_subplots(rows=len(plot.y), cols=1, shared_xaxes=True, vertical_spacing=0.06)
    joined = is_a_grid(study) and not pa.types.is_string(table[plot.x].type)
    for number, curve in enumerate(curves(study, table, plot)):
        part = table.take(curve.rows)
        for row, name in enumerate(plot.y, start=1):
            figure.add_scatter(
                x=part[plot.x].to_pylist(),
                y=part[name].to_pylist(),
                mode="lines+markers" if joined else "markers",
                line={"color": PALETTE[number % len(PALETTE)], "width": 1.5},
                marker={"size": 6 if len(curve.rows) < 200 else 3},
                name=f"{plot.by} {curve.label}" if plot.by else "found",
                legendgroup=curve.label,
                showlegend=row == 1,
                row=row,
                col=1,
            )
    for row, name in enumerate(plot.y, start=1):
        for reference in study.references:
            if reference.output == name:
                _add_reference(figure, reference, axis="y", row=row)
        figure.update_yaxes(title_text=_title(table, name), row=row, col=1)
    if plot.logarithmic:
        figure.update_xaxes(type="log")
    return _finish(figure, _title(table, plot.x), len(plot.y))


def distribution_figure(study: Study, table: pa.Table, dimensions: int, output: str) -> go.Figure:
    """Histogram of an output over the independent samples of a random design."""
    values = table[output].to_numpy().astype(float)
    if isinstance(study.design, Sobol):
        values = values[independent_rows(study.design, dimensions)]
    values = values[np.isfinite(values)]
    figure = make_subplots(rows=1, cols=1)
    figure.add_histogram(x=values, nbinsx=50, marker={"color": PALETTE[0]}, showlegend=False)
    if len(values):
        for limit in np.percentile(values, [2.5, 97.5]):
            figure.add_vline(x=limit, line={"color": PALETTE[0], "dash": "dot"})
    for reference in study.references:
        if reference.output == output:
            _add_reference(figure, reference, axis="x")
    figure.update_yaxes(title_text="samples")
    return _finish(figure, f"{_title(table, output)} (dotted: its 95 % band)", 1)


def indices_figure(sensitivity: Mapping[str, Any]) -> go.Figure:
    """Bars of the first-order and total Sobol indices of one output, the largest first."""
    ranked = sorted(
        sensitivity["parameters"].items(), key=lambda item: item[1]["total"], reverse=True
    )[:SHOWN_INDICES]
    paths = [path for path, _ in ranked]
    figure = make_subplots(rows=1, cols=1)
    for kind, name, colour in (
        ("total", "total", PALETTE[0]),
        ("first", "first order", PALETTE[1]),
    ):
        figure.add_bar(
            y=paths,
            x=[indices[kind] for _, indices in ranked],
            error_x={"array": [indices[f"{kind}_confidence"] for _, indices in ranked]},
            orientation="h",
            name=name,
            marker={"color": colour},
        )
    figure.update_yaxes(autorange="reversed")
    _finish(figure, "Sobol index, with its 95 % confidence", 1)
    return figure.update_layout(height=140 + 28 * len(paths), barmode="group")


def trade_off_figure(
    design: Optimisation, table: pa.Table, trade_off: Sequence[Mapping[str, Any]]
) -> go.Figure:
    """The first objective over each further one: all samples that keep the limits, and the
    trade-off. A single objective is drawn over the number of the sample."""
    y, *others = design.minimise
    feasible = np.flatnonzero(feasible_rows(design, table))
    best = [entry["sample"] for entry in trade_off]
    axes = others or ["sample"]
    figure = make_subplots(rows=1, cols=len(axes), shared_yaxes=True)
    for place, x in enumerate(axes, start=1):
        for rows, name, colour, mode in (
            (feasible, "keeps all limits", PALETTE[4], "markers"),
            (best, "not beaten", PALETTE[1], "lines+markers" if len(axes) == 1 else "markers"),
        ):
            figure.add_scatter(
                x=table[x].take(rows).to_pylist(),
                y=table[y].take(rows).to_pylist(),
                mode=mode,
                name=name,
                text=[f"sample {row}" for row in rows],
                marker={"color": colour, "size": 4 if colour == PALETTE[4] else 7},
                line={"color": colour, "width": 1.5},
                showlegend=place == 1,
                row=1,
                col=place,
            )
        figure.update_xaxes(title_text=_title(table, x), row=1, col=place)
    figure.update_yaxes(title_text=_title(table, y), row=1, col=1)
    return _finish(figure, _title(table, axes[0]), 1).update_layout(height=460)


def history_figures(
    paths: Sequence[str], table: pa.Table, histories: pa.Table
) -> Iterator[tuple[str, go.Figure]]:
    """Heading and figure for each sample: its heave from the start, and over the measured periods,
    each about its mean."""
    for number in sorted(set(histories["sample"].to_pylist())):
        values = ", ".join(f"{path} {_short(table[path][number].as_py())}" for path in paths)
        of_sample = histories.filter(pc.equal(histories["sample"], number))
        figure = make_subplots(
            rows=2, cols=1, subplot_titles=["From the start", "Over the measured periods"]
        )
        for row, stretch in enumerate(("first", "measured"), start=1):
            part = of_sample.filter(pc.equal(of_sample["stretch"], stretch))
            if not part.num_rows:
                continue
            for (label, name), colour in zip(_HEAVES.items(), PALETTE, strict=False):
                heights = part[name].to_numpy()
                figure.add_scatter(
                    x=part["time"].to_numpy().astype(np.float32),
                    y=(1e3 * (heights - heights.mean())).astype(np.float32),
                    mode="lines",
                    line={"color": colour, "width": 1.5},
                    name=label,
                    legendgroup=label,
                    showlegend=row == 2,
                    row=row,
                    col=1,
                )
            figure.update_yaxes(title_text="heave, mm", row=row, col=1)
        yield f"Over time: sample {number} ({values})", _finish(figure, "time, s", 2)


_HEAVES = {
    "depressor": "depressor_height",
    "fish, nose": "fish_height_nose",
    "fish, middle": "fish_height_middle",
}


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _add_reference(figure: go.Figure, reference: Reference, axis: str, row: int = 1) -> None:
    """Draw a value as a line, or a band, across the given axis."""
    style = {
        "annotation_text": reference.label,
        "annotation_font_color": REFERENCE_COLOUR,
        "annotation_position": "top right" if axis == "y" else "top",
        "row": row,
        "col": 1,
    }
    low, high = reference.band or (reference.value, reference.value)
    ends = {f"{axis}0": low, f"{axis}1": high}
    draw = figure.add_hrect if axis == "y" else figure.add_vrect
    line = {"color": REFERENCE_COLOUR, "width": 0 if reference.band else 1.5, "dash": "dash"}
    fill = {"fillcolor": REFERENCE_COLOUR, "opacity": 0.15 if reference.band else 1.0}
    draw(**ends, line=line, **fill, **style)


def _title(table: pa.Table, column: str) -> str:
    unit = unit_of(table, column)
    return column.replace("_", " ") + ("" if unit == "1" else f", {unit}")


def _finish(figure: go.Figure, x_title: str, rows: int) -> go.Figure:
    figure.update_xaxes(title_text=x_title, row=rows, col=1)
    return figure.update_layout(
        template="plotly_white",
        height=160 + 220 * rows,
        margin={"l": 70, "r": 10, "t": 40, "b": 50},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 1.0, "xanchor": "right"},
        font={"size": 13},
    )
