# SPDX-License-Identifier: Apache-2.0
"""Arguments are refused by name, in one line: not finite, missing, misspelt, of a wrong type."""

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping

import numpy as np
import pytest
from test_descriptions import CABLE, FISH, MOTIONS, PARTS, TOW

import sim_core as sc
from sim_core import _core

MOTION = MOTIONS[0]
VALUES = [
    *(part for part in PARTS if not isinstance(part, sc.System)),
    sc.Contact(place="point 'a'", side="floor", position=(0, 0, -3), time=1.0, released=2.0),
    sc.Joint("tow_point", "depressor", stiffness=1e5, damping=10.0),
    sc.Current(uniform=(0.1, 0, 0), profile=[(-2.0, (0, 0, 0)), (0.0, (0.2, 0, 0))]),
    sc.Part(mass=1.0, volume=1e-3, centre=(0.1, 0, 0), inertia=np.eye(3)),
]
# What the library makes, and what holds parts that are checked themselves
NOT_DESCRIBED = {"Model", "ModelBuilder", "Simulator", "State", "System", "PrescribedPoint"}
NOT_DESCRIBED |= {"InvalidInput", "ConvergenceError", "Integrator", "Motion", "Payout"}
NOT_DESCRIBED |= {"Energy", "EnergyBalance", "MomentumBalance", "MotionSample", "PayoutSample"}
NOT_DESCRIBED |= {"BodyHistory", "LineHistory", "PlaceHistory", "PointHistory", "Result", "Snap"}
NOT_DESCRIBED |= {"LambCoefficients", "MassProperties", "MoorDynDeck", "StaticStability"}
NOT_DESCRIBED |= {"WaterMotion"}


def named(value):
    return type(value).__name__


def values_of(part) -> dict[str, object]:
    if dataclasses.is_dataclass(part):
        return {f.name: getattr(part, f.name) for f in dataclasses.fields(part)}
    return {n: getattr(part, n) for n, v in vars(type(part)).items() if isinstance(v, property)}


def changed(part, **values):
    if not hasattr(part, "replace"):
        return dataclasses.replace(part, **values)
    return part.replace(**values)


def spoilt(value, bad: float) -> Iterator[object]:
    """Copies of a value, each with another of its numbers replaced."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        yield bad
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from ({**value, key: other} for other in spoilt(item, bad))
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            yield from ([*value[:i], other, *value[i + 1 :]] for other in spoilt(item, bad))


def test_every_class_that_describes_something_is_among_the_examples():
    classes = {name for name in sc.__all__ if isinstance(getattr(sc, name), type)}
    assert classes - NOT_DESCRIBED == {named(value) for value in VALUES}


@pytest.mark.parametrize("value", VALUES, ids=named)
def test_what_is_not_finite_is_refused_by_name(value):
    for name, held in values_of(value).items():
        for bad in (math.nan, math.inf, -math.inf):
            if bad == math.inf and name in ("depth", "released", "aspect_ratio"):
                continue
            for other in spoilt(held, bad):
                with pytest.raises(sc.InvalidInput, match=rf"^{named(value)}: {name}\b"):
                    changed(value, **{name: other})


def test_functions_refuse_what_is_not_finite():
    with pytest.raises(sc.InvalidInput, match="jonswap_sea: peak_period must be finite, not nan"):
        sc.jonswap_sea(significant_height=1.0, peak_period=math.nan)
    with pytest.raises(sc.InvalidInput, match="run: t_end must be finite, not inf"):
        sc.run(TOW.build(), MOTION, t_end=math.inf)
    builder = sc.ModelBuilder()
    with pytest.raises(sc.InvalidInput, match="add_free_point: volume must be finite, not nan"):
        builder.add_free_point("float", volume=math.nan)


FISH_VALUES = {name: getattr(FISH, name) for name in ("mass", "inertia", "volume", "diameter")}
CABLE_VALUES = {"length": 1.0, "diameter": 0.01, "mass_per_length": 0.1}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sc.Body(**FISH_VALUES, length=1.0), "Body needs axial_drag, cross_flow_drag"),
        (
            lambda: sc.LineProperties(**CABLE_VALUES, axial_stifness=1e5),
            "LineProperties has no 'axial_stifness': did you mean 'axial_stiffness'?",
        ),
        (
            lambda: sc.LineProperties(**CABLE_VALUES | {"length": "3"}, axial_stiffness=1e5),
            "LineProperties cannot take '3' as length: float",
        ),
        (
            lambda: sc.Body(**FISH_VALUES, length=1, axial_drag=0, cross_flow_drag=1, fins=[3]),
            "Body cannot take [3] as fins: Sequence[Fin]",
        ),
        (
            lambda: FISH.replace(centre_of_gravity=(0, 0)),
            "Body cannot take centre_of_gravity=(0, 0)",
        ),
        (lambda: sc.Water(current=(1, 0)), "Water cannot take current=(1, 0)"),
        (lambda: sc.Water(1025.0), "Water takes all by name"),
        (
            lambda: sc.Water(salinity=0.03),
            "Water has no 'salinity', it has density, gravity, current, waves, kinematic_viscosity",
        ),
        (lambda: sc.HHT(alfa=-0.1), "HHT has no 'alfa': did you mean 'alpha'?"),
        (
            lambda: sc.steady_tow(TOW.build(), positon=(0, 0, 0)),
            "steady_tow has no 'positon': did you mean 'position'?",
        ),
        (
            lambda: sc.ModelBuilder().add_line("a", "b", "c", CABLE, segments=2.5),
            "add_line cannot take 2.5 as segments: int",
        ),
        (
            lambda: sc.run(TOW.build(), MOTION, t_end=1.0, integrator="newmark"),
            "Simulator cannot take 'newmark' as integrator: Integrator | None",
        ),
    ],
)
def test_the_argument_that_does_not_fit_is_named(call, message):
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        call()


def test_refusals_cost_stepping_nothing():
    """What is called in every step is as the library has it."""
    for name in ("step", "step_to", "tensions", "body_position"):
        assert type(vars(sc.Simulator)[name]) is type(vars(_core.State)["copy"])
