# SPDX-License-Identifier: Apache-2.0
"""Tow-point laws: known points, and derivatives against differences."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_rig import load_rig
from towtank_rig.motion import tow_point_motion

RIGS = Path(__file__).resolve().parents[4] / "hardware" / "rigs"
SINE = tow_point_motion(load_rig(RIGS / "nit_calicut_2012.yaml").tow_point)
SLIDER = tow_point_motion(load_rig(RIGS / "wu_chwang_2001.yaml").tow_point)
LAWS = pytest.mark.parametrize("motion", [SINE, SLIDER], ids=["sine", "slider_crank"])


def test_sine_at_known_points():
    angles = np.array([0.0, math.pi / 6, math.pi / 2, -math.pi / 2])
    assert SINE.height(angles) == pytest.approx([0.2, 0.23, 0.26, 0.14], abs=1e-15)


def test_slider_crank_at_known_points():
    r, rod = 0.1, 0.35
    # Dead centres: ±r. At a right angle the rod leans: l − √(l² − r²) above the middle.
    angles = np.array([0.0, math.pi, math.pi / 2, -math.pi / 2])
    lean = rod - math.sqrt(rod**2 - r**2)
    assert SLIDER.heave(angles) == pytest.approx([-r, r, lean, lean], abs=1e-15)
    assert SLIDER.mean_height == -2.0


def test_slider_crank_mean_lies_about_r_squared_over_four_rods_higher():
    angles = np.linspace(0, 2 * math.pi, 1000, endpoint=False)
    # Next term of the root's series: (3/64) r⁴/l³ = 1.1e-4 m.
    assert SLIDER.heave(angles).mean() == pytest.approx(0.1**2 / (4 * 0.35), abs=1.5e-4)


@LAWS
@given(angle=st.floats(-20.0, 20.0))
def test_slope_and_curvature_are_the_derivatives(motion, angle):
    h = 1e-5
    # Central difference: truncation h²/6·|f'''| < 2e-11·0.2, rounding 1e-16·0.1/h = 1e-12.
    slope = (motion.heave(angle + h) - motion.heave(angle - h)) / (2 * h)
    assert motion.slope(angle) == pytest.approx(slope, abs=2e-11)
    curvature = (motion.slope(angle + h) - motion.slope(angle - h)) / (2 * h)
    assert motion.curvature(angle) == pytest.approx(curvature, abs=2e-11)


@LAWS
@given(angle=st.floats(-20.0, 20.0))
def test_one_turn_leads_back(motion, angle):
    assert motion.height(angle + 2 * math.pi) == pytest.approx(motion.height(angle), abs=1e-14)


@LAWS
def test_arrays_and_scalars_agree(motion):
    angles = np.linspace(-3, 3, 7).reshape(1, 7)
    assert motion.height(angles).shape == (1, 7)
    assert [float(motion.height(angle)) for angle in angles[0]] == motion.height(angles)[0].tolist()
