# SPDX-License-Identifier: Apache-2.0
"""Whatever a rig file leaves open, the tow finds its start: as it hangs at rest, and under way.

`towtank bench starts` does it with a thousand draws of each rig.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

import sim_core as sc

sys.path.append(str(Path(__file__).parent / "benchmarks"))
import starts

DRAWS = 1000
STUDIES = ("sensitivity_nit_calicut", "sensitivity_wu_chwang")
# Of these draws, those that Newton's method on stiff lines and a tow in time brought to no start
FAILED_AT_REST = {
    "sensitivity_nit_calicut": (
        72,
        109,
        191,
        195,
        234,
        246,
        305,
        338,
        355,
        408,
        439,
        578,
        580,
        607,
    ),
    "sensitivity_wu_chwang": (642,),
}
FAILED_UNDER_WAY = {"sensitivity_wu_chwang": (18, 43, 51, 56, 60, 87, 88, 105, 109, 113, 115)}


@pytest.mark.parametrize("segments", [6, 20, 40])
@pytest.mark.parametrize("study", STUDIES)
def test_every_draw_starts_at_rest_and_under_way(study, segments):
    for rig in starts.draws(study, DRAWS, seed=1, chosen=range(0, DRAWS, 50)):
        for speed in (0.0, rig.run.carriage_speed.value):
            assert_steady(starts.start(rig, segments, speed))


@pytest.mark.parametrize("study", STUDIES)
def test_a_fish_that_floats_up_folds_its_cable(study):
    for rig in starts.draws(study, DRAWS, seed=1, chosen=FAILED_AT_REST[study]):
        assert_steady(starts.start(rig, segments=0, speed=0.0))


@pytest.mark.parametrize("study", FAILED_UNDER_WAY)
def test_a_fish_that_swings_has_an_equilibrium(study):
    """Bare hulls with a good part of the Munk moment, which do not keep a straight course."""
    for rig in starts.draws(study, DRAWS, seed=1, chosen=FAILED_UNDER_WAY[study]):
        assert_steady(starts.start(rig, segments=0, speed=rig.run.carriage_speed.value))


def assert_steady(state: sc.State) -> None:
    # N and N·m. A step of the simulation is solved to 1e-8 of the weight in air, 2e-6 N.
    assert np.abs(sc._core._residual(state)).max() < 2e-6
