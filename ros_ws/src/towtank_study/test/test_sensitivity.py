# SPDX-License-Identifier: Apache-2.0
"""Sobol indices against a function whose indices are known."""

import math

import numpy as np
import pytest
from towtank_study.designs import saltelli
from towtank_study.sensitivity import independent_rows, sobol_indices
from towtank_study.study import Sobol

A, B = 7.0, 0.1
DESIGN = Sobol(kind="sobol", samples=1024, seed=5, resamples=200)


def ishigami(unit: np.ndarray) -> np.ndarray:
    """sin x + A sin² y + B z⁴ sin x on (−π, π)³ (Ishigami & Homma 1990)."""
    x, y, z = (2 * math.pi * unit - math.pi).T
    return np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x)


def known_indices() -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices from the partial variances."""
    of_x = (1 + B * math.pi**4 / 5) ** 2 / 2
    of_y = A**2 / 8
    of_xz = B**2 * math.pi**8 * (1 / 18 - 1 / 50)
    all_ = of_x + of_y + of_xz
    return np.array([of_x, of_y, 0]) / all_, np.array([of_x + of_xz, of_y, of_xz]) / all_


@pytest.fixture(scope="module")
def values():
    return ishigami(saltelli(DESIGN, 3))


def test_ishigami(values):
    first, total = known_indices()
    found = sobol_indices(values, DESIGN, 3)
    # 95 % intervals each; 1.5 times them is 3 standard deviations, exceeded by 1 in 370.
    assert np.all(np.abs(found.first - first) < 1.5 * found.first_confidence)
    assert np.all(np.abs(found.total - total) < 1.5 * found.total_confidence)
    # The spread of a sum of 1024 terms, over the variance: about 1/√1024 times 2 to 4.
    assert np.all(found.first_confidence < 0.12)
    assert found.blocks == 1024


def test_a_failed_sample_takes_its_block_along(values):
    first, _ = known_indices()
    broken = values.copy()
    broken[[7, 1003]] = np.nan
    found = sobol_indices(broken, DESIGN, 3)
    assert found.blocks == 1022
    assert np.all(np.abs(found.first - first) < 1.5 * found.first_confidence)


def test_no_indices_where_there_is_nothing_to_tell(values):
    assert sobol_indices(np.ones_like(values), DESIGN, 3) is None
    assert sobol_indices(np.full_like(values, np.nan), DESIGN, 3) is None


def test_independent_rows():
    rows = independent_rows(Sobol(kind="sobol", samples=2), dimensions=3)
    assert rows.tolist() == [0, 4, 5, 9]
