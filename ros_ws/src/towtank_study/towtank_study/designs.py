# SPDX-License-Identifier: Apache-2.0
"""Designs of experiments: which samples of its parameters a study takes."""

from __future__ import annotations

import itertools
from collections.abc import Generator, Sequence

import numpy as np
from scipy.stats import qmc

from towtank_study.evaluation import Outcome
from towtank_study.optimisation import propose
from towtank_study.study import (
    Design,
    FullFactorial,
    LatinHypercube,
    OneAtATime,
    Optimisation,
    Sobol,
)
from towtank_study.variables import Value, Variable, from_unit_cube

Sample = dict[str, Value]
"""The parameters' values by path."""


def batches(
    design: Design, variables: Sequence[Variable]
) -> Generator[list[Sample], list[Outcome], None]:
    """Yield the samples of a design in its order, the same ones for the same seed.

    Samples of one batch depend on nothing but the batches before; send the outcomes of each batch.
    """
    if isinstance(design, Optimisation):
        yield from propose(design, variables)
    else:
        yield samples(design, variables)


def most_samples(design: Design, variables: Sequence[Variable]) -> int:
    """Return how many samples a design takes; an optimisation may run out of new ones before."""
    if isinstance(design, Optimisation):
        return design.population * design.generations
    return len(samples(design, variables))


def samples(
    design: OneAtATime | FullFactorial | LatinHypercube | Sobol, variables: Sequence[Variable]
) -> list[Sample]:
    """Return the samples of a design that does not wait for outcomes."""
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
    import SALib.sample.sobol  # a second for pandas, which other designs need not spend

    return SALib.sample.sobol.sample(
        unit_problem(dimensions),
        design.samples,
        calc_second_order=False,
        scramble=True,
        seed=design.seed,
    )
