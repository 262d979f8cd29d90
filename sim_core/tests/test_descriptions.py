# SPDX-License-Identifier: Apache-2.0
"""Descriptions are values: compared, copied, changed, pickled, and built into models."""

import copy
import pickle
import re

import pytest

import sim_core as sc

CABLE = sc.LineProperties(length=3.0, diameter=0.01, mass_per_length=0.2, axial_stiffness=6e5)
FIN = sc.Fin(position=(-0.5, 0, 0), normal=(0, 0, 1), area=0.01, lift_slope=3.0)
HULL = sc.HullTable(
    attack=(-0.5, 0, 0.5), sideslip=(-0.5, 0, 0.5), coefficients=[[(0.3,) * 6] * 3] * 3,
    area=0.01, length=1.0,
)  # fmt: skip
FISH = sc.Body(
    mass=5.0, inertia=(0.1, 0.5, 0.5), volume=5e-3, diameter=0.1, length=1.0,
    axial_drag=0.3, cross_flow_drag=1.1, fins=[FIN, FIN],
    downwash=[sc.Downwash(front=0, rear=1, slope=0.4)], places={"nose": (0.5, 0, 0)},
)  # fmt: skip
TOW = sc.System(
    water=sc.Water(density=1025.0),
    tank=sc.Tank(floor=-4.0, stiffness=1e4),
    points={"tow_point": sc.PrescribedPoint(), "depressor": sc.FreePoint(mass=6.2, volume=7e-4)},
    bodies={"fish": FISH},
    lines={
        "cable": sc.Line("tow_point", "depressor", CABLE, segments=4),
        "tail": sc.SectionedLine(
            "depressor", "fish", sections=((CABLE, 2), (CABLE, 1)), attachment=(0.5, 0, 0)
        ),
    },
)
PARTS = [
    sc.Water(density=1025.0, current=(0.1, 0, 0)),
    sc.Water(
        current=sc.Current(series=[(0.0, (0.1, 0, 0)), (1.0, (0.2, 0, 0))]),
        waves=sc.regular_waves(height=0.1, period=1.5, depth=3.0),
    ),
    sc.Tank(floor=-3.0, width=2.0, ends=(0.0, 80.0), stiffness=1e4),
    CABLE,
    FIN,
    FISH.downwash[0],
    HULL,
    FISH,
    FISH.replace(hull_table=HULL, axial_drag=0.0, munk_moment=0.0),
    sc.FreePoint(mass=1.0, drag_area=(0.1, 0.2, 0.3)),
    sc.Weathervane(mass=5.0, volume=1e-3, drag_area=(0.01, 0.1, 0.02)),
    *TOW.lines.values(),
    TOW,
]


def named(part):
    return type(part).__name__


@pytest.mark.parametrize("part", PARTS, ids=named)
def test_copies_are_equal(part):
    for twin in (copy.copy(part), copy.deepcopy(part), pickle.loads(pickle.dumps(part))):
        assert twin == part
        assert repr(twin) == repr(part)
    assert part != "something else"


@pytest.mark.parametrize("part", PARTS[:-1], ids=named)
def test_a_part_prints_as_it_is_made(part):
    assert eval(repr(part), vars(sc)) == part
    assert hash(eval(repr(part), vars(sc))) == hash(part)


@pytest.mark.parametrize(
    "cls", [sc.Water, sc.LineProperties, sc.Fin, sc.Downwash, sc.HullTable, sc.Body]
)
def test_compiled_parts_show_all_that_they_are_made_of(cls):
    """Copies rely on it: what could not be read back would be lost."""
    signature = cls.__init__.__nb_signature__[0][0]
    values = {name for name, value in vars(cls).items() if isinstance(value, property)}
    assert set(re.findall(r"(\w+):", signature)) == values


def test_a_changed_part_is_another():
    longer = CABLE.replace(length=4.0)
    assert (longer.length, longer.diameter, CABLE.length) == (4.0, 0.01, 3.0)
    assert longer != CABLE
    assert longer.replace(length=3.0) == CABLE
    assert sc.FreePoint(mass=1.0).replace(volume=1e-3) == sc.FreePoint(mass=1.0, volume=1e-3)


@pytest.mark.parametrize("part", PARTS[:-1], ids=named)
def test_an_unknown_value_is_named(part):
    with pytest.raises(sc.InvalidInput, match=f"{type(part).__name__} has no 'lenght', it has "):
        part.replace(lenght=1.0)


