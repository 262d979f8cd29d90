# SPDX-License-Identifier: Apache-2.0
"""The steady shape of a cable in a sheared current, against an independent solution."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

import sim_core as sc

DEPTHS = [0.0, -10.0, -20.0, -35.0, -60.0]
CURRENT = [(1.2, 0.0, 0.0), (1.0, 0.3, 0.0), (0.4, 0.4, 0.0), (-0.2, 0.1, 0.0), (-0.2, 0.0, 0.0)]
VELOCITY = np.array([0.5, 0.0, 0.0])
CABLE = sc.LineProperties(
    length=50.0, diameter=0.012, mass_per_length=0.35, axial_stiffness=1e9,
    normal_drag=1.3, tangential_drag=0.02,
)  # fmt: skip
MASS, VOLUME, DRAG_AREA = 60.0, 8e-3, 0.05


def by_integration():
    """Places at 25 m and at the end, and the tension at the top, of the inextensible cable:
    d(T t)/ds = −load from the end upwards, the end's depth such that the top comes to z = 0."""
    flow_at = PchipInterpolator(DEPTHS[::-1], CURRENT[::-1])
    weight = (CABLE.mass_per_length - 1000.0 * math.pi / 4.0 * CABLE.diameter**2) * 9.81

    def upwards(_, y):
        flow = flow_at(y[2]) - VELOCITY
        t = y[3:] / np.linalg.norm(y[3:])
        along = flow @ t
        across = flow - along * t
        load = (
            500.0
            * CABLE.diameter
            * (
                CABLE.normal_drag * np.linalg.norm(across) * across
                + CABLE.tangential_drag * math.pi * abs(along) * along * t
            )
        )
        load[2] -= weight
        return np.concatenate([t, -load])

    def from_the_end(depth):
        flow = flow_at(-depth) - VELOCITY
        pull = -500.0 * DRAG_AREA * np.linalg.norm(flow) * flow
        pull[2] += (MASS - 1000.0 * VOLUME) * 9.81
        start = np.concatenate([[0.0, 0.0, -depth], pull])
        return solve_ivp(
            upwards, (0.0, CABLE.length), start, rtol=1e-11, atol=1e-11, t_eval=[0.0, 25.0, 50.0]
        ).y

    depth = brentq(lambda d: from_the_end(d)[2, -1], 20.0, 50.0, xtol=1e-11)
    y = from_the_end(depth)
    place = y[:3] - y[:3, -1:]
    return np.concatenate([place[:, 1], place[:, 0], [np.linalg.norm(y[3:, -1])]])


def by_segments(n):
    profile = list(zip(DEPTHS, CURRENT, strict=True))
    b = sc.ModelBuilder(sc.Water(current=sc.Current(profile=profile)))
    b.add_prescribed_point("top")
    b.add_free_point("weight", mass=MASS, volume=VOLUME, drag_area=DRAG_AREA)
    b.add_line("cable", "top", "weight", CABLE, segments=n)
    model = b.build()
    state = sc.steady_tow(model, position=(0.0, 0.0, 0.0), velocity=VELOCITY)
    nodes = state.node_positions("cable")
    tension = sc.Simulator(model, state).tensions("cable")[0]
    return np.concatenate([nodes[n // 2], nodes[n], [tension]])


def test_sheared_current():
    exact = by_integration()
    assert exact[4] > 0.1  # the current turns with depth: the shape is not plane
    coarse, fine = by_segments(40) - exact, by_segments(80) - exact
    # Second order: a fourth, but for the jumps in the current's curvature at the table's rows
    assert fine[:6] == pytest.approx(coarse[:6] / 4.0, abs=2e-2 * np.abs(coarse[:6]).max())
    assert fine[:6] == pytest.approx(np.zeros(6), abs=5e-3)
    # The first segment's tension is that at its middle: first order at the end
    assert fine[6] == pytest.approx(coarse[6] / 2.0, rel=2e-2)
