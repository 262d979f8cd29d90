# SPDX-License-Identifier: Apache-2.0
"""The thesis's figure for the error of a depth, and what it leaves out."""

import math
from pathlib import Path

import pytest
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_uncertainty.appendix_three import DEPTH, PRINTED, appendix_three

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")


def test_tolerance_of_the_span_gives_what_the_thesis_prints():
    """1 mV of 80 mV on 21.56 kPa is 0.2695 kPa, 27.5 mm at 9800 N/m³; the thesis rounds on its way
    (0.431 mV, 0.269 kPa) and prints 2.74 cm, so that 0.2 mm may be between."""
    found = appendix_three(RIG)
    assert found.span_tolerance == pytest.approx(0.2695e3 / 9800, rel=1e-9)
    assert found.span_tolerance == pytest.approx(PRINTED, abs=2e-4)


def test_figure_does_not_depend_on_the_rig():
    heavier = replaced(
        RIG, {"water.density": "1025 kg/m^3", "sensors.fish_pressure.span": "0.05 V"}
    )
    assert appendix_three(heavier).span_tolerance == pytest.approx(
        appendix_three(RIG).span_tolerance, rel=1e-12
    )


def test_what_it_leaves_out():
    found = appendix_three(RIG)
    left_out = list(found.left_out)
    assert {"linearity", "hysteresis", "amplifier gain", "flow pressure"} <= set(left_out)
    assert {"offset over temperature", "reference ratio"} <= set(left_out)
    assert "span" not in left_out and "offset" not in left_out
    sizes = list(found.left_out.values())
    assert sizes == sorted(sizes, reverse=True)
    assert found.combined == pytest.approx(math.hypot(found.span, *sizes), rel=1e-12)
    # 3.75 % by data sheet, a limit; it dominates, so 95 % are between its 95 % and 1.96 u
    assert found.span == pytest.approx(0.0375 / math.sqrt(3) * DEPTH, rel=1e-9)
    assert 0.95 * 0.0375 * DEPTH < found.u95 < 1.96 * found.combined


def test_physics_that_it_leaves_out():
    found = appendix_three(RIG)
    weight = 996.5 * 9.782
    # ±1 mV of bridge, twice ±0.5 % of its 40 mV and ±62 µV of amplifier, 50 kPa per 40 mV
    offset = math.hypot(1e-3, 2e-4, 2e-4, 6.4e-5) / math.sqrt(3) * 50_000 / 0.040 / weight
    assert found.zero_offset == pytest.approx(offset, rel=1e-9)
    assert found.weight_of_water == pytest.approx(DEPTH * (9800 / weight - 1), rel=1e-9)
    assert found.velocity_head == pytest.approx(1.0**2 / 2 / 9.782, rel=1e-12)  # at 1 m/s
    assert found.excitation == pytest.approx(0.022)
    # Air at constant volume: p/T; the rig's water is at 27 °C
    assert found.unvented == pytest.approx(101_325 / 300.15 / weight, rel=1e-9)
