# SPDX-License-Identifier: Apache-2.0
"""Results as xarray datasets and NetCDF files, after the CF conventions."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sim_core.extras import needed
from sim_core.system import Line, SectionedLine, System

if TYPE_CHECKING:
    import xarray

    from sim_core.result import Array, Result

# Values of points and bodies: units and what it is.
_POINT = {
    "position": ("m", "position"),
    "velocity": ("m s-1", "velocity"),
    "acceleration": ("m s-2", "acceleration"),
}
_BODY = {
    "position": ("m", "position of the origin"),
    "velocity": ("m s-1", "velocity of the origin"),
    "acceleration": ("m s-2", "acceleration of the origin"),
    "angular_velocity": ("rad s-1", "angular velocity in body axes"),
    "angular_acceleration": ("rad s-2", "angular acceleration in body axes"),
}
_NODE = {"positions": ("m", "positions"), "velocities": ("m s-1", "velocities")}
_BENDING = {
    "bending_moments": ("bending_moment", "N m", "bending moment"),
    "curvatures": ("curvature", "m-1", "curvature"),
}


def to_dataset(result: Result) -> xarray.Dataset:
    """See :meth:`Result.to_xarray`."""
    xr = needed("xarray", "files")
    variables: dict[str, object] = {}

    def add(name: str, dims: tuple[str, ...], values: Array, units: str, long_name: str) -> None:
        variables[name] = (dims, values, {"units": units, "long_name": long_name})

    coordinates: dict[str, object] = {
        "time": ("time", result.time, {"units": "s", "long_name": "time", "axis": "T"}),
        "axis": ("axis", ["x", "y", "z"], {"long_name": "axis of the frame of reference"}),
    }
    for kind, histories, quantities in (
        ("point", result.points, _POINT),
        ("body", result.bodies, _BODY),
    ):
        if not histories:
            continue
        coordinates[kind] = (kind, list(histories), {"long_name": f"name of the {kind}"})
        for quantity, (units, what) in quantities.items():
            values = _stacked([getattr(history, quantity) for history in histories.values()])
            add(f"{kind}_{quantity}", ("time", kind, "axis"), values, units, f"{kind}: {what}")
    loads = {
        name: point.hook_load
        for name, point in result.points.items()
        if point.hook_load is not None
    }
    if loads:
        long_name = "name of the prescribed point"
        coordinates["prescribed_point"] = (
            "prescribed_point",
            list(loads),
            {"long_name": long_name},
        )
        what = "prescribed point: pull of the lines on it"
        dims = ("time", "prescribed_point", "axis")
        add("hook_load", dims, _stacked(list(loads.values())), "N", what)
    if result.bodies:
        coordinates["component"] = (
            "component",
            ["w", "x", "y", "z"],
            {"long_name": "of a quaternion"},
        )
        values = _stacked([body.quaternion for body in result.bodies.values()])
        what = "body: attitude, unit quaternion body axes to tank axes"
        add("body_quaternion", ("time", "body", "component"), values, "1", what)
    described = System.of(result.model).lines
    for name, line in result.lines.items():
        node, segment = f"node_{name}", f"segment_{name}"
        for quantity, (units, what) in _NODE.items():
            values = getattr(line, f"node_{quantity}")
            label = f"node_{quantity}_{name}"
            add(label, ("time", node, "axis"), values, units, f"line {name}: {what} of its nodes")
        what = f"line {name}: unstretched length from its start"
        attributes = {"units": "m", "long_name": what}
        coordinates[f"arc_length_{name}"] = (node, arc_lengths(described[name]), attributes)
        what = f"line {name}: tension from its start to its end"
        add(f"tension_{name}", ("time", segment), line.tensions, "N", what)
        for end in ("start", "end"):
            what = f"line {name}: tension at its {end}"
            add(f"{end}_tension_{name}", ("time",), getattr(line, f"{end}_tension"), "N", what)
        for quantity, (label, units, what) in _BENDING.items():
            bending = getattr(line, quantity)
            if bending is not None:
                long_name = f"line {name}: {what} at its nodes"
                add(f"{label}_{name}", ("time", node), bending, units, long_name)
        what = f"line {name}: largest tension of all steps from its start to its end"
        add(f"peak_tension_{name}", (segment,), line.peak_tensions, "N", what)
    dataset: xarray.Dataset = xr.Dataset(
        variables,
        coordinates,
        {
            "Conventions": "CF-1.11",
            "title": "Simulated towed system",
            "source": f"sim_core {version('sim_core')}",
            "comment": "Tank axes: x along the run, z up, z = 0 at still water. "
            "Body axes: x forward, y to port, z up.",
            "steps": result.steps,
            "newton_iterations": result.newton_iterations,
            "halvings": result.halvings,
            "snaps": result.snaps,
            "impacts": result.impacts,
        },
    )
    return dataset


def write_netcdf(result: Result, path: Path) -> None:
    """See :meth:`Result.to_netcdf`."""
    needed("h5netcdf", "files")
    dataset = to_dataset(result)
    with path.open("xb"):  # FileExistsError if it is there: data are not overwritten
        pass
    try:
        dataset.to_netcdf(path, engine="h5netcdf")
    except BaseException:
        path.unlink()
        raise


def arc_lengths(line: Line | SectionedLine) -> Array:
    """(segments + 1,) m: where the nodes are on the unstretched line."""
    sections = (
        line.sections if isinstance(line, SectionedLine) else ((line.properties, line.segments),)
    )
    steps = [np.full(count, properties.length / count) for properties, count in sections]
    lengths: Array = np.concatenate([[0.0], np.cumsum(np.concatenate(steps))])
    return lengths


def _stacked(values: list[Array]) -> Array:
    stacked: Array = np.stack(values, axis=1)
    return stacked
