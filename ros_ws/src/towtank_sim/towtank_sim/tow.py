# SPDX-License-Identifier: Apache-2.0
"""The simulated tow behind a tow point that is given a step at a time."""

from __future__ import annotations

from typing import NamedTuple

from towtank_rig import Rig

import sim_core as sc
from towtank_sim.axes import Quaternion, Vector, cross, to_body
from towtank_sim.model import LINES, build_model, segment_counts

# Spectral radius at infinite frequency of the generalised-α scheme (Chung & Hulbert 1993): damps
# the axial waves that a step does not resolve and leaves the heave alone.
_RHO_INFINITY = 0.8


class PointState(NamedTuple):
    """A point in tank axes: m, m/s."""

    position: Vector
    velocity: Vector


class BodyState(NamedTuple):
    """A body: its origin in tank axes, its rotation in its own axes.

    quaternion is (w, x, y, z), body → tank; accelerations in m/s², rad/s².
    """

    position: Vector
    quaternion: Quaternion
    velocity: Vector
    acceleration: Vector
    angular_velocity: Vector
    angular_acceleration: Vector

    @property
    def velocity_in_body(self) -> Vector:
        """Velocity of the origin in body axes, m/s."""
        return to_body(self.quaternion, self.velocity)


class LineShapes(NamedTuple):
    """All lines one after another: nodes (m, tank axes) and tension of the segments (N)."""

    names: tuple[str, ...]
    segments: tuple[int, ...]
    x: list[float]
    y: list[float]
    z: list[float]
    tension: list[float]


class Tow:
    """Lines, depressor and fish of one rig, stepped along with the tow point.

    segments: of all lines together, see `towtank_sim.model.segment_counts`; step: longest time
    step, s.
    Errors of sim_core (InvalidInput, ConvergenceError) name the place and the time.
    """

    def __init__(self, rig: Rig, segments: int, step: float) -> None:
        self._model = build_model(rig, segments)
        self._step = step
        self._segments = tuple(segment_counts(rig, segments).values())
        self._simulation: sc.Simulator | None = None

    def start(self, position: Vector, velocity: Vector) -> None:
        """Begin anew at time 0 with a steady tow: at rest, or at constant `velocity` (m/s)."""
        state = sc.steady_tow(self._model, position=position, velocity=velocity)
        self._simulation = sc.Simulator(
            self._model,
            state,
            integrator=sc.GeneralizedAlpha(rho_inf=_RHO_INFINITY),
            max_step=self._step,
        )

    @property
    def time(self) -> float:
        """Time since `start`, s."""
        return self._running.time

    def step_to(self, time: float, position: Vector, velocity: Vector) -> None:
        """Step to `time` (s), when the tow point is at `position` (m) with `velocity` (m/s).

        Between here and there the tow point follows the cubic through both.
        """
        self._running.step_to(time, position, velocity)

    def fish(self) -> BodyState:
        simulation = self._running
        return BodyState(
            tuple(simulation.body_position("fish").tolist()),
            tuple(simulation.body_quaternion("fish").tolist()),
            tuple(simulation.body_velocity("fish").tolist()),
            tuple(simulation.body_acceleration("fish").tolist()),
            tuple(simulation.body_angular_velocity("fish").tolist()),
            tuple(simulation.body_angular_acceleration("fish").tolist()),
        )

    def depressor(self) -> PointState:
        simulation = self._running
        return PointState(
            tuple(simulation.point_position("depressor").tolist()),
            tuple(simulation.point_velocity("depressor").tolist()),
        )

    def line_shapes(self) -> LineShapes:
        x: list[float] = []
        y: list[float] = []
        z: list[float] = []
        tension: list[float] = []
        for name in LINES:
            nodes = self._running.node_positions(name)  # (segments + 1, 3)
            for values, column in zip((x, y, z), nodes.T, strict=True):
                values.extend(column.tolist())
            tension.extend(self._running.tensions(name).tolist())
        return LineShapes(LINES, self._segments, x, y, z, tension)

    def top_tension(self) -> float:
        """Tension of the primary line at the tow point, N."""
        return float(self._running.end_tensions("primary")[0])

    @property
    def _running(self) -> sc.Simulator:
        if self._simulation is None:
            raise RuntimeError("the tow has not been started: call start() first")
        return self._simulation


def specific_force(state: BodyState, position: Vector, gravity: float) -> Vector:
    """Return what an ideal accelerometer at `position` (m, body axes) feels, m/s², body axes.

    f = Rᵀ(a + g ẑ) + α × r + ω × (ω × r), the acceleration of the place less that of gravity.
    """
    ax, ay, az = state.acceleration
    fx, fy, fz = to_body(state.quaternion, (ax, ay, az + gravity))
    omega = state.angular_velocity
    tx, ty, tz = cross(state.angular_acceleration, position)
    cx, cy, cz = cross(omega, cross(omega, position))
    return (fx + tx + cx, fy + ty + cy, fz + tz + cz)
