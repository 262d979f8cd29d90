# SPDX-License-Identifier: Apache-2.0
"""Pictures of a tow: its shape at an instant, an animation, and the loads in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from sim_core.body_surface import body_surface, placed
from sim_core.dataset import arc_lengths
from sim_core.extras import needed
from sim_core.system import System

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

    from sim_core.result import Result

View = Literal["side", "top", "front"]
_AXES = {"side": (0, 2), "top": (0, 1), "front": (1, 2)}
_SIZE = (9.0, 5.0)  # inches
_SHAPE = 1.7  # width over height of the axes beside the colour bar
_MARGIN = 0.08  # of the tow's extent, left free around it


def plot_shape(
    result: Result, time: float | None = None, *, view: View = "side", ax: Axes | None = None
) -> Axes:
    """Plot the tow's shape at the sample nearest to ``time`` (s; the last one by default).

    Lines are coloured by tension (N), bodies drawn to scale; both axes are in m and equal.
    view: from the side (x, z), the top (x, y) or the front (y, z); ax: matplotlib's, by default
    that of a new figure. Raises ValueError for a time outside the run. Needs the extra ``plots``.
    """
    sample = len(result.time) - 1 if time is None else _sample(result, time)
    picture = _Picture(result, view, _new_axes() if ax is None else ax, [sample])
    picture.show(sample)
    return picture.ax


def animate(
    result: Result,
    path: str | Path | None = None,
    *,
    view: View = "side",
    speed: float = 1.0,
    frame_rate: int = 15,
) -> FuncAnimation:
    """Animate the tow, seen along with its tow point, and save it if a path is given.

    path: a new file, .gif or .html. speed: of the animation against the tow's; frame_rate: 1/s.
    In a notebook ``animate(result).to_jshtml()`` shows it. Raises FileExistsError, and ValueError
    for a file of another kind. Needs the extra ``plots``.
    """
    animation = needed("matplotlib.animation", "plots")
    pyplot = needed("matplotlib.pyplot", "plots")
    if not (speed > 0.0 and frame_rate > 0.0):
        raise ValueError("speed and frame_rate must be positive")
    target = None if path is None else Path(path)
    if target is not None and target.suffix not in (".gif", ".html"):
        raise ValueError(f"{target}: an animation is saved as .gif or .html")
    if target is not None:
        with target.open("xb"):  # FileExistsError if it is there: data are not overwritten
            pass
    times = np.arange(result.time[0], result.time[-1] + 1e-9, speed / frame_rate)
    samples = np.unique(np.searchsorted(result.time, times - 1e-9)).tolist()
    picture = _Picture(result, view, _new_axes(), samples)
    picture.show(samples[0])
    figure = picture.ax.figure
    figure.canvas.draw()
    figure.set(layout_engine="none")  # stays as it is now, which saves much of a frame's time
    film: FuncAnimation = animation.FuncAnimation(
        figure, picture.show, samples, interval=1000.0 / frame_rate, cache_frame_data=False
    )
    if target is not None:
        if target.suffix == ".gif":
            film.save(target, writer=animation.PillowWriter(fps=frame_rate))
        else:
            target.write_text(film.to_jshtml(fps=frame_rate), encoding="utf-8")
        pyplot.close(figure)
    return film


def plot_loads(result: Result, *, ax: Axes | None = None) -> Axes:
    """Plot over time the hook load of each prescribed point and the tension at its lines' ends.

    Hook loads (N) by component in tank axes; ax: matplotlib's, by default that of a new figure.
    Needs the extra ``plots``.
    """
    ax = _new_axes() if ax is None else ax
    described = System.of(result.model).lines
    for name, point in result.points.items():
        if point.hook_load is None:
            continue
        for axis, style in zip(range(3), (":", "--", "-"), strict=True):
            label = f"{name} {'xyz'[axis]}"
            ax.plot(result.time, point.hook_load[:, axis], style, label=label)
        for line, history in result.lines.items():
            for end in ("start", "end"):
                if getattr(described[line], end) == name:
                    tension = getattr(history, f"{end}_tension")
                    ax.plot(result.time, tension, linewidth=2.5, alpha=0.6, label=f"{line}, {end}")
    ax.set(xlabel="time (s)", ylabel="force (N)")
    ax.grid(alpha=0.25)
    ax.legend()
    return ax


def plot_bending(
    result: Result, line: str, time: float | None = None, *, ax: Axes | None = None
) -> tuple[Axes, Axes]:
    """Plot bending moment and curvature along a line at the sample nearest to ``time`` (s).

    By default the last one; a thin line is the largest moment in the run. Returns the axes of the
    moment (N m) and, to their right, of the curvature (1/m), over the unstretched length from the
    line's start (m). Raises ValueError for a limp line or a time outside the run. Needs the extra
    ``plots``.
    """
    history = result.lines[line]
    if history.bending_moments is None or history.curvatures is None:
        raise ValueError(f"line '{line}' has no bending stiffness")
    sample = len(result.time) - 1 if time is None else _sample(result, time)
    ax = _new_axes() if ax is None else ax
    along = arc_lengths(System.of(result.model).lines[line])
    ax.plot(along, history.bending_moments[sample], label="bending moment")
    ax.plot(along, history.bending_moments.max(axis=0), "C0", linewidth=0.8, label="largest")
    ax.set(xlabel=f"length from the start of {line} (m)", ylabel="bending moment (N m)")
    ax.set_title(f"t = {result.time[sample]:.2f} s")
    ax.grid(alpha=0.25)
    right: Axes = ax.twinx()
    right.plot(along, history.curvatures[sample], "C1--", label="curvature")
    right.set_ylabel("curvature (1/m)")
    ax.legend(handles=[*ax.get_lines(), *right.get_lines()])
    return ax, right


def _new_axes() -> Axes:
    pyplot = needed("matplotlib.pyplot", "plots")
    axes: Axes = pyplot.subplots(figsize=_SIZE, layout="constrained")[1]
    return axes


def _sample(result: Result, time: float) -> int:
    if not result.time[0] <= time <= result.time[-1]:
        raise ValueError(
            f"time {time:g} s is outside the run, {result.time[0]:g} to {result.time[-1]:g} s"
        )
    return int(np.argmin(np.abs(result.time - time)))


class _Picture:
    """The tow on a pair of axes, drawn once and moved from sample to sample."""

    def __init__(self, result: Result, view: View, ax: Axes, samples: list[int]) -> None:
        """samples: those that will be shown, for limits and the scale of the tension."""
        collections = needed("matplotlib.collections", "plots")
        self.ax = ax
        self._result = result
        self._across, self._up = _AXES[view]
        self._surfaces = {name: body_surface(result.model._body(name)) for name in result.bodies}
        self._set_up_axes(samples)
        tension = np.concatenate([line.tensions[samples].ravel() for line in result.lines.values()])
        self._lines = collections.LineCollection([], linewidths=2.5, cmap="viridis", zorder=3)
        self._lines.set_clim(tension.min(), max(tension.max(), tension.min() + 1e-9))
        ax.add_collection(self._lines, autolim=False)
        ax.figure.colorbar(self._lines, ax=ax, label="tension (N)", shrink=0.85)
        self._hulls = collections.PolyCollection(
            [], facecolors="#5b6770", edgecolors="face", linewidths=0.8, zorder=4
        )
        ax.add_collection(self._hulls, autolim=False)
        (self._points,) = ax.plot([], [], "o", color="#303030", markersize=5, zorder=5)
        self._labels = {
            name: ax.annotate(
                name, (0.0, 0.0), xytext=(7, 5), textcoords="offset points", fontsize=9, zorder=6
            )
            for name in (*result.points, *result.bodies)
        }

    def show(self, sample: int) -> None:
        """Move everything to where it is at a sample."""
        result, ax = self._result, self.ax
        self._lines.set_segments(
            [
                segment
                for line in result.lines.values()
                for segment in _segments(self._seen(line.node_positions[sample]))
            ]
        )
        self._lines.set_array(
            np.concatenate([line.tensions[sample] for line in result.lines.values()])
        )
        self._hulls.set_verts(
            [
                self._seen(placed(corners, body.position[sample], body.quaternion[sample]))[quad]
                for name, body in result.bodies.items()
                for corners, quads in (self._surfaces[name],)
                for quad in quads
            ]
        )
        positions = {name: point.position for name, point in result.points.items()}
        points = np.array([self._seen(p[sample]) for p in positions.values()])
        self._points.set_data(points[:, 0], points[:, 1])
        positions |= {name: body.position for name, body in result.bodies.items()}
        for name, label in self._labels.items():
            label.xy = tuple(self._seen(positions[name][sample]))
        ax.set_title(f"t = {result.time[sample]:.2f} s")
        low, high = self._box + self._reference[sample]
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(low[1], high[1])

    def _seen(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """(..., 2) m of the two axes that the view shows."""
        return places[..., (self._across, self._up)]

    def _set_up_axes(self, samples: list[int]) -> None:
        """Find the box that holds the tow in all samples, relative to the tow point."""
        result, ax = self._result, self.ax
        tow_point = result.points[result.model.prescribed_points[0]]
        self._reference = self._seen(tow_point.position).copy()
        if self._up == 2:
            self._reference[:, 1] = 0.0  # heights stay: the surface does
        reference = self._reference[samples][:, None, :]
        places = [self._seen(line.node_positions[samples]) for line in result.lines.values()]
        for name, body in result.bodies.items():
            half = 0.5 * result.model._body(name).length
            middle = self._seen(body.position[samples])[:, None, :]
            places += [middle - half, middle + half]
        relative = np.concatenate([(p - reference).reshape(-1, 2) for p in places])
        low, high = relative.min(axis=0), relative.max(axis=0)
        if self._up == 2 and low[1] - (high[1] - low[1]) < 0.0 < high[1] + (high - low).max():
            low[1], high[1] = min(low[1], 0.0), max(high[1], 0.0)  # the surface is near: show it
        margin = _MARGIN * (high - low).max()
        size = high - low + 2.0 * margin
        size = np.maximum(size, [_SHAPE * size[1], size[0] / _SHAPE])  # fill the axes
        middle = 0.5 * (low + high)
        self._box: NDArray[np.float64] = np.array([middle - 0.5 * size, middle + 0.5 * size])
        ax.set_aspect("equal")
        ax.set_xlabel(f"{'xyz'[self._across]} (m)")
        ax.set_ylabel(f"{'xyz'[self._up]} (m)")
        ax.grid(alpha=0.25)
        if self._up == 2:
            ax.axhspan(min(self._box[0, 1], 0.0), 0.0, color="#d9ecf7", zorder=0)
            ax.axhline(0.0, color="#2a7fb8", linewidth=1.2, zorder=1)
            ax.annotate(
                "still water",
                (0.01, 0.0),
                xycoords=ax.get_yaxis_transform(),
                xytext=(0, 3),
                textcoords="offset points",
                fontsize=8,
                color="#2a7fb8",
            )


def _segments(nodes: NDArray[np.float64]) -> Any:
    """(n − 1, 2, 2): the straight segments between n nodes."""
    return np.stack([nodes[:-1], nodes[1:]], axis=1)
