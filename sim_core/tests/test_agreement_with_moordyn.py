# SPDX-License-Identifier: Apache-2.0
"""Ten random two-part tows beside what MoorDyn 2.7.2 gives for them.

moordyn_heave.json holds the systems and MoorDyn's results; `towtank bench agreement --write` made
it (RK4 at 0.8 of the largest stable time step, from the same steady tow, the same motion). The 2 %
cover what the programs do differently: MoorDyn lumps the fish into 10 strips, where
sim_core has 20 and exact inertia, and its tow point moves on straight lines of 0.3 ms.
"""

import json
from pathlib import Path

import pytest
from two_part_tow import Cable, Cylinder, Heave, Sphere, TwoPartTow, simulated_heave

FROZEN = json.loads((Path(__file__).parent / "moordyn_heave.json").read_text())


def tow_from(description: dict) -> TwoPartTow:
    parts = {"depressor": Sphere, "fish": Cylinder}
    parts |= dict.fromkeys(("primary", "depressor_cable", "secondary"), Cable)
    return TwoPartTow(
        **{
            name: parts[name](**value) if name in parts else value
            for name, value in description.items()
        }
    )


def test_there_are_ten_systems():
    assert len(FROZEN["systems"]) == 10


@pytest.mark.parametrize("system", FROZEN["systems"], ids=range(1, len(FROZEN["systems"]) + 1))
def test_heave_and_tension_within_2_per_cent(system):
    peer = Heave(**system["heave"])
    here = simulated_heave(
        tow_from(system["tow"]), system["duration"], FROZEN["periods"], max_step=0.005
    )
    assert here.depressor == pytest.approx(peer.depressor, rel=0.02)
    assert here.fish == pytest.approx(peer.fish, rel=0.02)
    assert here.tension == pytest.approx(peer.tension, rel=0.02)
    assert here.tension_amplitude == pytest.approx(peer.tension_amplitude, rel=0.02)
