# SPDX-License-Identifier: Apache-2.0
"""Numbers that are not finite are refused before anything is computed, by the name of the value."""

import math

import pytest

import sim_core as sc

FIN = sc.Fin(
    position=(-0.5, 0.0, 0.0),
    normal=(0.0, 0.0, 1.0),
    area=0.01,
    lift_slope=3.0,
    drag=0.01,
    stall_angle=0.4,
    cross_flow_drag=1.2,
)
BODY = sc.Body(
    mass=5.0,
    inertia=(0.1, 0.5, 0.5),
    volume=5e-3,
    diameter=0.1,
    length=1.0,
    axial_drag=0.3,
    cross_flow_drag=1.1,
    fins=[FIN],
)
WIRE = sc.LineProperties(
    length=1.0,
    diameter=0.01,
    mass_per_length=0.1,
    axial_stiffness=1e5,
    axial_damping=1.0,
    normal_drag=1.2,
    tangential_drag=0.01,
    added_mass=1.0,
    slack_tension=0.1,
    displaced_area=1e-4,
)
WATER = sc.Water(density=1000.0)
TANK = sc.Tank(floor=-3.0, width=2.0, ends=(0.0, 80.0), stiffness=1e4)


def build(body=BODY, wire=WIRE, water=WATER, tank=TANK):
    system = sc.System(
        water=water,
        tank=tank,
        points={"top": sc.PrescribedPoint()},
        bodies={"fish": body},
        lines={"wire": sc.Line("top", "fish", wire, segments=2)},
    )
    return system.build()


BUILD = {
    "Body": lambda part: build(body=part),
    "Fin": lambda part: build(body=BODY.replace(fins=[part])),
    "LineProperties": lambda part: build(wire=part),
    "Water": lambda part: build(water=part),
    "Tank": lambda part: build(tank=part),
}
MAY_BE_INFINITE = {("Fin", "aspect_ratio", math.inf)}  # no induced drag


def plain(value):
    return value.tolist() if hasattr(value, "tolist") else value


def spoilt(value, bad):
    """A value with each of its numbers spoilt in turn; whole numbers are counts."""
    value = plain(value)
    if isinstance(value, list | tuple):
        for i, item in enumerate(value):
            yield from (type(value)([*value[:i], x, *value[i + 1 :]]) for x in spoilt(item, bad))
    elif isinstance(value, float):
        yield bad


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("part", [BODY, FIN, WIRE, WATER, TANK], ids=lambda p: type(p).__name__)
def test_every_number_that_is_not_finite_is_refused_by_name(part, bad):
    kind = type(part).__name__
    names = [name for name, value in vars(type(part)).items() if isinstance(value, property)]
    tried = 0
    for name in names:
        if (kind, name, bad) in MAY_BE_INFINITE:
            continue
        for value in spoilt(getattr(part, name), bad):
            with pytest.raises(sc.InvalidInput) as refused:
                BUILD[kind](part.replace(**{name: value}))
            said = str(refused.value)
            assert name in said or name.replace("_", " ") in said, (name, said)
            tried += 1
    assert tried > 3
