# SPDX-License-Identifier: Apache-2.0
"""The surface of a body as the model sees it: a straight cylinder and plates for fins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Body, Fin

SIDES = 16  # of the cylinder; even, so that its ends can be cut into quadrilaterals


def body_surface(body: Body) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return corners, (n, 3) m in body axes, and quadrilaterals, (m, 4) indices of corners."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    radius = 0.5 * body.diameter
    ring = np.column_stack([np.zeros(SIDES), radius * np.cos(angle), radius * np.sin(angle)])
    nose = np.array([0.5 * body.length, 0.0, 0.0])
    i = np.arange(SIDES)
    side = np.column_stack([i, (i + 1) % SIDES, SIDES + (i + 1) % SIDES, SIDES + i])
    k = np.arange(SIDES // 2 - 1)
    end = np.column_stack([k, k + 1, SIDES - 2 - k, SIDES - 1 - k])
    corners = [ring - nose, ring + nose]
    quads = [side, end, end + SIDES]
    for fin in body.fins:
        quads.append(np.arange(4)[None, :] + sum(len(c) for c in corners))
        corners.append(_plate(fin))
    return np.concatenate(corners), np.concatenate(quads)


def placed(
    places: NDArray[np.float64], position: NDArray[np.float64], quaternion: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, 3) m in tank axes of places given in body axes, of a body at a position and attitude."""
    w, vector = quaternion[0], quaternion[1:]
    cross = np.cross(vector, places)
    moved: NDArray[np.float64] = position + places + 2.0 * (w * cross + np.cross(vector, cross))
    return moved


def _plate(fin: Fin) -> NDArray[np.float64]:
    """A square of the fin's area about its aerodynamic centre, edges along chord and span."""
    normal = fin.normal / np.linalg.norm(fin.normal)
    chord = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    chord /= np.linalg.norm(chord)
    half = 0.5 * np.sqrt(fin.area)
    span = np.cross(normal, chord)
    along, across = half * chord, half * span
    corners: NDArray[np.float64] = fin.position + np.array(
        [along + across, along - across, -along - across, across - along]
    )
    return corners
