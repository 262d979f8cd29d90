# SPDX-License-Identifier: Apache-2.0
"""Charts of a trial's report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from towtank_compare.series import Series

COLOURS = {"measured": "#1f5fa8", "twin": "#d9730d", "plant": "#6b6b6b"}
DASHES = {"measured": "solid", "twin": "solid", "plant": "dot"}
NAMES = {"measured": "measured", "twin": "twin", "plant": "plant (truth)"}
SPECTRUM_RATE_HZ = 50.0
SPECTRUM_LIMIT_HZ = 5.0
SEGMENT_S = 16.0
"""Length of a segment of the spectra: resolves a sixteenth of a hertz."""
GAP_S = 0.5
"""Where samples are further apart a line is broken, and a spectrum is that of the longest part."""


@dataclass(frozen=True)
class TowShape:
    """Side view of the tow at one instant. parts: x from the tow point and z, m, along each line
    and along the fish's hull."""

    label: str
    parts: list[tuple[np.ndarray, np.ndarray]]


def heave_chart(heaves: dict[str, dict[str, Series]], origin_ns: int) -> go.Figure:
    """Heave about its mean of depressor and fish, by body and source."""
    figure = make_subplots(
        rows=len(heaves), cols=1, shared_xaxes=True, vertical_spacing=0.08,
        subplot_titles=[body.capitalize() for body in heaves],
    )  # fmt: skip
    for row, sources in enumerate(heaves.values(), start=1):
        for source, heave in sources.items():
            if len(heave):
                values = 1e3 * (heave.values - heave.values.mean())
                _add_line(figure, source, heave.seconds_since(origin_ns), values, row)
        figure.update_yaxes(title_text="heave, mm", row=row, col=1)
    return _finish(figure, "time since the log's start, s", rows=len(heaves))


def pitch_chart(pitches: dict[str, Series], origin_ns: int) -> go.Figure:
    """Bow-up pitch of the fish by source; series in rad."""
    figure = make_subplots(rows=1, cols=1)
    for source, pitch in pitches.items():
        if len(pitch):
            _add_line(figure, source, pitch.seconds_since(origin_ns), np.degrees(pitch.values), 1)
    figure.update_yaxes(title_text="pitch, bow up, degrees")
    return _finish(figure, "time since the log's start, s", rows=1)


def drive_chart(crank_rate: Series, carriage_speed: Series, origin_ns: int) -> go.Figure:
    """Measured crank rate (rad/s) and carriage speed (m/s)."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    rpm = crank_rate.values * 60 / (2 * np.pi)
    _add_line(figure, "measured", crank_rate.seconds_since(origin_ns), rpm, 1)
    speed_time = carriage_speed.seconds_since(origin_ns)
    _add_line(figure, "measured", speed_time, carriage_speed.values, 2)
    figure.update_yaxes(title_text="crank, rpm", row=1, col=1)
    figure.update_yaxes(title_text="carriage, m/s", row=2, col=1)
    figure.update_layout(showlegend=False)
    return _finish(figure, "time since the log's start, s", rows=2)


def shape_chart(shapes: Sequence[TowShape]) -> go.Figure:
    """Side view of the simulated tow at some instants, to scale, with the waterline."""
    figure = make_subplots(rows=1, cols=1)
    shades = [f"rgba(217,115,13,{alpha:.2f})" for alpha in np.linspace(0.35, 1.0, len(shapes))]
    for shape, shade in zip(shapes, shades, strict=True):
        x = np.concatenate([np.append(part[0], np.nan) for part in shape.parts])
        z = np.concatenate([np.append(part[1], np.nan) for part in shape.parts])
        figure.add_scatter(
            x=_short(x), y=_short(z), mode="lines", name=shape.label, line={"color": shade}
        )
    figure.add_hline(y=0, line={"color": "#3b8ea5", "dash": "dash"}, annotation_text="still water")
    figure.update_yaxes(title_text="z, m (up)", scaleanchor="x", scaleratio=1)
    return _finish(figure, "x from the tow point, m (forward)", rows=1)


def spectrum_chart(heaves: dict[str, dict[str, Series]], crank_hz: float | None) -> go.Figure:
    """Amplitude spectra of heave by body and source (Hann window, segments of SEGMENT_S)."""
    figure = make_subplots(
        rows=len(heaves), cols=1, shared_xaxes=True, vertical_spacing=0.08,
        subplot_titles=[body.capitalize() for body in heaves],
    )  # fmt: skip
    for row, sources in enumerate(heaves.values(), start=1):
        for source, heave in sources.items():
            if len(heave) > 1:
                _add_line(figure, source, *amplitude_spectrum(heave), row, broken=False)
        figure.update_yaxes(title_text="amplitude, mm", type="log", row=row, col=1)
    if crank_hz is not None:
        figure.add_vline(x=crank_hz, line={"color": "#999", "dash": "dot"})
    return _finish(figure, "frequency, Hz (dotted: the crank)", rows=len(heaves))


def amplitude_spectrum(heave: Series) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies in Hz and amplitudes in mm, between gaps; single lost samples are bridged by
    straight lines."""
    time = heave.seconds_since(int(heave.stamp_ns[0]))
    ends = np.concatenate(([0], _gaps(time), [len(time)]))
    longest = int(np.argmax(np.diff(ends)))
    part = slice(ends[longest], ends[longest + 1])
    even = np.arange(time[part][0], time[part][-1], 1 / SPECTRUM_RATE_HZ)
    if len(even) < 2:
        return np.empty(0), np.empty(0)
    values = np.interp(even, time[part], heave.values[part])
    segment = min(len(values), round(SEGMENT_S * SPECTRUM_RATE_HZ))
    # Here, because it takes longer to import than all else that a command needs to start
    from scipy import signal

    frequency, power = signal.welch(
        values, SPECTRUM_RATE_HZ, nperseg=segment, detrend="linear", scaling="spectrum"
    )
    shown = (frequency > 0) & (frequency <= SPECTRUM_LIMIT_HZ)
    return frequency[shown], 1e3 * np.sqrt(2 * power[shown])


def _add_line(
    figure: go.Figure, source: str, x: np.ndarray, y: np.ndarray, row: int, broken: bool = True
) -> None:
    """A line; of samples over time, one that is broken in their gaps."""
    if broken:
        breaks = _gaps(x)
        x, y = np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)
    figure.add_scatter(
        x=_short(x),
        y=_short(y),
        name=NAMES[source],
        legendgroup=source,
        showlegend=row == 1,
        mode="lines",
        line={"color": COLOURS[source], "dash": DASHES[source], "width": 1.5},
        row=row,
        col=1,
    )


def _gaps(time_s: np.ndarray) -> np.ndarray:
    """Where each part behind a gap begins."""
    return np.flatnonzero(np.diff(time_s) > GAP_S) + 1


def _short(values: np.ndarray) -> np.ndarray:
    """Four bytes a number: seven digits are more than a chart shows."""
    return np.asarray(values, dtype=np.float32)


def _finish(figure: go.Figure, x_title: str, rows: int) -> go.Figure:
    lowest = "x" if rows == 1 else f"x{rows}"
    figure.update_xaxes(title_text=x_title, selector={"anchor": lowest.replace("x", "y")})
    figure.update_layout(
        template="plotly_white",
        height=160 + 200 * rows,
        margin={"l": 60, "r": 10, "t": 40, "b": 50},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 1.0, "xanchor": "right"},
        font={"size": 13},
    )
    return figure
