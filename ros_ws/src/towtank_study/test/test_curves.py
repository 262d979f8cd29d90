# SPDX-License-Identifier: Apache-2.0
"""Curves of a study's plots."""

import numpy as np
import pyarrow as pa
import pytest
from small_study import SMALL
from towtank_study.curves import course, curves
from towtank_study.loading import parse_study
from towtank_study.study import Plot

STUDY = parse_study(
    SMALL.replace("design:", "  - {path: fish.axial_drag, values: [1, 2]}\ndesign:")
).study
TABLE = pa.table(
    {
        "lines.secondary.length": [2.0, 2.0, 1.0, 1.0, 1.5, 1.5],
        "fish.axial_drag": [1.0, 2.0, 1.0, 2.0, 1.0, 2.0],
        "heave_ratio_nose": [0.1, 0.2, 0.3, None, 0.5, 0.6],
    }
)


def test_a_curve_for_each_value():
    plot = Plot(x="lines.secondary.length", y=("heave_ratio_nose",), by="fish.axial_drag")
    found = curves(STUDY, TABLE, plot)
    assert [(curve.label, curve.rows) for curve in found] == [("1", [2, 4, 0]), ("2", [3, 5, 1])]


def test_other_parameters_keep_their_first_value():
    plot = Plot(x="lines.secondary.length", y=("heave_ratio_nose",))
    (curve,) = curves(STUDY, TABLE, plot)
    assert curve.rows == [2, 4, 0]


@pytest.mark.parametrize(
    ("y", "kind"),
    [
        ([1, 2, 2], "rising"),
        ([3, 2, 1], "falling"),
        ([2, 2, 2], "constant"),
        ([1, 3, 2], "not monotonic"),
    ],
)
def test_course(y, kind):
    found = course(np.array([1.0, 2.0, 4.0]), np.array(y, dtype=float))
    assert found["course"] == kind
    assert found["last"] == {"at": 4.0, "value": y[-1]}
    assert found["greatest"]["value"] == max(y)


def test_the_course_leaves_out_what_failed():
    x, y = np.array([1.0, 2.0, 3.0]), np.array([1.0, np.nan, 2.0])
    assert course(x, y)["course"] == "rising"
    assert course(x[:2], y[:2]) is None
