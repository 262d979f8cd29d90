# SPDX-License-Identifier: Apache-2.0
"""What the twin's segments cost its heave ratio, from the motion in a bag."""

from pathlib import Path

import pytest
from towtank_bringup.twin_discretisation import discretisation, twin_discretisation
from towtank_compare.compare import open_comparison

REFERENCE = Path(__file__).resolve().parents[4] / "bags" / "reference"


def test_the_estimate_is_the_error_against_many_more_segments():
    opened = open_comparison(REFERENCE)
    logged = opened.window(None)
    window = (logged.t0_ms / 1000, logged.t1_ms / 1000)
    of_40, of_80, of_160 = (
        discretisation(opened, window, segments)["ratio_error"] for segments in (40, 80, 160)
    )
    # Each estimate is a third of what the halving before it has changed, so that the ratio with 40
    # less that with an endless number is 3 of_80 + 3 of_160 + of_160. The order is not yet two at
    # 20 segments: the estimate of 40, which rests on these, is a third too large here.
    assert of_40 == pytest.approx(3 * of_80 + 4 * of_160, rel=0.5)
    assert abs(of_160) < abs(of_40) / 8


def test_a_bag_without_a_twin_has_none():
    assert twin_discretisation(REFERENCE, open_comparison(REFERENCE).window(None)) is None
