# SPDX-License-Identifier: Apache-2.0
"""Masses by hand from the rig file, cable loads against a hand bound, ballast against balance."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_bringup.rigs import rig_path
from towtank_lab.trim import evaluate
from towtank_rig import load_rig
from towtank_rig.conversion import rotation
from towtank_rig.loading import replaced
from towtank_workshop.equilibrium import hang
from towtank_workshop.masses import (
    FOAM,
    STEEL,
    ballast_cases,
    bodies,
    imagined_weighings,
    loads,
    markdown,
    resting_pitch,
)

COMMITTED = Path(__file__).parents[4] / "hardware" / "rig" / "masses.md"
NIT = load_rig(rig_path("nit_calicut_2012"))
WU = load_rig(rig_path("wu_chwang_2001"))


def test_masses_by_hand():
    """From the rig file: 1.2 m of 0.241 and 0.154 kg/m, 0.3 m of 0.083 and 0.059, 1 m of 0.144 and
    0.075; the depressor 6.2 and 5.5 kg; the fish 12.35 kg and neutral."""
    found = {part.name: (part.mass, part.apparent) for part in bodies(NIT)}
    assert found == {
        "tow-fish, filled": pytest.approx((12.35, 0.0)),
        "depressor": pytest.approx((6.2, 5.5)),
        "primary cable": pytest.approx((0.2892, 0.1848)),
        "depressor cable": pytest.approx((0.0249, 0.0177)),
        "secondary cable": pytest.approx((0.144, 0.075)),
    }


def test_steady_loads_are_those_of_the_drawn_equilibrium():
    towed = hang(NIT, NIT.run.carriage_speed.value)
    assert {load.name: load.steady for load in loads(NIT)} == pytest.approx(towed.tensions)


def test_the_depressors_cable_bears_what_hand_figures_say():
    """Its load swings by no more than the depressor with its added mass (0.35 kg), the cable itself
    (0.033 kg with added mass) and the drag at the greatest velocity give, all at once: 4.0 N; and
    by no less than the mass alone, which heaves by 0.9 of the tow point at least."""
    depressor = next(load for load in loads(NIT) if load.name == "depressor")
    acceleration = 0.06 * math.pi**2
    drag = 0.5 * 996.5 * 0.47 * math.pi / 4.0 * 0.11**2 * (0.06 * math.pi) ** 2
    greatest = (6.2 + 0.35 + 0.033) * acceleration + drag
    assert 0.9 * 6.2 * acceleration < depressor.peak - depressor.steady < greatest
    assert depressor.least < depressor.steady


def test_a_crank_at_rest_adds_nothing():
    """The peak then is the steady tension, and the least of a line lies at its lower end."""
    still = replaced(NIT, {"run.crank_rate": 0.0})
    for load in loads(still):
        assert load.peak - load.least < 2.0
        assert load.peak == pytest.approx(load.steady, abs=0.05)


def test_a_fast_crank_lets_a_cable_go_slack():
    """At 3 Hz the depressor, which falls with no more than 0.8 g, cannot follow 21 m/s²."""
    fast = replaced(NIT, {"run.crank_rate": 6.0 * math.pi})
    assert min(load.least for load in loads(fast)) <= 0.0


masses = st.floats(-0.25, 0.25).filter(lambda mass: abs(mass) > 0.01)


@given(masses, st.floats(-0.01, 0.01))
def test_ballast_makes_the_fish_neutral_and_level(apparent, centre_x):
    """By the balance of apparent masses and of their moments about mid-hull, once as one piece and
    once as two."""
    density = STEEL if apparent < 0.0 else FOAM
    ballast = evaluate(imagined_weighings(NIT, apparent, centre_x, density)).ballast
    lightness = 1.0 - NIT.water.density.value / density
    moment = (NIT.fish.displaced_mass + apparent) * centre_x
    room = 0.38 * NIT.fish.length.value
    one = [(ballast.mass.value, ballast.x.value)]
    two = [(ballast.forward_mass.value, room), (ballast.aft_mass.value, -room)]
    for pieces in (one, two):
        assert apparent + lightness * sum(m for m, _ in pieces) == pytest.approx(0.0, abs=1e-9)
        assert moment + lightness * sum(m * x for m, x in pieces) == pytest.approx(0.0, abs=1e-9)


def test_ballast_is_given_for_the_ends_of_the_ranges():
    """The NIT fish is neutral or up to 0.25 kg light; Wu & Chwang's is neutral, without a range."""
    cases = ballast_cases(NIT)
    assert [(case.apparent, case.centre_x) for case in cases] == [
        (-0.25, -0.01),
        (-0.25, 0.0),
        (-0.25, 0.01),
    ]
    assert cases[1].ballast.mass.value == pytest.approx(0.25 / (1.0 - 996.5 / 7900.0))
    assert ballast_cases(WU) == []


@settings(max_examples=10)  # each reads the rig file anew
@given(st.floats(-0.01, 0.01), st.floats(-0.2, 0.2))
def test_forces_balance_about_the_tow_point_at_the_resting_pitch(centre_x, apparent):
    fish = NIT.fish
    rig = replaced(
        NIT, {"fish.apparent_mass_in_water": {"value": f"{apparent!r} kg", "basis": "measured"}}
    )
    pitch = resting_pitch(rig, centre_x)
    up = rotation(0.0, pitch, 0.0).T @ [0.0, 0.0, 1.0]
    moment = 0.0
    weight, buoyancy = fish.mass_in_water_filled.value, -rig.fish.displaced_mass
    centre = (centre_x, fish.centre_of_gravity.z.value)
    for mass, (x, z) in ((weight, centre), (buoyancy, (0.0, 0.0))):
        x, z = x - fish.tow_point.x.value, z - fish.tow_point.z.value
        moment += mass * (z * up[0] - x * up[2])
    assert moment == pytest.approx(0.0, abs=1e-9)


def test_a_fish_that_nothing_rights_is_said():
    assert "nothing rights the fish" in markdown(WU, 5.0)
    assert "nothing rights the fish" not in markdown(NIT, 5.0)


def test_the_factor_scales_what_a_rope_must_bear():
    peak = max(load.peak for load in loads(NIT))
    assert f"| {5.0 * peak:.0f} |" in markdown(NIT, 5.0)
    assert f"| {8.0 * peak:.0f} |" in markdown(NIT, 8.0)


def test_the_tables_are_the_committed_ones():
    # Print them anew with: ./towtank masses nit_calicut_2012 > hardware/rig/masses.md
    assert markdown(NIT, 5.0) == COMMITTED.read_text("utf-8")