def test_paths_change_what_they_name_and_nothing_else():
    changed = TOW.replace(
        {
            "water.density": 1000.0,
            "lines.cable.properties.length": 5.0,
            "lines.cable.segments": 9,
            "bodies.fish.fins.1.area": 0.02,
            "points.depressor": sc.Weathervane(mass=6.2, volume=7e-4, drag_area=(0.1, 0.2, 0.1)),
        }
    )
    assert changed.water == sc.Water()
    assert changed.lines["cable"] == sc.Line(
        "tow_point", "depressor", CABLE.replace(length=5.0), segments=9
    )
    assert changed.bodies["fish"].fins == [FIN, FIN.replace(area=0.02)]
    assert isinstance(changed.points["depressor"], sc.Weathervane)
    assert changed.lines["tail"] == TOW.lines["tail"]
    assert TOW.lines["cable"].segments == 4, "the original stays"


def test_a_part_can_be_added():
    more = TOW.replace(
        {
            "points.float": sc.FreePoint(volume=1e-3, mass=0.1),
            "lines.float_line": sc.Line("depressor", "float", CABLE, segments=2),
        }
    )
    assert more.build().lines == ["cable", "tail", "float_line"]
    assert list(TOW.lines) == ["cable", "tail"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("line.cable", "line.cable: System has no 'line'"),
        ("bodys", "bodys: System has no 'bodys', it has water, points, bodies, lines"),
        ("lines.cabel.segments", "there is no 'cabel', but cable, tail"),
        ("lines.cable.lenght", "Line has no 'lenght', it has start, end"),
        ("lines.cable.properties.lenght", "LineProperties has no 'lenght', it has length"),
        ("bodies.fish.fins.2.area", "there is no '2' in 2 of them"),
        ("lines.cable.properties.length.unit", "a float has no parts"),
    ],
)
def test_wrong_paths_are_named(path, message):
    with pytest.raises(sc.InvalidInput, match=message):
        TOW.replace({path: 1.0})


def test_builds_the_model_that_the_builder_makes():
    b = sc.ModelBuilder(sc.Water(density=1025.0))
    b.set_tank(sc.Tank(floor=-4.0, stiffness=1e4))
    b.add_prescribed_point("tow_point")
    b.add_free_point("depressor", mass=6.2, volume=7e-4)
    b.add_body("fish", FISH)
    b.add_line("cable", "tow_point", "depressor", CABLE, segments=4)
    sections = ((CABLE, 2), (CABLE, 1))
    b.add_line("tail", "depressor", "fish", sections=sections, attachment=(0.5, 0, 0))
    tows = [
        sc.steady_tow(model, position=(0, 0, -1), velocity=(1, 0, 0))
        for model in (b.build(), TOW.build())
    ]
    assert tows[0].save() == tows[1].save()


def test_a_model_tells_its_description(nit_model):
    assert sc.System.of(TOW.build()) == TOW
    vane = sc.Weathervane(mass=5.0, volume=1e-3, drag_area=(0.01, 0.1, 0.02), turning_speed=0.1)
    other = TOW.replace(
        {
            "points.depressor": vane,
            "points.junction": sc.FreePoint(drag_area=(0.1, 0.2, 0.3), added_mass=0.5),
            "lines.second": sc.SectionedLine(
                "fish",
                "junction",
                sections=((CABLE.replace(bending_stiffness=0.1), 2), (CABLE, 3)),
                start_attachment=(-0.5, 0, 0),
                start_direction=(1, 0, 0),
            ),
        }
    )
    assert sc.System.of(other.build()) == other
    stretched = sc.System.of(nit_model()).replace({"lines.primary.properties.length": 1.4})
    assert stretched.build().unknowns == nit_model().unknowns
    sections = other.replace({"lines.second.sections.1.0.length": 4.0}).lines["second"].sections
    assert [properties.length for properties, _ in sections] == [3.0, 4.0]


def test_impossible_parts_are_refused_where_they_are_built():
    with pytest.raises(sc.InvalidInput, match="line 'cable': length"):
        TOW.replace({"lines.cable.properties.length": -1.0}).build()
    with pytest.raises(sc.InvalidInput, match="point 'tow_point' is a float"):
        TOW.replace({"points.tow_point": 1.0}).build()
