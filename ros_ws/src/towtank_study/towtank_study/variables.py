# SPDX-License-Identifier: Apache-2.0
"""The parameters of a study on its rig: their values, units and distributions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel
from towtank_rig import Quantity, Rig

from towtank_study.loading import StudyFile
from towtank_study.study import Parameter, Simulation

Value = float | int | str
CENTRAL_95 = (0.025, 0.975)


@dataclass(frozen=True)
class Variable:
    """A parameter on its rig.

    path: into the rig, or `simulation.…`. unit: SI, `1` for plain numbers and text. base: the value
    where the study changes nothing. levels: values of a grid. distribution: frozen scipy.stats
    distribution, None where only the levels are possible, all alike.
    """

    path: str
    unit: str
    base: Value
    levels: tuple[Value, ...]
    distribution: Any | None

    def quantile(self, probability: ArrayLike) -> list[Value]:
        """Return the values below which lie these shares (0 … 1) of the distribution."""
        share: NDArray[np.float64] = np.asarray(probability, dtype=float)
        if self.distribution is None:
            places = np.minimum((share * len(self.levels)).astype(int), len(self.levels) - 1)
            return [self.levels[place] for place in places]
        # A normal distribution has no end: 0 and 1 are rounded values of numbers between.
        inside = np.clip(share, 1e-12, 1 - 1e-12)
        return [float(value) for value in self.distribution.ppf(inside)]


def from_unit_cube(points: np.ndarray, variables: Sequence[Variable]) -> list[dict[str, Value]]:
    """Turn points of the unit cube, shape (samples, variables), into samples by quantiles."""
    columns = [variable.quantile(points[:, index]) for index, variable in enumerate(variables)]
    paths = [variable.path for variable in variables]
    return [dict(zip(paths, row, strict=True)) for row in zip(*columns, strict=True)]


def variables(file: StudyFile, rig: Rig) -> list[Variable]:
    """Return the study's parameters on its rig; StudyError where a path or a range is none."""
    return [
        _variable(file, rig, parameter, f"parameters.{index}")
        for index, parameter in enumerate(file.study.parameters)
    ]


def value_at(root: BaseModel, path: str) -> Any:
    """Return what a model holds at a dotted path (names of the file, numbers in lists).

    KeyError if there is nothing.
    """
    node: Any = root
    for key in path.split("."):
        if isinstance(node, BaseModel) and not isinstance(node, Quantity):
            fields = {field.alias or name: name for name, field in type(node).model_fields.items()}
            node = getattr(node, fields[key])
        elif isinstance(node, tuple) and key.isdigit() and int(key) < len(node):
            node = node[int(key)]
        else:
            raise KeyError(path)
    return node


def holder(rig: Rig, simulation: Simulation, path: str) -> tuple[BaseModel, str]:
    """Return the model that a parameter's path lies in, and the path within it."""
    section, _, rest = path.partition(".")
    return (simulation, rest) if section == "simulation" else (rig, path)


def _variable(file: StudyFile, rig: Rig, parameter: Parameter, where: str) -> Variable:
    found = {}
    for path in parameter.paths:
        try:
            found[path] = value_at(*holder(rig, file.study.simulation, path))
        except KeyError:
            raise file.error(where, f"the rig has no {path}", "correct the path") from None
        if not isinstance(found[path], (Quantity, int, float, str)):
            raise file.error(where, f"{path} is a section", "name a value in it")
    at = found[parameter.path]
    unit = at.unit if isinstance(at, Quantity) else "1"
    base = at.value if isinstance(at, Quantity) else at
    if parameter.values is not None:
        return Variable(parameter.path, unit, base, parameter.values, None)
    if isinstance(base, str):
        raise file.error(where, f"{parameter.path} is text", "give its values")
    distribution = _distribution(file, parameter, at, base, where)
    low, high = distribution.ppf([0.0, 1.0])
    if parameter.distribution == "normal":
        low, high = distribution.ppf(CENTRAL_95)
    space = np.geomspace if parameter.distribution == "log_uniform" else np.linspace
    levels = tuple(float(value) for value in space(low, high, parameter.levels))
    return Variable(parameter.path, unit, base, levels, distribution)


def _distribution(file: StudyFile, parameter: Parameter, at: Any, base: float, where: str) -> Any:
    if parameter.distribution == "normal":
        return scipy.stats.norm(parameter.mean, parameter.deviation)
    limits = parameter.range
    if limits == "assumed":
        limits = at.range if isinstance(at, Quantity) else None
        if limits is None:
            raise file.error(where, f"{parameter.path} has no range in the rig", "give a range")
    assert isinstance(limits, tuple)
    low, high = limits
    if not low < high:
        raise file.error(where, f"range [{low:g}, {high:g}] is empty", "put the lower first")
    match parameter.distribution:
        case "log_uniform":
            if low <= 0.0:
                raise file.error(where, "a logarithmic range must be positive", "raise its limits")
            return scipy.stats.loguniform(low, high)
        case "triangular":
            mode = base if parameter.mode is None else parameter.mode
            if not low <= mode <= high:
                raise file.error(where, f"the mode {mode:g} lies outside the range", "give another")
            return scipy.stats.triang((mode - low) / (high - low), low, high - low)
        case _:
            return scipy.stats.uniform(low, high - low)
