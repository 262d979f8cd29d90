# SPDX-License-Identifier: Apache-2.0
"""Combination of uncertainties against the GUM's own examples."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_rig.quantity import NORMAL_95
from towtank_uncertainty.combination import Estimate, combine, coverage_factor, effective_freedom
from towtank_uncertainty.intervals import Normal, Rectangular, half_width


def test_effective_freedom_is_that_of_the_guides_example():
    # GUM G.4.1, example: relative uncertainties of 0.25, 0.57 and 0.82 % from 10, 5 and 15
    # observations give 19.0 degrees of freedom (stated to a digit, as its inputs are to two).
    assert effective_freedom([(0.25, 9), (0.57, 4), (0.82, 14)]) == pytest.approx(19.0, abs=0.05)


@pytest.mark.parametrize(
    ("freedom", "factor"), [(1, 12.71), (4, 2.78), (19, 2.09), (100, 1.984), (math.inf, 1.960)]
)
def test_coverage_factor_is_that_of_the_guides_table(freedom, factor):
    # GUM table G.2, column of 95 %, to its last digit
    assert coverage_factor(freedom) == pytest.approx(factor, abs=0.005 if freedom < 50 else 0.0005)


def test_exact_figures_have_no_freedom_to_lose():
    assert effective_freedom([(1.0, math.inf), (2.0, math.inf)]) == math.inf
    assert effective_freedom([(0.0, 3.0), (2.0, math.inf)]) == math.inf
    assert effective_freedom([]) == math.inf


def test_scatter_of_no_freedom_has_no_interval():
    assert math.isnan(combine(1.0, 0.0, [Rectangular(1.0)]).u95)


def test_scatter_alone_has_students_interval():
    # Half-widths are found numerically, to better than 1e-4
    assert combine(0.3, 4.0, []).u95 == pytest.approx(Estimate(7.0, 0.3, 4.0).u95, rel=1e-4)


def test_limit_alone_has_its_own_interval():
    # 95 % of an error anywhere within its limit lie within 0.95 of it; 1.96 sigma would be 1.13
    found = combine(0.0, 5.0, [Rectangular(2.0)])
    assert found.u95 == pytest.approx(0.95 * 2.0, rel=1e-3)
    assert found.type_b == pytest.approx(2.0 / math.sqrt(3.0))


@given(
    parts=st.lists(
        st.tuples(st.floats(1e-9, 1e9), st.floats(1.0, 1e5) | st.just(math.inf)), min_size=1
    )
)
def test_effective_freedom_lies_between_the_least_and_the_sum(parts):
    # GUM G.4.1: the effective degrees of freedom are at most the sum of the parts' own
    effective = effective_freedom(parts)
    assert min(freedom for _, freedom in parts) <= effective * (1 + 1e-9)
    finite = [freedom for _, freedom in parts]
    assert effective <= sum(finite) * (1 + 1e-9)


def test_interval_widens_as_student_does():
    exact = half_width((Normal(1.0), Normal(1.0)))
    # Two equal parts, one of 4 degrees of freedom: (2)²·4 = 16 effective ones
    assert combine(1.0, 4.0, [Normal(1.0)]).u95 == pytest.approx(
        exact * coverage_factor(16.0) / NORMAL_95, rel=1e-6
    )
