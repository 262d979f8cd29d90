# SPDX-License-Identifier: Apache-2.0
"""Density of the water: by temperature and salinity where the rig does not state it."""

from pathlib import Path

import pytest
from towtank_rig import RigError, load_rig, parse_rig
from towtank_rig.check import warnings
from towtank_rig.loading import replaced
from towtank_rig.water_density import density

RIG_FILE = Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
RIG = load_rig(RIG_FILE)


def without_density(**water):
    """The rig's text with no density, and with other water."""
    stated = "  density: {value: 996.5"
    lines = [line for line in RIG.text.splitlines() if not line.startswith(stated)]
    assert len(lines) == len(RIG.text.splitlines()) - 1
    rig = parse_rig("\n".join(lines))
    return replaced(rig, {f"water.{key}": value for key, value in water.items()}) if water else rig


@pytest.mark.parametrize(
    ("celsius", "expected"), [(15.0, 999.1026), (20.0, 998.2072), (25.0, 997.0476)]
)
def test_fresh_water(celsius, expected):
    """Table of ITTC 7.5-02-01-03 (2011), from IAPWS."""
    assert density(celsius, 0.0) == pytest.approx(expected, abs=2e-4)


def test_sea_water():
    """1023.343 kg/m3 at a salinity of 35 and 25 degrees (UNESCO's equation of state, EOS-80)."""
    assert density(25.0, 0.03516504) == pytest.approx(1023.343, abs=2e-3)


def test_density_follows_from_the_temperature():
    water = without_density().water
    assert water.density.value == pytest.approx(density(27.0, 0.0), rel=1e-12)
    assert water.density.range == pytest.approx((density(30.0, 0.0), density(24.0, 0.0)))
    assert water.density.basis == "derived" and "27 degC" in water.density.source


def test_density_of_a_salt_tank():
    salt = without_density(salinity={"value": 0.035, "range": [0.034, 0.036]}).water
    assert salt.density.value == pytest.approx(density(27.0, 0.035), rel=1e-12)
    low, high = salt.density.range
    assert low == pytest.approx(density(30.0, 0.034))
    assert high == pytest.approx(density(24.0, 0.036))


def test_faults_of_the_temperature_are_told_where_they_stand():
    with pytest.raises(RigError, match=r"water\.temperature: unit 'K' is not accepted here"):
        without_density(temperature="300 K")


def test_density_that_the_temperature_contradicts_is_warned_of():
    assert not any(line.startswith("water:") for line in warnings(RIG))
    cold = replaced(RIG, {"water.temperature": {"value": "10 degC", "range": [9, 11]}})
    assert any("by TEOS-10 at 10 degC" in line for line in warnings(cold))
