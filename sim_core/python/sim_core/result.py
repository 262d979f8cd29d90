# SPDX-License-Identifier: Apache-2.0
"""What a run leaves: numpy arrays over time, by the names of the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Contact, InvalidInput, Model, State

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

_GOOD_PEAK = 0.05  # of a peak tension, that needs no warning


@dataclass(frozen=True)
class PointHistory:
    """Motion of a point in tank axes."""

    position: Array  #: (samples, 3) m
    velocity: Array  #: (samples, 3) m/s
    acceleration: Array  #: (samples, 3) m/s²
    #: (samples, 3) N, of a prescribed point: the pull of the lines on it, weight, drag and inertia
    #: of their outermost half segments included; None for a free point
    hook_load: Array | None = None


@dataclass(frozen=True)
class PlaceHistory:
    """Motion of a place on a body, where a sensor sits."""

    position: Array  #: (samples, 3) m, tank axes
    velocity: Array  #: (samples, 3) m/s, tank axes
    acceleration: Array  #: (samples, 3) m/s², tank axes
    #: (samples, 3) m/s², body axes: what an accelerometer there feels, acceleration minus gravity
    #: (g upwards at rest)
    specific_force: Array


@dataclass(frozen=True)
class BodyHistory:
    """Motion of a body: its origin in tank axes, its rotation in body axes."""

    position: Array  #: (samples, 3) m
    quaternion: Array  #: (samples, 4) w, x, y, z of body axes → tank axes
    velocity: Array  #: (samples, 3) m/s
    angular_velocity: Array  #: (samples, 3) rad/s, body axes
    acceleration: Array  #: (samples, 3) m/s²
    angular_acceleration: Array  #: (samples, 3) rad/s², body axes
    #: (3,) m in body axes, by name: the places of the body's description
    places: Mapping[str, Array] = field(default_factory=dict)
    gravity: float = 9.81  #: m/s²

    @property
    def yaw_pitch_roll(self) -> Array:
        """(samples, 3) rad: turns about z, then y, then x of the turned axes.

        Right-handed about x forward, y to port, z up: positive pitch is nose down, positive roll
        port side up, positive yaw nose to port.
        """
        w, x, y, z = self.quaternion.T
        yaw = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        return np.column_stack([yaw, pitch, roll])

    def position_of(self, place: str | tuple[float, float, float]) -> Array:
        """(samples, 3) m in tank axes of a place: its name, or where it is in body axes (m)."""
        place_in_tank: Array = self.position + _turned(self.quaternion, self._arm(place))
        return place_in_tank

    def at(self, place: str | tuple[float, float, float]) -> PlaceHistory:
        """The motion of a place: its name in the body's description, or (3,) m in body axes."""
        arm = self._arm(place)
        omega, q = self.angular_velocity, self.quaternion
        spin = np.cross(omega, arm)
        turning = np.cross(self.angular_acceleration, arm) + np.cross(omega, spin)
        acceleration = self.acceleration + _turned(q, turning)
        felt = acceleration + np.array([0.0, 0.0, self.gravity])
        return PlaceHistory(
            position=self.position + _turned(q, arm),
            velocity=self.velocity + _turned(q, spin),
            acceleration=acceleration,
            specific_force=_turned(q * np.array([1.0, -1.0, -1.0, -1.0]), felt),
        )

    def _arm(self, place: str | tuple[float, float, float]) -> Array:
        if not isinstance(place, str):
            return np.asarray(place, dtype=float)
        if place not in self.places:
            known = ", ".join(f"'{name}'" for name in self.places) or "none"
            raise InvalidInput(f"no place '{place}' on the body; there are: {known}")
        return np.asarray(self.places[place], dtype=float)


def _turned(quaternion: Array, vector: Array) -> Array:
    """(samples, 3): vectors turned by unit quaternions, q v q*."""
    w, u = quaternion[:, :1], quaternion[:, 1:]
    cross = np.cross(u, vector)
    turned: Array = vector + 2.0 * (w * cross + np.cross(u, cross))
    return turned


@dataclass(frozen=True)
class LineHistory:
    """Shape and loads of a line, from its start to its end."""

    node_positions: Array  #: (samples, segments + 1, 3) m, tank axes
    node_velocities: Array  #: (samples, segments + 1, 3) m/s, tank axes
    #: (samples, segments) N, in the middle of each; on a drum that of the segment that leaves it
    tensions: Array
    #: (samples,) N, effective tension at the very start and end: with the loads on the outer
    #: halves of the segments there, which the tensions of these segments lack
    start_tension: Array
    end_tension: Array
    peak_tensions: Array  #: (segments,) N, the largest of all steps, also between the samples
    #: (samples, segments + 1) N·m and 1/m at the nodes; None for a limp line
    bending_moments: Array | None = None
    curvatures: Array | None = None
    paid_out: Array | None = None  #: (samples,) m, unstretched, of a line on a winch


