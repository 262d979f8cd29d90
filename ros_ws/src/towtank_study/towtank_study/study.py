# SPDX-License-Identifier: Apache-2.0
"""The schema of a study file. Quantities with a unit are written as in rig files."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from towtank_rig.quantity import Section, rig_fault

from towtank_study.simulation import Simulation
from towtank_study.tow_run import OUTPUTS

Distribution = Literal["uniform", "log_uniform", "triangular", "normal"]
Output = Literal[tuple(OUTPUTS)]  # type: ignore[valid-type]


class Linked(Section):
    """A path whose value follows a parameter's: factor · value + offset, in SI units."""

    path: str
    factor: float = 1.0
    offset: float = 0.0


class Parameter(Section):
    """One parameter: a dotted path into the rig file, or `simulation.` and a key of that section.

    Either `values` (a list), or `range` (lowest and highest, or `assumed` for the rig's own), or
    `mean` and `deviation` of a normal distribution; all in the SI unit of the path. mode: of a
    triangular distribution, by default the rig's value. levels: how many values a grid takes across
    the range (of a normal distribution its central 95 %). also: paths that follow.
    """

    path: str
    values: tuple[float | str, ...] | None = Field(default=None, min_length=1)
    range: tuple[float, float] | Literal["assumed"] | None = None
    distribution: Distribution = "uniform"
    mode: float | None = None
    mean: float | None = None
    deviation: Annotated[float, Field(gt=0)] | None = None
    levels: int = Field(default=9, ge=2, le=100_000)
    also: tuple[Linked, ...] = ()

    @model_validator(mode="after")
    def _one_way_of_saying(self) -> Self:
        normal = self.distribution == "normal"
        if normal and (self.mean is None or self.deviation is None):
            raise rig_fault("a normal distribution needs mean and deviation", "add them")
        if not normal and (self.mean, self.deviation) != (None, None):
            raise rig_fault("mean and deviation belong to a normal distribution", "remove them")
        if self.mode is not None and self.distribution != "triangular":
            raise rig_fault("a mode belongs to a triangular distribution", "remove it", at="mode")
        if [self.values is not None, self.range is not None, normal].count(True) != 1:
            raise rig_fault(
                "the values are not given in one way",
                "give either values, or range, or distribution normal with mean and deviation",
            )
        return self

    @property
    def paths(self) -> tuple[str, ...]:
        """All paths that it changes."""
        return (self.path, *(linked.path for linked in self.also))


class OneAtATime(Section):
    """Each parameter through its levels with all others at the rig's values, which come first."""

    kind: Literal["one_at_a_time"]


class FullFactorial(Section):
    """Every combination of the parameters' levels."""

    kind: Literal["full_factorial"]


class LatinHypercube(Section):
    """As many strata of equal probability as samples, each hit once by every parameter."""

    kind: Literal["latin_hypercube"]
    samples: int = Field(ge=1, le=10_000_000)
    seed: int = Field(default=1, ge=0)


class Sobol(Section):
    """Saltelli's scheme: samples · (parameters + 2) runs give first-order and total indices.

    samples: a power of two. resamples: bootstrap samples behind the indices' confidence (95 %).
    """

    kind: Literal["sobol"]
    samples: int = Field(ge=2, le=1_048_576)
    seed: int = Field(default=1, ge=0)
    resamples: int = Field(default=1000, ge=10, le=1_000_000)

    @model_validator(mode="after")
    def _power_of_two(self) -> Self:
        if self.samples & (self.samples - 1):
            raise rig_fault(
                f"{self.samples} is no power of two",
                f"take {1 << self.samples.bit_length()}",
                at="samples",
            )
        return self


class Limit(Section):
    """What an output must keep, in SI units: least, greatest, or both."""

    output: Output
    least: float | None = None
    greatest: float | None = None

    @model_validator(mode="after")
    def _some_limit(self) -> Self:
        if self.least is None and self.greatest is None:
            raise rig_fault("no limit is given", "give least, greatest, or both")
        if None not in (self.least, self.greatest) and self.least > self.greatest:  # type: ignore[operator]
            raise rig_fault("least is above greatest", "exchange them", at="least")
        return self


class Optimisation(Section):
    """The samples that minimise outputs and keep limits, found by a genetic algorithm.

    minimise: one output, or several: then the trade-off between them is sought. population: samples
    of a generation.
    """

    kind: Literal["optimisation"]
    minimise: tuple[Output, ...] = Field(min_length=1, max_length=3)
    limits: tuple[Limit, ...] = ()
    population: int = Field(default=40, ge=4, le=10_000)
    generations: int = Field(default=30, ge=2, le=10_000)
    seed: int = Field(default=1, ge=0)

    @property
    def outputs(self) -> tuple[str, ...]:
        """All outputs that it looks at."""
        return tuple(dict.fromkeys([*self.minimise, *(limit.output for limit in self.limits)]))


Design = Annotated[
    OneAtATime | FullFactorial | LatinHypercube | Sobol | Optimisation, Field(discriminator="kind")
]


class Reference(Section):
    """A value, or a band, of an output to be shown beside what the study finds."""

    output: Output
    label: str
    value: float | None = None
    band: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _value_or_band(self) -> Self:
        if (self.value is None) == (self.band is None):
            raise rig_fault("neither one value nor one band", "give value or band, in SI units")
        return self


class Plot(Section):
    """Outputs over one column, a parameter or an output.

    by: a parameter of whose values each gets a curve. In a grid all further parameters keep their
    first values.
    """

    x: str
    y: tuple[Output, ...] = Field(min_length=1)
    by: str | None = None
    logarithmic: bool = False


class Study(Section):
    """One study file.

    rig: name of a rig that comes with the project, or a path relative to the study file.
    changes: what the whole study changes in the rig, path to value as `replaced` takes it.
    statement: what somebody said about it, shown beside what is found. histories: numbers of the
    samples of which heave, pitch and tension are kept over time.
    """

    name: str = Field(pattern=r"^[\w.-]+$")
    description: str
    rig: str
    changes: dict[str, float | str] = Field(default={})
    parameters: tuple[Parameter, ...] = Field(min_length=1)
    design: Design
    simulation: Simulation = Simulation()
    outputs: tuple[Output, ...] = tuple(OUTPUTS)
    statement: str = ""
    references: tuple[Reference, ...] = ()
    plots: tuple[Plot, ...] = ()
    histories: tuple[Annotated[int, Field(ge=0)], ...] = ()

    @model_validator(mode="after")
    def _names_fit(self) -> Self:
        changed = [path for parameter in self.parameters for path in parameter.paths]
        for path in changed:
            if changed.count(path) > 1:
                raise rig_fault(f"{path} is changed twice", "name each path once", at="parameters")
        if isinstance(self.design, Optimisation):
            for name in self.design.outputs:
                if name not in self.outputs:
                    raise rig_fault(
                        f"{name} is to be optimised or kept and not among the outputs",
                        "add it to outputs",
                        at="outputs",
                    )
        paths = {parameter.path for parameter in self.parameters}
        for index, plot in enumerate(self.plots):
            for column in (plot.x, *plot.y):
                if column not in paths | set(self.outputs):
                    raise rig_fault(
                        f"{column!r} is neither a parameter nor among the outputs",
                        "correct it, or add it to outputs",
                        at=f"plots.{index}",
                    )
            if plot.by is not None and plot.by not in paths:
                raise rig_fault(f"{plot.by!r} is no parameter", "name one", at=f"plots.{index}.by")
        return self
