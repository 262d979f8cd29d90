# SPDX-License-Identifier: Apache-2.0
"""Coverage intervals of sums of errors against closed forms, and against random numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_uncertainty.intervals import (
    Normal,
    Oscillation,
    Product,
    Rectangular,
    Scaled,
    half_width,
)

# In standard deviations: 5e-5 of probability (see the module), times an interval's change with
# probability, up to 10 standard deviations per unit for these.
SERIES = 5e-4


def test_nothing_uncertain_has_no_width():
    assert half_width([]) == half_width([Normal(0.0), Rectangular(0.0)]) == 0.0


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([Normal(2.0)], 2 * 1.959964),
        ([Normal(0.3), Normal(0.4)], 0.5 * 1.959964),
        ([Rectangular(1.0)], 0.95),
        # Triangle: 1 − (1 − x/2)² within ± x.
        ([Rectangular(1.0), Rectangular(1.0)], 2 - 2 * math.sqrt(0.05)),
        # x (1 − ln x) = 0.95.
        ([Product(Rectangular(1.0), Rectangular(1.0))], 0.7009200),
    ],
)
def test_closed_forms(errors, expected):
    deviation = math.hypot(*(error.deviation for error in errors))
    assert half_width(errors) == pytest.approx(expected, abs=SERIES * deviation)


def test_oscillation_with_a_little_noise():
    """An arc sine alone ends at sin(0.95 π/2); noise of 1 % moves that by half its own square."""
    found = half_width([Oscillation(1.0), Normal(0.01)])
    assert found == pytest.approx(math.sin(0.95 * math.pi / 2), abs=0.004)


def test_another_probability():
    assert half_width([Normal(1.0)], 0.6826895) == pytest.approx(1.0, abs=SERIES)


CASES = {
    "product about a mean": [
        (
            Product(Rectangular(1.0), Normal(0.3), mean=-0.5),
            lambda r, n: r.uniform(-1, 1, n) * (-0.5 + 0.3 * r.standard_normal(n)),
        ),
        (Rectangular(0.3), lambda r, n: r.uniform(-0.3, 0.3, n)),
    ],
    "product of three": [
        (
            Product(Product(Rectangular(1.0), Rectangular(1.0)), Normal(1.0)),
            lambda r, n: r.uniform(-1, 1, n) * r.uniform(-1, 1, n) * r.standard_normal(n),
        ),
        (Normal(0.2), lambda r, n: 0.2 * r.standard_normal(n)),
    ],
    "random oscillation": [
        (
            Scaled(-2.0, Product(Rectangular(1.0), Oscillation(1.0))),
            lambda r, n: 2 * r.uniform(-1, 1, n) * np.cos(r.uniform(0, 2 * math.pi, n)),
        ),
        (Normal(0.2), lambda r, n: 0.2 * r.standard_normal(n)),
    ],
}


@pytest.mark.parametrize("case", CASES)
def test_random_sums_lie_inside_as_often_as_said(case):
    """400 000 sums: the share inside scatters by 0.034 %; five of that."""
    rng, count = np.random.default_rng(1), 400_000
    sums = sum(draw(rng, count) for _, draw in CASES[case])
    errors = [error for error, _ in CASES[case]]
    assert np.mean(np.abs(sums) <= half_width(errors)) == pytest.approx(0.95, abs=0.0018)
    deviation = math.hypot(*(error.deviation for error in errors))
    # The square of a deviation scatters by √(kurtosis − 1)/√n: below 3/√n here.
    assert np.std(sums) == pytest.approx(deviation, rel=5 * 1.5 / math.sqrt(count))


@given(
    limits=st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=5),
    scale=st.floats(1e-3, 1e3),
)
def test_width_goes_with_the_errors_scale_and_stays_within_their_limits(limits, scale):
    errors = [Rectangular(limit) for limit in limits]
    width = half_width(errors)
    assert 0.95 * max(limits) * (1 - 2e-3) <= width <= sum(limits)
    scaled = half_width([Scaled(scale, error) for error in errors])
    assert scaled == pytest.approx(scale * width, rel=1e-6)
