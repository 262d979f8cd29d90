# SPDX-License-Identifier: Apache-2.0
"""Descriptions are values: compared, copied, changed, pickled, and built into models."""

import copy
import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

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
SEA = sc.regular_waves(height=0.1, period=1.5, depth=3.0)
OPERATORS = sc.ResponseOperators(
    frequency=(3.0, 5.0), heading=(0.0, 3.0), amplitude={"heave": [(1.0, 0.5), (0.9, 0.3)]}
)
MOTIONS = [
    sc.SteadyTow(position=(0, 0, -1), velocity=(1, 0, 0), run_up_time=2.0),
    sc.EmergencyStop(position=(0, 0, -1), velocity=(3, 1, 0), stop_time=4.0, stopping_distance=0.7),
    sc.Turn(position=(0, 0, -1), velocity=(1, 0, 0), start_time=1.0, angle=2.0, circle_time=47.0),
    sc.Sinusoid(mean=(0, 0, -1), amplitude=0.1, period=1.7, phase=0.3, ramp_time=1.0),
    sc.SliderCrank(mean=(0, 0, -1), crank_radius=0.1, rod_length=0.3, period=1.7, phase=0.3),
    sc.TimeSeries(
        time=[0.0, 1.0], position=[(0, 0, -1), (1, 0, -1)], velocity=[(1, 0, 0), (1, 0, 0.1)]
    ),
    sc.ShipInSea(position=(0, 0, -1), sea=SEA, operators=OPERATORS, arm=(-5.0, 0, 2.0)),
]
MOTIONS.append(MOTIONS[0] + MOTIONS[3])
PAYOUTS = [
    sc.SteadyPayout(start_length=1.0, end_length=2.0, rate=0.3, start_time=0.1, ramp_time=0.2),
    sc.PayoutSeries([(0.0, 1.0), (1.0, 1.5), (3.0, 1.7)]),
]
INTEGRATORS = [
    sc.ForwardEuler(), sc.BackwardEuler(), sc.Newmark(beta=0.35, gamma=0.6), sc.HHT(alpha=-0.2),
    sc.GeneralizedAlpha(rho_inf=0.6), sc.SingleStepHoubolt(gamma_1=1.2), sc.Box(),
]  # fmt: skip
assert {type(one) for one in INTEGRATORS} == set(sc.INTEGRATORS.values())
LAWS = [*MOTIONS, *PAYOUTS, *INTEGRATORS]
PARTS[:0] = [*LAWS, SEA, OPERATORS]


def named(part):
    return type(part).__name__


@pytest.mark.parametrize("part", PARTS, ids=named)
def test_copies_are_equal(part):
    for twin in (copy.copy(part), copy.deepcopy(part), pickle.loads(pickle.dumps(part))):
        assert twin == part
        assert repr(twin) == repr(part)
    assert part != "something else"


@pytest.mark.parametrize("base", [sc.Motion, sc.Payout, sc.Integrator])
def test_no_law_is_left_out(base):
    public = {
        value
        for value in vars(sc).values()
        if isinstance(value, type) and issubclass(value, base) and value is not base
    }
    assert public == {type(law) for law in LAWS if isinstance(law, base)}


@pytest.mark.parametrize("law", [*MOTIONS, *PAYOUTS], ids=named)
def test_a_pickled_law_says_the_same_to_the_last_bit(law):
    twin = pickle.loads(pickle.dumps(law))
    for time in (0.0, 0.3, 1.1, 4.2, 9.0):
        mine, its = law(time), twin(time)
        for name in [n for n, v in vars(type(mine)).items() if isinstance(v, property)]:
            assert repr(getattr(mine, name)) == repr(getattr(its, name))


@pytest.mark.parametrize("law", LAWS, ids=named)
def test_laws_of_other_values_differ(law):
    assert law not in [other for other in LAWS if other is not law]
    for name, value in vars(type(law)).items():
        if isinstance(value, property) and isinstance(value.fget(law), float):
            assert law.replace(**{name: value.fget(law) * 1.01 + 1e-3}) != law, name


def test_models_are_equal_where_their_systems_are():
    model = TOW.build()
    assert pickle.loads(pickle.dumps(model)) == model == TOW.build()
    assert hash(TOW.build()) == hash(model)
    assert TOW.replace({"points.depressor.mass": 6.3}).build() != model
    assert model != TOW


def lowest_height(motion):
    return min(motion(0.1 * i).position[2] for i in range(20))


def test_motions_are_shared_out_among_processes():
    """As in a study over motions: each goes to another process by its pickle."""
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        assert list(pool.map(lowest_height, MOTIONS)) == [lowest_height(m) for m in MOTIONS]


@pytest.mark.parametrize("part", PARTS[:-1], ids=named)
def test_a_part_prints_as_it_is_made(part):
    assert eval(repr(part), vars(sc)) == part
    assert hash(eval(repr(part), vars(sc))) == hash(part)


@pytest.mark.parametrize(
    "cls",
    sorted({type(part) for part in PARTS if "sim_core._core" in type(part).__module__}, key=str),
)
def test_compiled_parts_show_all_that_they_are_made_of(cls):
    """Copies rely on it: what could not be read back would be lost."""
    signature = cls.__init__.__nb_signature__[0][0]
    values = {name for name, value in vars(cls).items() if isinstance(value, property)}
    # another way to give what is kept as stopping_time and radius
    others = {"stopping_distance", "circle_time"}
    assert set(re.findall(r"(\w+):", signature)) - others == values


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


def test_a_name_with_dots_is_reached_by_its_path():
    dotted = sc.System(
        points={"tow.point": sc.PrescribedPoint(), "tow": sc.FreePoint(mass=1.0)},
        lines={"main.1": sc.Line("tow.point", "tow", CABLE, segments=2)},
    )
    longer = dotted.replace({"lines.main.1.properties.length": 4.0})
    assert longer.lines["main.1"].properties == CABLE.replace(length=4.0)
    assert dotted.replace({"points.tow.mass": 2.0}).points["tow"].mass == 2.0
    assert dotted.replace({"points.tow.point": sc.FreePoint()}).points["tow.point"].mass == 0.0
