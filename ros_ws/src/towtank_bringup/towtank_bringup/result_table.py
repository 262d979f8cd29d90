# SPDX-License-Identifier: Apache-2.0
"""A trial's result as a table in the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table


def print_result(result: dict[str, Any], directory: Path | None = None) -> None:
    """Print heave amplitudes, ratio and phase, measured and simulated, with uncertainty (95 %)."""
    console = Console(markup=False)  # brackets may stand in paths and names
    table = Table(title=f"{result['rig']}: heave at the crank frequency")
    for heading in ("", "measured", "twin"):
        table.add_column(heading, justify="left" if not heading else "right")
    for place, amplitude in result["amplitude_m"].items():
        table.add_row(
            f"{place} amplitude, mm",
            _with_u95(amplitude["measured"], amplitude["u95"], scale=1e3, digits=2),
            _number(amplitude["twin"], scale=1e3, digits=2),
        )
    ratio = result["heave_ratio"]
    measured, twin = ratio["measured"], ratio["twin"]
    table.add_row(
        "heave ratio",
        _with_u95(measured["value"], measured.get("u95"), digits=4),
        _number(twin["value"]),
    )
    table.add_row(
        "phase, degrees",
        _number(measured["phase_deg"], digits=1),
        _number(twin["phase_deg"], digits=1),
    )
    console.print(table)
    for source, reason in result["reasons"].items():
        console.print(f"no heave ratio for {source}: {reason}", soft_wrap=True)
    if result["bag_problem"]:
        console.print(f"warning: {result['bag_problem']}", soft_wrap=True)
    for note in result["bag_notes"]:
        console.print(f"note: {note}", soft_wrap=True)
    scans = result["scans"]
    console.print(
        f"scans: {scans['scheduled']} scheduled, {scans['received']} received, "
        f"{scans['lost']} lost, {scans['bad']} bad"
    )
    for node, count in result["restarts"].items():
        console.print(f"warning: {node} had ended and was started again, {count} time(s)")
    for stranger in result["strangers"]:
        console.print(
            f"warning: {stranger['node']}, which was none of this trial's nodes, published "
            f"{stranger['topic']} too: what it sent was left out",
            soft_wrap=True,
        )
    for lost_s in result.get("encoder", {}).get("reference_lost_s", ()):
        console.print(
            f"warning: the board was reset: from {lost_s - result['window'][0]:.2f} s after the "
            "log's start on, the positions of crank and carriage are not known until zeroed again",
            soft_wrap=True,
        )
    for line in _health_warnings(result["sensor_health"]):
        console.print(line)
    if directory:
        console.print(f"report: {directory / 'report.html'}", soft_wrap=True)


def _health_warnings(health: dict[str, dict[str, int] | None]) -> list[str]:
    return [
        f"warning: {sensor}: {flag} in {count} of {counts['samples']} samples"
        for sensor, counts in health.items()
        if counts
        for flag, count in counts.items()
        if flag != "samples" and count
    ]


def _number(value: float | None, scale: float = 1.0, digits: int = 4) -> str:
    return "-" if value is None else f"{value * scale:.{digits}f}"


def _with_u95(value: float | None, u95: float | None, scale: float = 1.0, digits: int = 4) -> str:
    if value is None or u95 is None:
        return _number(value, scale, digits)
    return f"{_number(value, scale, digits)} ± {_number(u95, scale, digits)}"
