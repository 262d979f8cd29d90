# SPDX-License-Identifier: Apache-2.0
"""Froude scaling: dimensions from units, there and back, and the same tow in the simulator."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_lab.fresh_water import surface_tension, vapour_pressure, viscosity
from towtank_lab.scale_effects import scale_effects
from towtank_lab.similitude import dimension, froude_factor, is_scaled, scale_rig
from towtank_rig import load_rig
from towtank_rig.quantity import Quantity
from towtank_study.simulation import Simulation
from towtank_study.tow_run import measure, simulate

RIGS = Path(__file__).parents[4] / "hardware" / "rigs"


@pytest.fixture(scope="module", params=["nit_calicut_2012", "wu_chwang_2001"])
def rig(request):
    return load_rig(RIGS / f"{request.param}.yaml")


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("m/s^2", (1, -2, 0)),
        ("kg m^2", (2, 0, 1)),
        ("N s", (1, -1, 1)),
        ("V/(m/s^2)", (-1, 2, 0)),
        ("kg/m^3", (-3, 0, 1)),
        ("Pa", (-1, -2, 1)),
        ("N m^2", (3, -2, 1)),
        ("1/rad", (0, 0, 0)),
        ("1", (0, 0, 0)),
    ],
)
def test_dimension_is_read_from_the_unit(unit, exponents):
    assert dimension(unit) == exponents


@pytest.mark.parametrize("unit", ["ft", "m^", "kg*m"])
def test_unknown_units_are_refused(unit):
    with pytest.raises(ValueError, match="unit"):
        froude_factor(unit, 2.0)


def test_every_unit_of_a_rig_has_a_dimension(rig):
    """So that no quantity of the schema can be passed over."""
    units = {quantity.unit for _, quantity in rig.quantities()}
    assert {"kg m^2", "N s", "V/K", "degC"} <= units
    for unit in units:
        assert math.isfinite(froude_factor(unit, 2.0))


def test_factors_are_froudes():
    """Length λ, time and speed √λ, force λ³, inertia λ⁵, stiffness per strain λ³; gravity and
    density stay."""
    expected = {"m": 1.0, "s": 0.5, "m/s": 0.5, "N": 3.0, "kg m^2": 5.0, "rad/s": -0.5, "Pa": 1.0}
    for unit, power in expected.items():
        assert froude_factor(unit, 4.0) == pytest.approx(4.0**power, rel=1e-15)
    assert froude_factor("m/s^2", 0.37) == froude_factor("kg/m^3", 0.37) == 1.0


@settings(max_examples=5)
@given(scale=st.floats(0.01, 100.0))
def test_there_and_back_is_the_same_rig(rig, scale):
    """Two roundings of a power and a product each: some 1e-15 relative."""
    back = scale_rig(scale_rig(rig, scale, "there"), 1.0 / scale, "back")
    for (path, old), (same, new) in zip(rig.quantities(), back.quantities(), strict=True):
        assert path == same
        assert new.value == pytest.approx(old.value, rel=1e-13)
        assert (new.range is None) == (old.range is None)
        if old.range:
            assert new.range == pytest.approx(old.range, rel=1e-13)


def test_instruments_stay_and_all_else_scales(rig):
    scaled = dict(scale_rig(rig, 2.0, "twice").quantities())
    for path, quantity in rig.quantities():
        factor = froude_factor(quantity.unit, 2.0) if is_scaled(path) else 1.0
        assert scaled[path].value == pytest.approx(factor * quantity.value, rel=1e-15), path
    full_scale = "sensors.fish_pressure.full_scale"
    assert scaled[full_scale] == rig.sensors.fish_pressure.full_scale
    assert scaled["sensors.fish_pressure.position.x"].value == pytest.approx(
        2.0 * rig.sensors.fish_pressure.position.x.value
    )
    assert scaled["board.sample_rate"] == rig.board.sample_rate


def test_the_new_file_says_where_it_comes_from(rig):
    scaled = scale_rig(rig, 0.5, "half")
    assert scaled.name == "half"
    assert f"Froude-scaled by 0.5 from {rig.name}" in scaled.description
    length: Quantity = scaled.lines.primary.length
    assert "Froude-scaled by 0.5" in length.source
    assert scaled.text.startswith("# Froude-scaled by 0.5")


def test_scaled_tow_heaves_alike():
    """Its drag coefficients do not know of Reynolds, so the simulated tow is similar: step and
    times by √λ = 1/2. What differs is where Newton's iteration stops."""
    rig = load_rig(RIGS / "nit_calicut_2012.yaml")
    model = scale_rig(rig, 0.25, "quarter")

    def seconds(value: float) -> Quantity:
        return Quantity(value=value, unit="s")

    full = measure(simulate(rig, Simulation(settling_time=seconds(10), periods=2, segments=6)))
    small = measure(
        simulate(
            model,
            Simulation(settling_time=seconds(5), periods=2, segments=6, step=seconds(0.0025)),
        )
    )
    for place in ("nose", "port", "middle"):
        name = f"heave_ratio_{place}"
        assert small[name] == pytest.approx(full[name], rel=1e-5), name
    assert small["depressor_heave"] == pytest.approx(0.25 * full["depressor_heave"], rel=1e-5)
    assert small["top_tension"] == pytest.approx(full["top_tension"] / 64.0, rel=1e-5)
    assert small["crank_frequency"] == pytest.approx(2.0 * full["crank_frequency"], rel=1e-12)


def test_what_does_not_scale_has_its_numbers():
    rig = load_rig(RIGS / "nit_calicut_2012.yaml")
    effects = {e.name: e for e in scale_effects(rig, scale_rig(rig, 0.25, "quarter"), 0.25)}
    reynolds = effects["Reynolds number, depressor"]
    # ρ U d / μ = 996.5 · 1 · 0.11 / 851e-6
    assert reynolds.original == pytest.approx(1.288e5, rel=0.005)
    assert reynolds.scaled == pytest.approx(reynolds.original / 8.0)  # λ^1.5
    assert effects["Weber number, primary line"].scaled == pytest.approx(
        effects["Weber number, primary line"].original / 16.0
    )
    noise = effects["depth noise of one sample over the crank's radius"]
    assert noise.scaled == pytest.approx(4.0 * noise.original)
    rope = effects["axial stiffness EA of the same rope, primary line"]
    assert rope.scaled == pytest.approx(4.0e5 / 16.0)
    assert "wants 6.25e+03 N" in rope.consequence
    assert not any(name.startswith("bending") for name in effects)  # this rig's lines are limp


def test_water_is_that_of_the_tables():
    """At 20 °C 1.0016 mPa s, 72.75 mN/m and 2339 Pa (IAPWS); at 27 °C 0.8509 mPa s."""
    assert viscosity(20.0) == pytest.approx(1.0016e-3, rel=1e-3)
    assert viscosity(27.0) == pytest.approx(0.8509e-3, rel=1e-3)
    assert surface_tension(20.0) == pytest.approx(72.75e-3, rel=1e-3)
    assert vapour_pressure(20.0) == pytest.approx(2339.0, rel=2e-3)
