# SPDX-License-Identifier: Apache-2.0
"""Heave of a place on a body, and attitude angles, from poses."""

from __future__ import annotations

import numpy as np


def place_height(z: np.ndarray, quaternion: np.ndarray, place: tuple[float, ...]) -> np.ndarray:
    """Height (m, tank axes, upwards) of a place fixed on a body.

    z: height of the body's origin, shape (n,). quaternion: x, y, z, w, unit length, turns body to
    tank axes, shape (n, 4). place: m, body axes (x forward, y port, z up).
    """
    qx, qy, qz, qw = quaternion.T
    px, py, pz = place
    return (
        z
        + 2 * (qx * qz - qw * qy) * px
        + 2 * (qy * qz + qw * qx) * py
        + (1 - 2 * (qx * qx + qy * qy)) * pz
    )


def bow_up_pitch(quaternion: np.ndarray) -> np.ndarray:
    """Elevation of the body's x axis above the horizon, rad, bow up positive; shape (n,).

    By REP-103 pitch turns about +y and is positive bow down: this is its negative.
    """
    qx, qy, qz, qw = quaternion.T
    return np.arcsin(np.clip(2 * (qx * qz - qw * qy), -1.0, 1.0))
