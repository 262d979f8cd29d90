# SPDX-License-Identifier: Apache-2.0
"""Vectors and rotations between body and tank axes.

Plain tuples: at three components numpy's calls cost more than the arithmetic. Components may be
floats or arrays of one shape.
"""

from __future__ import annotations

from typing import Any

Vector = tuple[Any, Any, Any]
"""x, y, z."""

Quaternion = tuple[Any, Any, Any, Any]
"""Unit quaternion (w, x, y, z) that rotates body axes to tank axes."""


def to_tank(quaternion: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector from body to tank axes: v + 2w(q × v) + 2q × (q × v)."""
    w, *q = quaternion
    twice = tuple(2 * component for component in cross(tuple(q), vector))
    around = cross(tuple(q), twice)
    return (
        vector[0] + w * twice[0] + around[0],
        vector[1] + w * twice[1] + around[1],
        vector[2] + w * twice[2] + around[2],
    )


def to_body(quaternion: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector from tank to body axes."""
    w, x, y, z = quaternion
    return to_tank((w, -x, -y, -z), vector)


def add(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
