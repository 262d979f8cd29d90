# SPDX-License-Identifier: Apache-2.0
"""Designs of experiments: which samples of its parameters a study takes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import SALib.sample.sobol
from scipy.stats import qmc

from towtank_study.study import Design, FullFactorial, LatinHypercube, OneAtATime, Sobol
from towtank_study.variables import Value, Variable

Sample = dict[str, Value]
"""The parameters' values by path."""


def samples(design: Design, variables: Sequence[Variable]) -> list[Sample]:
    """Return the samples of a design in its order, the same ones for the same seed."""
    match design:
        case OneAtATime():
            return one_at_a_time(variables)
        case FullFactorial():
            return full_factorial(variables)
        case LatinHypercube():
            # One shift in each stratum, McKay, Beckman & Conover (1979).
            sampler = qmc.LatinHypercube(len(variables), rng=np.random.default_rng(design.seed))
            return from_unit_cube(sampler.random(design.samples), variables)
        case Sobol():
            return from_unit_cube(saltelli(design, len(variables)), variables)


def one_at_a_time(variables: Sequence[Variable]) -> list[Sample]:
    """The rig's own values, then each variable through its levels."""
    base = {variable.path: variable.base for variable in variables}
    changed = [
        base | {variable.path: level}
        for variable in variables
        for level in variable.levels
        if level != variable.base
    ]
    return [base, *changed]


def full_factorial(variables: Sequence[Variable]) -> list[Sample]:
    """All combinations of levels, the last variable changing fastest."""
    paths = [variable.path for variable in variables]
    return [
        dict(zip(paths, combination, strict=True))
        for combination in itertools.product(*(variable.levels for variable in variables))
    ]


def from_unit_cube(points: np.ndarray, variables: Sequence[Variable]) -> list[Sample]:
    """Turn points of the unit cube, shape (samples, variables), into samples by quantiles."""
    columns = [variable.quantile(points[:, index]) for index, variable in enumerate(variables)]
    paths = [variable.path for variable in variables]
    return [dict(zip(paths, row, strict=True)) for row in zip(*columns, strict=True)]


def unit_problem(dimensions: int) -> dict[str, object]:
    """SALib's description of the unit cube."""
    return {
        "num_vars": dimensions,
        "names": [str(i) for i in range(dimensions)],
        "bounds": [[0.0, 1.0]] * dimensions,
    }


def saltelli(design: Sobol, dimensions: int) -> np.ndarray:
    """Points of Saltelli's scheme, shape (samples·(dimensions + 2), dimensions), in blocks of
    dimensions + 2: a point, with one coordinate after another exchanged, the point to exchange
    with (Saltelli et al., Comput. Phys. Commun. 181, 2010). The sequence is scrambled."""
    return SALib.sample.sobol.sample(
        unit_problem(dimensions),
        design.samples,
        calc_second_order=False,
        scramble=True,
        seed=design.seed,
    )
