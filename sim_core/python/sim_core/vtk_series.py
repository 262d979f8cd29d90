# SPDX-License-Identifier: Apache-2.0
"""Results as a time series of VTK files, to be looked at in ParaView."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sim_core.body_surface import body_surface, placed
from sim_core.extras import needed

if TYPE_CHECKING:
    from sim_core.result import Result


def write_vtk(result: Result, directory: Path, every: int) -> Path:
    """See :meth:`Result.to_vtk`."""
    meshio = needed("meshio", "files")
    if every < 1:
        raise ValueError(f"every is {every}: it must be 1 or more")
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise FileExistsError(f"{directory} is not empty: choose another directory")
    directory.mkdir(parents=True, exist_ok=True)
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    for number, sample in enumerate(range(0, len(result.time), every)):
        for part, (name, mesh) in enumerate(_meshes(meshio, result, sample)):
            file = f"{name}_{number:06d}.vtu"
            mesh.write(directory / file)
            ElementTree.SubElement(
                collection,
                "DataSet",
                timestep=repr(float(result.time[sample])),
                part=str(part),
                name=name,
                file=file,
            )
    path = directory / "tow.pvd"
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, xml_declaration=True, encoding="utf-8")
    return path


def _meshes(meshio: Any, result: Result, sample: int) -> Iterator[tuple[str, Any]]:
    if result.lines:
        yield "lines", _lines(meshio, result, sample)
    points = np.array([p.position[sample] for p in result.points.values()])
    vertices = np.arange(len(points))[:, None]
    velocity = np.array([p.velocity[sample] for p in result.points.values()])
    load = np.array(
        [
            np.zeros(3) if p.hook_load is None else p.hook_load[sample]
            for p in result.points.values()
        ]
    )
    values = {"velocity [m/s]": velocity, "hook load [N]": load}
    yield "points", meshio.Mesh(points, [("vertex", vertices)], values)
    if result.bodies:
        yield "bodies", _bodies(meshio, result, sample)


def _lines(meshio: Any, result: Result, sample: int) -> Any:
    """All lines in one mesh: a cell for each segment, with its tension and its line's number.

    Nodes carry bending moment and curvature if some line has any; limp lines then have zeros.
    """
    first = 0
    cells = []
    for line in result.lines.values():
        i = first + np.arange(line.tensions.shape[1])
        cells.append(np.column_stack([i, i + 1]))
        first += line.node_positions.shape[1]
    lines = result.lines.values()
    nodes = {"velocity [m/s]": np.concatenate([line.node_velocities[sample] for line in lines])}
    if any(line.bending_moments is not None for line in lines):
        for name, quantity in (
            ("bending moment [N m]", "bending_moments"),
            ("curvature [1/m]", "curvatures"),
        ):
            values = [getattr(line, quantity) for line in lines]
            nodes[name] = np.concatenate(
                [
                    np.zeros(line.node_positions.shape[1]) if of_line is None else of_line[sample]
                    for line, of_line in zip(lines, values, strict=True)
                ]
            )
    return meshio.Mesh(
        np.concatenate([line.node_positions[sample] for line in lines]),
        [("line", np.concatenate(cells))],
        nodes,
        {
            "tension [N]": [np.concatenate([line.tensions[sample] for line in lines])],
            "line": [np.concatenate([np.full(len(c), i) for i, c in enumerate(cells)])],
        },
    )


def _bodies(meshio: Any, result: Result, sample: int) -> Any:
    """The surface of each body where it is, with its forward axis, velocity and number."""
    first = 0
    corners, quads, velocity, forward, number = [], [], [], [], []
    for i, (name, body) in enumerate(result.bodies.items()):
        local, cells = body_surface(result.model._body(name))
        position, quaternion = body.position[sample], body.quaternion[sample]
        corners.append(placed(local, position, quaternion))
        quads.append(cells + first)
        first += len(local)
        nose = placed(np.array([1.0, 0.0, 0.0]), np.zeros(3), quaternion)
        forward.append(np.tile(nose, (len(cells), 1)))
        velocity.append(np.tile(body.velocity[sample], (len(cells), 1)))
        number.append(np.full(len(cells), i))
    return meshio.Mesh(
        np.concatenate(corners),
        [("quad", np.concatenate(quads))],
        cell_data={
            "forward": [np.concatenate(forward)],
            "velocity [m/s]": [np.concatenate(velocity)],
            "body": [np.concatenate(number)],
        },
    )
