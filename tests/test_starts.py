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


@pytest.mark.parametrize("segments", [6, 20, 40])
@pytest.mark.parametrize("study", STUDIES)
def test_every_draw_starts_at_rest_and_under_way(study, segments):
    for rig in starts.draws(study, DRAWS, seed=1, chosen=range(0, DRAWS, 50)):
        for speed in (0.0, rig.run.carriage_speed.value):
            state = starts.start(rig, segments, speed)
            # N and N·m. A step of the simulation is solved to 1e-8 of the weight in air, 2e-6 N.
            assert np.abs(sc._core._residual(state)).max() < 2e-6
