# SPDX-License-Identifier: Apache-2.0
"""The report of a study: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import jinja2
import pyarrow as pa
from plotly.graph_objects import Figure
from plotly.offline import get_plotlyjs

from towtank_study import charts
from towtank_study.curves import main_outputs, plots_of
from towtank_study.manoeuvre import Manoeuvre
from towtank_study.manoeuvre_charts import manoeuvre_figures
from towtank_study.study import LatinHypercube, Optimisation, Sobol, Study
from towtank_study.variables import Variable


def tows_report(
    study: Study,
    variables: Sequence[Variable],
    table: pa.Table,
    summary: dict[str, Any],
    histories: pa.Table | None = None,
) -> str:
    """The report of a rig's tow as text. table: the results; summary: as `summarise` gives it;
    histories: as `histories_table` gives them."""
    figures = list(_figures(study, variables, table, summary))
    if histories is not None:
        paths = [variable.path for variable in variables]
        figures += charts.history_figures(paths, table, histories)
    return _page("tows.html.j2", figures, study=study, summary=summary)


def manoeuvre_report(study: Manoeuvre, histories: pa.Table, summary: dict[str, Any]) -> str:
    """The report of a manoeuvre as text. histories, summary: those of the planned study."""
    sections = {"water": study.water, "cable": study.cable, "body": study.body}
    assumptions = [
        (f"{name}.{key}", quantity)
        for name, section in sections.items()
        for key, quantity in section
        if getattr(quantity, "basis", "") == "assumed"
    ]
    figures = manoeuvre_figures(histories)
    return _page(
        "manoeuvre.html.j2", figures, study=study, summary=summary, assumptions=assumptions
    )


def _page(template: str, figures: Iterable[tuple[str, Figure]], **values: object) -> str:
    """Fill a template that builds on page.html.j2, with `charts` made of headings and figures.

    values: `study`, `summary` and what else the template shows.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("towtank_study"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    charts = [
        (heading, _chart_html(f"chart-{number}", figure))
        for number, (heading, figure) in enumerate(figures)
    ]
    return environment.get_template(template).render(
        charts=charts, plotly_js=get_plotlyjs(), **values
    )


def _figures(
    study: Study, variables: Sequence[Variable], table: pa.Table, summary: dict[str, Any]
) -> Iterator[tuple[str, Figure]]:
    if isinstance(study.design, Optimisation):
        figure = charts.trade_off_figure(study.design, table, summary["trade_off"])
        yield "Trade-off", figure
    for plot in plots_of(study):
        by = f", by {plot.by}" if plot.by else ""
        yield f"Over {plot.x}{by}", charts.plot_figure(study, table, plot)
    if isinstance(study.design, (Sobol, LatinHypercube)):
        shown = dict.fromkeys(
            [*(reference.output for reference in study.references), *main_outputs(study)]
        )
        for name in (name for name in shown if name in study.outputs):
            figure = charts.distribution_figure(study, table, len(variables), name)
            yield f"Distribution of {name}", figure
            indices = summary.get("sensitivity", {}).get(name)
            if indices is not None:
                yield f"Sobol indices of {name}", charts.indices_figure(indices)


def _chart_html(name: str, figure: Figure) -> str:
    return figure.to_html(
        full_html=False,
        include_plotlyjs=False,
        div_id=name,
        config={"responsive": True, "displaylogo": False},
    )
