# SPDX-License-Identifier: Apache-2.0
"""The rig files of the project load and hold the numbers of their sources."""

import math
from pathlib import Path

import pytest
from towtank_rig import load_rig

RIGS = Path(__file__).resolve().parents[4] / "hardware" / "rigs"


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_rig_file_loads_under_its_own_name(path):
    rig = load_rig(path)
    assert rig.name == path.stem
    assert rig.text == path.read_text(encoding="utf-8")
    assert rig.assumptions(), "a rig without assumptions has hidden them"


def test_wu_chwang_holds_the_published_numbers():
    rig = load_rig(RIGS / "wu_chwang_2001.yaml")
    assert rig.run.carriage_speed.value == 1.75
    assert rig.run.crank_rate.value == pytest.approx(2 * math.pi / 1.6, rel=1e-15)
    assert rig.tow_point.motion.rod_length.value == 0.35
    assert rig.lines.primary.length.value == 2.84
    assert rig.fish.munk_moment.value == 0 and rig.fish.fins == ()


def test_nit_calicut_holds_the_published_numbers():
    rig = load_rig(RIGS / "nit_calicut_2012.yaml")
    assert rig.run.crank_rate.value == pytest.approx(30 * 2 * math.pi / 60, rel=1e-15)
    assert rig.tow_point.motion.crank_radius.value == 0.06
    assert (rig.tank.length.value, rig.tank.width.value, rig.tank.depth.value) == (40, 2, 2.2)
    assert [fin.plane for fin in rig.fish.fins].count("vertical") == 2
    assert [fin.plane for fin in rig.fish.fins].count("horizontal") == 2


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_cable_diameters_are_those_of_the_displaced_volume(path):
    rig = load_rig(path)
    for line in (rig.lines.primary, rig.lines.depressor, rig.lines.secondary):
        displaced = line.mass_per_length.value - line.weight_in_water_per_length.value
        diameter = math.sqrt(4 * displaced / (math.pi * rig.water.density.value))
        # The files round to 0.1 µm in 5 to 10 mm.
        assert line.diameter.value == pytest.approx(diameter, rel=1e-4)


def test_nit_fish_and_depressor_hang_clear_of_the_floor():
    rig = load_rig(RIGS / "nit_calicut_2012.yaml")
    top = rig.tow_point.height.value - rig.tow_point.motion.crank_radius.value
    junction = top - rig.lines.primary.length.value
    fish = junction - rig.lines.secondary.length.value - rig.fish.diameter.value / 2
    depressor = junction - rig.lines.depressor.length.value - rig.depressor.diameter.value
    assert min(fish, depressor) > -rig.tank.depth.value
