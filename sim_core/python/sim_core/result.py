# SPDX-License-Identifier: Apache-2.0
"""What a run leaves: numpy arrays over time, by the names of the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Model, State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PointHistory:
    """Motion of a point in tank axes."""

    position: Array  #: (samples, 3) m
    velocity: Array  #: (samples, 3) m/s
    acceleration: Array  #: (samples, 3) m/s²


@dataclass(frozen=True)
class BodyHistory:
    """Motion of a body: its origin in tank axes, its rotation in body axes."""

    position: Array  #: (samples, 3) m
    quaternion: Array  #: (samples, 4) w, x, y, z of body axes → tank axes
    velocity: Array  #: (samples, 3) m/s
    angular_velocity: Array  #: (samples, 3) rad/s, body axes
    acceleration: Array  #: (samples, 3) m/s²
    angular_acceleration: Array  #: (samples, 3) rad/s², body axes

    def position_of(self, place: tuple[float, float, float]) -> Array:
        """(samples, 3) m in tank axes of a place given in body axes (m)."""
        w, vector = self.quaternion[:, :1], self.quaternion[:, 1:]
        arm = np.asarray(place, dtype=float)
        # q v q*, written out: v + 2 w (u × v) + 2 u × (u × v)
        cross = np.cross(vector, arm)
        place_in_tank: Array = self.position + arm + 2.0 * (w * cross + np.cross(vector, cross))
        return place_in_tank


@dataclass(frozen=True)
class LineHistory:
    """Shape and tension of a line, from its start to its end."""

    node_positions: Array  #: (samples, segments + 1, 3) m, tank axes
    tensions: Array  #: (samples, segments) N

    @property
    def start_tension(self) -> Array:
        """(samples,) N, of the first segment."""
        return self.tensions[:, 0]

    @property
    def end_tension(self) -> Array:
        """(samples,) N, of the last segment."""
        return self.tensions[:, -1]


@dataclass(frozen=True)
class Result:
    """A recorded run."""

    time: Array  #: (samples,) s
    points: Mapping[str, PointHistory]
    bodies: Mapping[str, BodyHistory]
    lines: Mapping[str, LineHistory]
    final_state: State
    steps: int  #: accepted integrator steps
    newton_iterations: int
    halvings: int  #: steps repeated with half the size
    snaps: int  #: steps in which a line snapped taut or slack


def histories(
    model: Model, arrays: Mapping[str, Array]
) -> tuple[dict[str, PointHistory], dict[str, BodyHistory], dict[str, LineHistory]]:
    """Names the columns of a raw recording."""
    position, velocity, acceleration = (
        arrays["position"],
        arrays["velocity"],
        arrays["acceleration"],
    )
    points = {}
    for name in model.points:
        site = model._point_site(name)
        points[name] = PointHistory(position[:, site], velocity[:, site], acceleration[:, site])
    bodies = {}
    for name in model.bodies:
        translation = model._body_entry(name)
        rotation = translation + 1
        bodies[name] = BodyHistory(
            position=position[:, translation],
            quaternion=arrays["attitude"][:, model._body_index(name)],
            velocity=velocity[:, translation],
            angular_velocity=velocity[:, rotation],
            acceleration=acceleration[:, translation],
            angular_acceleration=acceleration[:, rotation],
        )
    lines = {}
    for name in model.lines:
        first, last = model._line_segments(name)
        lines[name] = LineHistory(
            position[:, model._line_sites(name)], arrays["tension"][:, first:last]
        )
    return points, bodies, lines
