# SPDX-License-Identifier: Apache-2.0
"""Designs: inside their bounds, stratified, the same for the same seed."""

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_study.designs import from_unit_cube, full_factorial, one_at_a_time, saltelli, samples
from towtank_study.study import LatinHypercube, Sobol
from towtank_study.variables import Variable

SHAPES = {
    "uniform": lambda low, width: scipy.stats.uniform(low, width),
    "log_uniform": lambda low, width: scipy.stats.loguniform(low, low + width),
    "triangular": lambda low, width: scipy.stats.triang(0.3, low, width),
}


def variable(name: str, shape: str = "uniform", low: float = 1.0, width: float = 2.0) -> Variable:
    distribution = SHAPES[shape](low, width)
    return Variable(name, "m", low, (low, low + width), distribution)


some_variables = st.lists(
    st.tuples(st.sampled_from(sorted(SHAPES)), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3)),
    min_size=1,
    max_size=5,
).map(lambda given: [variable(f"v{i}", *arguments) for i, arguments in enumerate(given)])


@settings(max_examples=25)
@given(variables=some_variables, count=st.integers(1, 40), seed=st.integers(0, 2**31))
def test_a_latin_hypercube_hits_each_stratum_of_each_variable_once(variables, count, seed):
    found = samples(LatinHypercube(kind="latin_hypercube", samples=count, seed=seed), variables)
    assert len(found) == count
    for each in variables:
        values = np.array([sample[each.path] for sample in found])
        low, high = each.distribution.support()
        assert np.all((values >= low) & (values <= high))
        # The i-th smallest lies between i and i + 1 strata; ppf and cdf round by some 1e-12.
        places = each.distribution.cdf(np.sort(values)) * count - np.arange(count)
        assert np.all((places > -1e-9) & (places < 1 + 1e-9))


@settings(max_examples=10)
@given(dimensions=st.integers(1, 6), power=st.integers(1, 5), seed=st.integers(0, 2**31))
def test_blocks_of_the_sobol_design(dimensions, power, seed):
    """A point, then each coordinate exchanged for that of the last point (Saltelli's scheme)."""
    design = Sobol(kind="sobol", samples=2**power, seed=seed)
    blocks = saltelli(design, dimensions).reshape(2**power, dimensions + 2, dimensions)
    assert np.all((blocks >= 0) & (blocks < 1))
    for i in range(dimensions):
        expected = blocks[:, 0].copy()
        expected[:, i] = blocks[:, -1, i]
        assert np.array_equal(blocks[:, 1 + i], expected)
        # Balanced: a Sobol sequence has one point in each of 2^power equal intervals.
        strata = np.sort(np.floor(blocks[:, 0, i] * 2**power))
        assert np.array_equal(strata, np.arange(2**power))


@pytest.mark.parametrize(
    "design",
    [
        LatinHypercube(kind="latin_hypercube", samples=10, seed=3),
        Sobol(kind="sobol", samples=8, seed=3),
    ],
)
def test_the_seed_determines_a_design(design):
    variables = [variable("a"), variable("b", "log_uniform")]
    assert samples(design, variables) == samples(design, variables)
    other = design.model_copy(update={"seed": 4})
    assert samples(design, variables) != samples(other, variables)


def test_one_at_a_time_begins_with_the_rig_and_changes_one():
    a = Variable("a", "m", 2.0, (1.0, 2.0, 3.0), None)
    b = Variable("b", "1", "x", ("x", "y"), None)
    assert one_at_a_time([a, b]) == [
        {"a": 2.0, "b": "x"},
        {"a": 1.0, "b": "x"},
        {"a": 3.0, "b": "x"},
        {"a": 2.0, "b": "y"},
    ]


@given(counts=st.lists(st.integers(1, 4), min_size=1, max_size=4))
def test_a_full_factorial_has_every_combination_once(counts):
    variables = [
        Variable(f"v{i}", "1", 0, tuple(range(count)), None) for i, count in enumerate(counts)
    ]
    found = [tuple(sample.values()) for sample in full_factorial(variables)]
    assert len(found) == len(set(found)) == np.prod(counts)


def test_listed_values_are_drawn_alike():
    listed = Variable("v", "1", 0, ("a", "b", "c", "d"), None)
    points = np.linspace(0, 1, 400, endpoint=False)[:, None]
    drawn = [sample["v"] for sample in from_unit_cube(points, [listed])]
    assert {value: drawn.count(value) for value in "abcd"} == dict.fromkeys("abcd", 100)


def test_a_normal_distribution_stays_finite_at_the_ends():
    normal = Variable("v", "m", 0.0, (-1.96, 1.96), scipy.stats.norm(0.0, 1.0))
    assert np.all(np.isfinite(normal.quantile([0.0, 0.5, 1.0])))
    assert normal.quantile(0.975 * np.ones(1))[0] == pytest.approx(1.959964, abs=1e-6)
