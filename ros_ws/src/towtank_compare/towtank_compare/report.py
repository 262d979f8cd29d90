# SPDX-License-Identifier: Apache-2.0
"""The report of a trial: one HTML file that needs nothing else."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from plotly.graph_objects import Figure
from plotly.offline import get_plotlyjs
from towtank_bag.reader import Bag
from towtank_node import topics
from towtank_node.names import CARRIAGE_JOINT, CRANK_JOINT, FISH
from towtank_node.stamps import stamp_ns
from towtank_rig import Rig

from towtank_compare import charts
from towtank_compare.compare import Analyses, Comparison, open_comparison
from towtank_compare.heave import NS_PER_MS
from towtank_compare.kinematics import bow_up_pitch
from towtank_compare.places import pressure_port
from towtank_compare.samples import SIMULATED, bag_samples, has_source, joint_series
from towtank_compare.series import Series
from towtank_compare.trial_result import assumption_rows, calibration_rows

SHAPES = 4
"""Instants of the side view, spread over one crank period."""

_POSITION = [f"pose.pose.position.{axis}" for axis in "xz"]
_TURN = [f"pose.pose.orientation.{axis}" for axis in "xyzw"]


def write_report(bag_path: str | Path, result: dict[str, Any], report_path: str | Path) -> None:
    """Write the report of the trial in a bag.

    result: as `trial_result` gives it. report_path must not exist (FileExistsError).
    """
    opened = open_comparison(bag_path)
    t0_ms, t1_ms = (round(1000 * t) for t in result["window"])
    html = report_html(opened, opened.analyse(t0_ms, t1_ms), result, t0_ms, t1_ms)
    with Path(report_path).open("x", encoding="utf-8") as file:
        file.write(html)


def report_html(
    opened: Comparison, analyses: Analyses, result: dict[str, Any], t0_ms: int, t1_ms: int
) -> str:
    """The report as text."""
    bag, rig = opened.bag, opened.rig
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("towtank_compare"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    measured = analyses.results["measured"]
    return environment.get_template("report.html.j2").render(
        rig=rig,
        result=result,
        measured=measured,
        twin=analyses.results["twin"],
        plant=analyses.results.get("plant"),
        budgets=_budgets(measured),
        place=pressure_port(rig),
        start=datetime.datetime.fromtimestamp(t0_ms / 1000, datetime.UTC),
        calibrations=calibration_rows(rig),
        assumptions=assumption_rows(rig),
        charts={
            name: _chart_html(name, figure)
            for name, figure in _figures(bag, rig, analyses, t0_ms, t1_ms).items()
        },
        plotly_js=get_plotlyjs(),
    )


def _figures(bag: Bag, rig: Rig, analyses: Analyses, t0_ms: int, t1_ms: int) -> dict[str, Figure]:
    t0_ns, t1_ns = t0_ms * NS_PER_MS, t1_ms * NS_PER_MS
    heaves: dict[str, dict[str, Series]] = {"depressor": {}, "fish": {}}
    for source in ("measured", *SIMULATED):
        if has_source(bag, source):
            samples = bag_samples(bag, rig, source)
            heaves["depressor"][source] = samples.depressor.between(t0_ns, t1_ns)
            heaves["fish"][source] = samples.fish.between(t0_ns, t1_ns)
    crank_hz = next((r.crank_frequency_hz for r in analyses.results.values() if r), None)
    drive = [
        joint_series(bag, topics.MEASURED_JOINTS.name, joint, "velocity").between(t0_ns, t1_ns)
        for joint in (CRANK_JOINT, CARRIAGE_JOINT)
    ]
    figures = {
        "heave": charts.heave_chart(heaves, t0_ns),
        "pitch": charts.pitch_chart(_pitches(bag, t0_ns, t1_ns), t0_ns),
        "drive": charts.drive_chart(*drive, t0_ns),
        "spectra": charts.spectrum_chart(heaves, crank_hz),
    }
    shapes = tow_shapes(bag, rig, t0_ns, t1_ns, crank_hz)
    if shapes:
        figures["shape"] = charts.shape_chart(shapes)
    return figures


def _pitches(bag: Bag, t0_ns: int, t1_ns: int) -> dict[str, Series]:
    """Bow-up pitch by source, rad."""
    pitches = {}
    measured = bag.series(topics.INCLINATION.name, ["pitch", "valid"])
    valid = measured["valid"].astype(bool)
    pitches["measured"] = Series.of(measured["stamp_ns"][valid], -measured["pitch"][valid])
    for source in SIMULATED:
        poses = bag.series(topics.ODOMETRY.within(source, FISH).name, _TURN)
        quaternion = np.column_stack([poses[name] for name in _TURN])
        pitches[source] = Series.of(poses["stamp_ns"], bow_up_pitch(quaternion))
    return {source: pitch.between(t0_ns, t1_ns) for source, pitch in pitches.items()}


def tow_shapes(
    bag: Bag, rig: Rig, t0_ns: int, t1_ns: int, crank_hz: float | None
) -> list[charts.TowShape]:
    """Side views of the twin's tow at SHAPES instants of one crank period (or of one second)."""
    states = {
        message_ns: message
        for _, message in bag.messages(topics.TWIN_CABLES.name)
        if t0_ns <= (message_ns := stamp_ns(message.header.stamp)) <= t1_ns
    }
    if not states:
        return []
    stamps = np.array(sorted(states))
    poses = bag.series(topics.TWIN_FISH.name, [*_POSITION, *_TURN])
    period_ns = 1e9 / crank_hz if crank_hz else 1e9
    shapes = []
    for step in range(SHAPES):
        wanted = stamps[0] + step * period_ns / SHAPES
        stamp = int(stamps[np.argmin(np.abs(stamps - wanted))])
        tow_point_x = states[stamp].x[0]
        lines = cable_lines(states[stamp])
        parts = [*lines.values(), *_hull(poses, stamp, rig.fish.length.value)]
        label = f"{(stamp - t0_ns) * 1e-9:.2f} s"
        shapes.append(charts.TowShape(label, [(x - tow_point_x, z) for x, z in parts]))
    return shapes


def _hull(
    poses: dict[str, np.ndarray], stamp: int, length: float
) -> list[tuple[np.ndarray, np.ndarray]]:
    """x and z of tail and nose at the pose nearest to an instant; none without poses."""
    if not len(poses["stamp_ns"]):
        return []
    nearest = np.argmin(np.abs(poses["stamp_ns"] - stamp))
    x, z, qx, qy, qz, qw = (poses[name][nearest] for name in (*_POSITION, *_TURN))
    ends = np.array([-length / 2, length / 2])
    return [(x + ends * (1 - 2 * (qy**2 + qz**2)), z + ends * 2 * (qx * qz - qw * qy))]


def cable_lines(state: Any) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """x and z of the nodes of each line of a CableState, m."""
    lines, start = {}, 0
    for name, segments in zip(state.line_names, state.segment_counts, strict=True):
        nodes = slice(start, start + int(segments) + 1)
        lines[name] = (np.asarray(state.x)[nodes], np.asarray(state.z)[nodes])
        start = nodes.stop
    return lines


def _budgets(measured: Any) -> dict[str, list[dict[str, object]]]:
    """Rows of the uncertainty budget by body; none without a measured result."""
    if measured is None:
        return {}
    return {
        "Fish": measured.budget.fish.rows(),
        "Depressor": measured.budget.depressor.rows(),
    }


def _chart_html(name: str, figure: Figure) -> str:
    return figure.to_html(
        full_html=False,
        include_plotlyjs=False,
        div_id=f"chart-{name}",
        config={"responsive": True, "displaylogo": False},
    )
