# SPDX-License-Identifier: Apache-2.0
"""A second calibration tells what has changed since the first: everything that the first found."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_lab.accelerometer_calibration import SIX_POSITIONS, specific_force
from towtank_lab.procedures import evaluate_accelerometer, evaluate_crank
from towtank_rig import load_rig
from towtank_rig.conversion import rotation
from towtank_rig.loading import replaced
from towtank_rig.motion import tow_point_motion

RIG = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
ZERO, SENSITIVITY = (1.66, 1.64, 1.655), (0.0668, 0.0679, 0.0671)


def crank_rows(zero, radius=1.0, seed=0):
    """Marks with heights read to 0.3 mm; radius: over the rig's."""
    rng = np.random.default_rng(seed)
    motion = tow_point_motion(RIG.tow_point)
    rows = []
    for angle in range(0, 721, 45):
        height = 0.8 + radius * float(motion.heave(np.asarray(math.radians(angle) + zero)))
        rows.append(
            {
                "angle_deg": float(angle),
                "counts": math.floor(4096 * angle / 360),
                "height_m": height + rng.normal(0.0, 3e-4),
            }
        )
    return rows


def position_rows(turned=0.0, seed=0):
    """Six positions, two of them twice, noise of 0.2 mV; turned: the capsule about y, rad."""
    rng = np.random.default_rng(seed)
    rows = []
    for roll, pitch in [*SIX_POSITIONS.values(), *list(SIX_POSITIONS.values())[:2]]:
        force = specific_force(math.radians(roll), math.radians(pitch), RIG.water.gravity.value)
        felt = force @ rotation(0.0, turned, 0.0)
        volts = np.array(ZERO) + np.array(SENSITIVITY) * felt + rng.normal(0.0, 2e-4, 3)
        read = {f"volts_{a}": float(v) for a, v in zip("xyz", volts, strict=True)}
        rows.append({"roll_deg": roll, "pitch_deg": pitch, **read})
    return rows


def crank(rig, rows):
    return evaluate_crank(rig, rows, mark_limit=math.radians(0.5))


def accelerometer(rig, rows):
    return evaluate_accelerometer(rig, rows, level_limit=math.radians(0.3))


def after(evaluation):
    """The rig with the calibration in force."""
    section = {"id": "the-first", "date": "2026-01-01", **evaluation.section}
    return replaced(RIG, {f"calibrations.{evaluation.sensor}": section})


@pytest.mark.parametrize(
    ("evaluate", "first", "second"),
    [
        (crank, crank_rows(0.05, seed=1), crank_rows(0.05, seed=2)),
        (accelerometer, position_rows(seed=1), position_rows(seed=2)),
    ],
)
def test_the_same_sensor_again_has_not_changed(evaluate, first, second):
    again = evaluate(after(evaluate(RIG, first)), second)
    assert again.drift["against"] == "the-first"
    assert 0.0 <= again.drift["normalised"] < 1.0 and not again.notes


def test_moved_zero_mark_is_told():
    """By 20°, over a turn's end: nothing else of the encoder changes."""
    for zero in (0.05, math.pi - 0.1):
        later = crank(after(crank(RIG, crank_rows(zero))), crank_rows(zero + math.radians(20.0)))
        assert later.drift["zero_angle_rad"] == pytest.approx(math.radians(20.0), abs=0.02)
        assert later.drift["of"] == "zero angle" and later.drift["normalised"] > 10.0
        assert "against the-first: zero angle differs" in later.notes[0]


def test_crank_of_another_radius_is_told():
    """Of 63 mm, where the rig says 60: with no calibration before, too."""
    found = crank(RIG, crank_rows(0.05, radius=1.05))
    assert found.drift["radius_m"] == pytest.approx(0.003, abs=3e-4)
    assert found.drift["of"] == "the rig's crank radius" and found.drift["normalised"] > 1.0
    assert "crank radius differs" in found.notes[0]


def test_turned_capsule_is_told():
    """By 2.5° about y: sensitivities and zeros stay."""
    turned = math.radians(2.5)
    later = accelerometer(after(accelerometer(RIG, position_rows())), position_rows(turned))
    assert later.drift["rotation_rad"] == pytest.approx([0.0, turned, 0.0], abs=2e-3)
    assert later.drift["of"] == "alignment" and later.drift["normalised"] > 3.0
    assert "against the-first: alignment differs" in later.notes[0]
