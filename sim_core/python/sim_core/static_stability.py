# SPDX-License-Identifier: Apache-2.0
"""Static stability of a body that is towed at a point: does it turn its nose back into the flow?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_core._core import Body, ConvergenceError, Water, _body_wrench


@dataclass(frozen=True)
class StaticStability:
    """Moment about the tow point and how it changes as the body turns about it in a steady tow."""

    moment: NDArray[
        np.float64
    ]  #: (3,) N·m, body axes, at the given pitch; zero where it is trimmed
    pitch: float  #: N·m/rad of the flow about the body's y axis; negative is stable
    yaw: float  #: N·m/rad of the flow about the body's z axis; negative is stable
    righting: float  #: N·m/rad about y of weight and buoyancy; negative is stable
    #: static margin: how far the neutral point lies abaft the tow point, as a share of the length;
    #: None without any lift
    pitch_margin: float | None
    yaw_margin: float | None

    def __str__(self) -> str:
        def margin(value: float | None) -> str:
            return "no lift" if value is None else f"margin {100.0 * value:+.1f} % of the length"

        def verdict(derivative: float) -> str:
            return "stable" if derivative < 0.0 else "unstable"

        return (
            f"pitch: {self.pitch:+.3g} N·m/rad, {margin(self.pitch_margin)}, "
            f"with weight and buoyancy {self.pitch + self.righting:+.3g} N·m/rad: "
            f"{verdict(self.pitch + self.righting)}\n"
            f"yaw: {self.yaw:+.3g} N·m/rad, {margin(self.yaw_margin)}: {verdict(self.yaw)}"
        )


def static_stability(
    body: Body,
    tow_point: Sequence[float],
    speed: float,
    *,
    water: Water | None = None,
    pitch: float = 0.0,
) -> StaticStability:
    """Return the static stability of a body towed at a point.

    tow_point: (3,) m, body axes; speed: m/s, horizontal, through water of the given density and
    gravity; pitch: rad about y to port, so positive nose down. The body is fully immersed. Its
    pitch is turned about the tow point at constant speed; what the cable's tension does is no
    part of it.
    """
    water = water or Water()
    weightless = Water(density=water.density, gravity=0.0)
    arm = np.asarray(tow_point, dtype=float)
    force_turn, moment_turn, _ = _about(body, weightless, speed, pitch, np.zeros(3))
    _, flow, _ = _about(body, weightless, speed, pitch, arm)
    _, total, moment = _about(body, water, speed, pitch, arm)
    # about (x, 0, 0): M_y + x F_z in pitch, M_z − x F_y in yaw
    lift, side = float(force_turn[2, 1]), -float(force_turn[1, 2])
    return StaticStability(
        moment=moment,
        pitch=float(flow[1, 1]),
        yaw=float(flow[2, 2]),
        righting=float(total[1, 1] - flow[1, 1]),
        pitch_margin=_margin(arm[0], float(moment_turn[1, 1]), lift, body.length),
        yaw_margin=_margin(arm[0], float(moment_turn[2, 2]), side, body.length),
    )


def trimmed_pitch(
    body: Body, tow_point: Sequence[float], speed: float, *, water: Water | None = None
) -> float:
    """Return the pitch (rad, positive nose down) without a pitching moment about the tow point.

    Arguments as for :func:`static_stability`. Newton's method from level; ConvergenceError if
    there is no trim anywhere near.
    """
    water = water or Water()
    arm = np.asarray(tow_point, dtype=float)
    pitch = 0.0
    for _ in range(50):
        _, turn, moment = _about(body, water, speed, pitch, arm)
        if turn[1, 1] == 0.0:
            break
        change = -float(moment[1] / turn[1, 1])
        pitch += max(-0.2, min(0.2, change))
        if abs(change) < 1e-12:
            return pitch
    raise ConvergenceError(f"no trimmed pitch found at {speed:g} m/s: is the body stable?")


def _about(
    body: Body, water: Water, speed: float, pitch: float, place: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Per turn of the body: its force (body axes) and its moment about a place; and that moment."""
    attitude = (math.cos(0.5 * pitch), 0.0, math.sin(0.5 * pitch), 0.0)
    force, moment, force_turn, moment_turn = _body_wrench(body, water, attitude, (speed, 0, 0))
    # r × F and its change
    return force_turn, moment_turn - _skew(place) @ force_turn, moment - np.cross(place, force)


def _skew(a: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _margin(place: float, moment: float, force: float, length: float) -> float | None:
    """Neutral point x: moment + x·force = 0."""
    if abs(force) * length <= 1e-12 * abs(moment) or force == 0.0:
        return None
    return (place + moment / force) / length