@dataclass(frozen=True)
class Snap:
    """A line that went taut or slack with a jump of tension, and how well the steps resolve it."""

    line: str
    time: float  #: s
    steps_per_period: float  #: of the ends of the segment that snapped against one another
    impact: bool  #: not resolved, but taken as an inelastic impact (implicit Euler)

    @property
    def peak_error(self) -> float:
        """Bound of how far the peak may be off that a mass on this segment reaches, as a share.

        10/n² for n steps per period with the integrators of second order (theory.md, Snaps); 1 for
        an inelastic impact, which has no rebound and no bound.
        """
        return 1.0 if self.impact else min(1.0, 10.0 / self.steps_per_period**2)


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
    rejections: int  #: steps repeated because their error was above a tolerance
    snaps: int  #: steps in which a line snapped taut or slack
    impacts: int  #: those of them that no step resolved: inelastic impacts
    least_resolved_snap: Snap | None  #: an impact if there was one
    energy: Mapping[str, Array]  #: (samples,) J of each form of EnergyBalance, if asked for
    momentum: Mapping[str, Array]  #: (samples, 3) N·s of each form of MomentumBalance, if asked for
    events: tuple[Contact, ...]  #: what touched the tank, in order of time; the first 1000

    @property
    def model(self) -> Model:
        """The model that was run."""
        return self.final_state.model

    @property
    def warnings(self) -> tuple[str, ...]:
        """What in the run is not resolved, in words: peak tensions at snaps."""
        snap = self.least_resolved_snap
        if snap is None or snap.peak_error <= _GOOD_PEAK:
            return ()
        if snap.impact:
            what = f"so that {self.impacts} of {self.snaps} snaps were taken as inelastic impacts"
            what += ", whose peak tensions are not resolved"
        else:
            what = f"peak tensions may be off by {100 * snap.peak_error:.0f} %"
        return (
            f"line '{snap.line}' snapped at t = {snap.time:.4g} s with {snap.steps_per_period:.2g} "
            f"steps in a period of its segment, {what}; give error_tolerance or a smaller max_step",
        )

    def to_xarray(self) -> xarray.Dataset:
        """The histories as a dataset with named coordinates, units and long names (CF).

        Points and bodies are stacked along dimensions of their names; a line has variables of its
        own, as ``tension_NAME``, ``start_tension_NAME`` and ``node_positions_NAME``. Needs the
        extra ``files``.
        """
        from sim_core.dataset import to_dataset

        return to_dataset(self)

    def to_netcdf(self, path: str | Path) -> None:
        """Write what :meth:`to_xarray` gives to a new NetCDF-4 file.

        Raises FileExistsError: data are not overwritten. Needs the extra ``files``.
        """
        from sim_core.dataset import write_netcdf

        write_netcdf(self, Path(path))

    def to_vtk(self, directory: str | Path, *, every: int = 1) -> Path:
        """Write each, or every n-th, sample as VTK files; return the ``tow.pvd`` that lists them.

        ParaView opens it as a time series of blocks: ``lines`` (a cell for each segment, with its
        tension), ``points``, ``bodies`` (the hulls and fins as surfaces).
        Raises FileExistsError unless the directory is new or empty. Needs the extra ``files``.
        """
        from sim_core.vtk_series import write_vtk

        return write_vtk(self, Path(directory), every)


def histories(
    model: Model, arrays: Mapping[str, Array], peaks: Mapping[str, Array]
) -> tuple[dict[str, PointHistory], dict[str, BodyHistory], dict[str, LineHistory]]:
    """Names the columns of a raw recording; ``peaks`` are the peak tensions of each line."""
    position, velocity, acceleration = (
        arrays["position"],
        arrays["velocity"],
        arrays["acceleration"],
    )
    points = {}
    for name in model.points:
        site = model._point_site(name)
        prescribed = model._prescribed_index(name)
        points[name] = PointHistory(
            position=position[:, site],
            velocity=velocity[:, site],
            acceleration=acceleration[:, site],
            hook_load=arrays["hook_load"][:, prescribed] if prescribed >= 0 else None,
        )
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
            places=model._body_places(name),
            gravity=model.water.gravity,
        )
    lines = {}
    for name in model.lines:
        first, last = model._line_segments(name)
        sites = model._line_sites(name)
        winch = model._line_winch(name)
        ends = arrays["end_tension"][:, model._line_index(name)]
        bent = model._line_bent_nodes(name)
        lines[name] = LineHistory(
            node_positions=position[:, sites],
            node_velocities=velocity[:, sites],
            tensions=arrays["tension"][:, first:last],
            start_tension=ends[:, 0],
            end_tension=ends[:, 1],
            bending_moments=None if bent is None else arrays["bending_moment"][:, slice(*bent)],
            curvatures=None if bent is None else arrays["curvature"][:, slice(*bent)],
            peak_tensions=peaks[name],
            paid_out=arrays["paid_out"][:, winch] if winch >= 0 else None,
        )
    return points, bodies, lines
