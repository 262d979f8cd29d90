# SPDX-License-Identifier: Apache-2.0
"""MoorDyn input files: what they describe here, and how the rest is named."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

import sim_core as sc

DECKS = Path(__file__).parent / "decks"
CHAIN = "catenary.txt"
TOW = "two_part_tow.txt"


@pytest.fixture
def read(tmp_path):
    """Reads a deck of the folder with lines of it replaced: old text to new."""

    def changed(name: str, changes: dict[str, str], **options) -> sc.MoorDynDeck:
        text = (DECKS / name).read_text(encoding="utf-8")
        for old, new in changes.items():
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "deck.txt"
        path.write_text(text, encoding="utf-8")
        return sc.read_moordyn(path, **options)

    return changed


# ------------------------------------------------------------------------------------ lines


def test_catenary_of_a_deck_is_that_of_the_closed_form():
    """An elastic chain between two points, both above its lowest: end forces H and V from

    x = H L/EA + H/w (asinh((V)/H) − asinh((V − wL)/H)),
    z = (V L − w L²/2)/EA + 1/w (√(H² + V²) − √(H² + (V − wL)²)).

    The polygon of N segments with its weight at the nodes differs by O(1/N²): at 80 segments the
    sag of a segment's chord is about w ℓ²/(8 T) = 1e-3 of ℓ, which tells in T by some 1e-4.
    """
    deck = sc.read_moordyn(DECKS / CHAIN)
    properties = deck.system.lines["line1"].properties
    weight = 9.80665 * (20.0 - 1025.0 * math.pi / 4 * 0.05**2)  # N/m, MoorDyn's default gravity
    length, stiffness, span, rise = 65.0, 2.0e6, 50.0, 20.0

    def misfit(forces):
        h, v = forces
        low = v - weight * length
        x = h * length / stiffness + h / weight * (np.arcsinh(v / h) - np.arcsinh(low / h))
        z = (v * length - weight * length**2 / 2) / stiffness
        z += (np.hypot(h, v) - np.hypot(h, low)) / weight
        return x - span, z - rise

    h, v = fsolve(misfit, (weight * span / 2, weight * length / 2), xtol=1e-12)
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    bottom, top = sc.Simulator(state.model, state).end_tensions("line1")
    assert top == pytest.approx(np.hypot(h, v), rel=3e-4)
    assert bottom == pytest.approx(np.hypot(h, v - weight * length), rel=3e-4)
    # A damping ratio is one of critical damping of a segment: ζ ℓ √(EA m).
    assert properties.axial_damping == pytest.approx(0.5 * 65 / 80 * math.sqrt(2e6 * 20), rel=1e-12)
    assert deck.positions == {"point1": (0.0, 0.0, -30.0), "point2": (40.0, 30.0, -10.0)}
    assert deck.time_step == 0.002
    assert deck.warnings == ()


def wu_chwang() -> sc.System:
    """The deck's tow, written down from the same numbers."""

    def cable(length, diameter, mass, damping=0.0):
        return sc.LineProperties(
            length=length, diameter=diameter, mass_per_length=mass, axial_stiffness=628.3e3,
            axial_damping=damping,
        )  # fmt: skip

    mass = 9.5033178 * 1.3
    across = mass * (1.3**2 / 12 + 0.055**2 / 4)
    added = 1000 * math.pi * 0.055**2 * 1.3
    turning = added * 1.3**2 / 12
    return sc.System(
        water=sc.Water(density=1000.0, gravity=9.81),
        points={
            "point1": sc.PrescribedPoint(),
            "point2": sc.FreePoint(),
            "point3": sc.FreePoint(
                mass=5.25, volume=0.697e-3, drag_area=0.0044666, added_mass=0.5 * 0.697
            ),
        },
        bodies={
            "rod1": sc.Body(
                mass=mass, inertia=(mass * 0.055**2 / 2, across, across),
                volume=math.pi * 0.055**2 * 1.3, diameter=0.11, length=1.3,
                added_mass=(0, added, added, 0, turning, turning),
                axial_drag=1.0, cross_flow_drag=1.1, munk_moment=0.0,
            )
        },
        lines={
            "line1": sc.Line("point1", "point2", cable(2.84, 0.0099013, 0.181), segments=8),
            "line2": sc.Line("point2", "point3", cable(0.30, 0.0055279, 0.063), segments=2),
            "line3": sc.Line(
                "point2", "rod1", cable(1.5, 0.0086674, 0.124, 20.0), segments=5,
                attachment=(0.65, 0, 0),
            ),
        },
    )  # fmt: skip


def test_two_part_tow_of_a_deck_moves_as_the_model_built_directly():
    deck = sc.read_moordyn(DECKS / TOW)
    motion = sc.Sinusoid(mean=(0, 0, 0), velocity=(1, 0, 0), amplitude=0.1, period=2)
    here, there = (
        sc.run(system.build(), motion, t_end=1.0, output_step=0.5)
        for system in (wu_chwang(), deck.system)
    )
    # Both do the same sums in another order.
    for name in ("point2", "point3"):
        assert there.points[name].position == pytest.approx(here.points[name].position, abs=1e-9)
    assert there.bodies["rod1"].position == pytest.approx(here.bodies["rod1"].position, abs=1e-9)
    assert there.lines["line1"].tensions == pytest.approx(here.lines["line1"].tensions, rel=1e-6)
    assert deck.warnings == ()
    # The nose is where the line is.
    assert here.bodies["rod1"].position[0, 0] < here.points["point2"].position[0, 0]


# ------------------------------------------------------------------------- bodies and points

ROD_ON_A_BODY = {
    "----------------------- RODS -": """------- BODIES -------
ID  Attachment X0  Y0  Z0   r0  p0  y0  Mass  CG      I          Volume  CdA  Ca
(#) (word)     (m) (m) (m)  (d) (d) (d) (kg)  (m)     (kg-m^2)   (m^3)   (m^2) (-)
1   free       -2  0   -2.8 0   0   0   3.0   0|0|-0.1 0.1|0.2|0.3 2e-3  0    0
----------------------- RODS -""",
    "Free        -1.5  0    -2.8  -2.8   0    -2.8": "Body1 0.65 0 0 -0.65 0 0",
    "3    Free        0       0    -3.14 ": "3 Body1 0.65 0 0 0 0 0 0\n4 Free 0 0 -3.14 ",
    "2    short      2        3 ": "2    short      2        4 ",
    "2        R1A ": "2        3 ",
}


def test_a_body_carries_its_rod(read):
    """Mass, centre of gravity, inertia (parallel axes) and buoyancy of both together."""
    body = read(TOW, ROD_ON_A_BODY).system.bodies["body1"]
    rod = wu_chwang().bodies["rod1"]
    mass = rod.mass + 3.0
    assert body.mass == pytest.approx(mass, rel=1e-12)
    assert body.centre_of_gravity == pytest.approx((0, 0, -0.3 / mass), abs=1e-12)
    shifted = 3.0 * 0.1**2
    expected = np.diag(rod.inertia) + np.array([0.1 + shifted, 0.2 + shifted, 0.3])
    assert body.inertia == pytest.approx(np.diag(expected), abs=1e-9)
    assert body.volume == pytest.approx(rod.volume + 2e-3, rel=1e-9)
    assert body.centre_of_buoyancy == pytest.approx((0, 0, 0), abs=1e-12)
    assert body.added_mass == pytest.approx(rod.added_mass, rel=1e-9)


def test_points_on_a_body_are_places_of_it(read):
    lines = read(TOW, ROD_ON_A_BODY).system.lines
    assert (lines["line3"].start, lines["line3"].end) == ("point2", "body1")
    assert lines["line3"].attachment == pytest.approx((0.65, 0, 0), abs=1e-12)


def test_the_nose_is_where_the_lines_are(read):
    """Towed at end B the rod's nose is there: the line is held 0.65 m ahead of the middle."""
    deck = read(TOW, {"R1A": "R1B"})
    assert deck.system.lines["line3"].attachment == pytest.approx((0.65, 0, 0), abs=1e-12)


def test_rods_clamp_lines_that_bend(read):
    """A line with EI leaves its rod along the rod, whose nose is end A here."""
    stiff = {"628.3e3  20.0     0 ": "628.3e3  20.0     0.5 "}
    line = read(TOW, stiff).system.lines["line3"]
    assert line.end_direction == pytest.approx((-1, 0, 0), abs=1e-12)
    assert line.start_direction is None
    assert read(TOW, {}).system.lines["line3"].end_direction is None


@pytest.mark.parametrize(
    ("rod", "at", "direction"),
    [("0 0 -30 -1 0 -30 1", "R1A", (1, 0, 0)), ("0 0 -30 0 0 2 0", "R1B", (0, 0, 1))],
)
def test_fixed_rods_hold_lines(read, rod, at, direction):
    """Of length, and of none, where the second place is a direction."""
    rods = f"""--- ROD TYPES ---
TypeName  Diam  Mass/m  Cd  Ca  CdEnd CaEnd
(name)    (m)   (kg/m)  (-) (-) (-)   (-)
clamp     0.1   1       0   0   0     0
--- RODS ---
ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs
(#) (name) (word) (m) (m) (m) (m) (m) (m) (-)
1 clamp Fixed {rod} -
----------------------- POINTS -"""
    changes = {
        "----------------------- POINTS -": rods,
        "1    chain     1": f"1 chain {at}",
        "-0.5       0 ": "-0.5 50",
    }
    deck = read(CHAIN, changes)
    line = deck.system.lines["line1"]
    assert line.start == f"rod1{at[-1]}"
    assert deck.positions[line.start] == (0, 0, -30)
    assert line.start_direction == pytest.approx(direction, abs=1e-12)
    assert line.end_direction is None
    assert set(deck.system.build().prescribed_points) == {line.start, "point1", "point2"}


def test_points_of_a_fixed_body_are_prescribed(read):
    body = """------- BODIES -------
ID  Attachment X0  Y0  Z0   r0  p0  y0  Mass  CG      I          Volume  CdA  Ca
(#) (word)     (m) (m) (m)  (d) (d) (d) (kg)  (m)     (kg-m^2)   (m^3)   (m^2) (-)
1   Fixed      1   2   -3   0   0   0   0     0       0          0       0    0
----------------------- POINTS -"""
    deck = read(
        CHAIN,
        {"----------------------- POINTS -": body, "2    Coupled ": "2    Body1 "},
    )
    assert isinstance(deck.system.points["point2"], sc.PrescribedPoint)
    assert deck.positions["point2"] == (41.0, 32.0, -13.0)


# ------------------------------------------------------------------------------- sea floor

FLOOR = """--- LINE TYPES ---
TypeName   Diam   Mass/m   EA     BA     EI   Cd   Ca  CdAx  CaAx
(name)     (m)    (kg/m)   (N)    (-)    (-)  (-)  (-)  (-)  (-)
chain      0.05   50.0     5.0e8  -0.8   0    0    0    0    0
--- POINTS ---
ID  Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1   Fixed      0   0 -100  0 0 0 0
2   Coupled    260 0 0     0 0 0 0
--- LINES ---
ID LineType A B UnstrLen NumSegs Out
(#) (-) (-) (-) (m) (-) (-)
1  chain 1 2 300 150 -
--- OPTIONS ---
1000 WtrDnsty
9.81 g
100  WtrDpth
1e6  kBot
5e4  cBot
0.4  FrictionCoefficient
--- need this line ---
"""


@pytest.fixture
def deck_of(tmp_path):
    """Reads a deck from its text, with other files beside it."""

    def made(text: str, files: dict[str, str] | None = None, **given) -> sc.MoorDynDeck:
        for name, content in (files or {}).items():
            (tmp_path / name).write_text(content, encoding="utf-8")
        path = tmp_path / "deck.txt"
        path.write_text(text, encoding="utf-8")
        return sc.read_moordyn(path, **given)

    return made


def test_mooring_line_on_the_sea_floor_is_that_of_the_closed_form(deck_of):
    """A slack chain whose lower part lies on the floor; at rest friction does not count.

    Touching down tangentially, a lifted length s with end forces H and V = w s spans
    z = (√(H² + V²) − H)/w + V²/2wEA, x = L − s + (H/w) asinh(V/H) + H L/EA
    (Faltinsen 1990, eqs 8.21 to 8.26). 2 m segments of that catenary, a = H/w = 42 m, tell by
    (ℓ/a)²/24 = 1e-4, the bed's give by w/(kBot d) = 9 mm in 100 m, its rounding by 1 mm.
    """
    deck = deck_of(FLOOR)
    weight = 9.81 * (50.0 - 1000.0 * math.pi / 4 * 0.05**2)
    length, stiffness = 300.0, 5e8

    def misfit(forces):
        h, v = forces
        s = v / weight
        x = length - s + h / weight * np.arcsinh(v / h) + h * length / stiffness
        z = (np.hypot(h, v) - h) / weight + v**2 / (2 * weight * stiffness)
        return x - 260.0, z - 100.0

    h, v = fsolve(misfit, (2e4, 7e4), xtol=1e-12)
    assert 0.3 * length < length - v / weight  # that much lies on the floor
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    simulator = sc.Simulator(state.model, state)
    assert simulator.hook_load("point2") == pytest.approx([-h, 0, -v], rel=1e-3)
    heights = state.node_positions("line1")[:40, 2]
    resting = 100.0 + weight / (1e6 * 0.05)
    assert heights[5:] == pytest.approx(-resting, abs=2e-4)


def test_floor_has_the_bed_and_friction_of_the_deck(deck_of):
    """Damping alike at the depth at which the chain rests: a = cBot d/w."""
    deck = deck_of(FLOOR)
    weight = 9.81 * (50.0 - 1000.0 * math.pi / 4 * 0.05**2)
    tank = deck.system.tank
    assert (tank.bed_stiffness, tank.friction, tank.stiffness) == (1e6, 0.4, 0.0)
    assert tank.damping == pytest.approx(5e4 * 0.05 / weight, rel=1e-12)
    # MoorDyn's nodes touch with their middles, those here with their undersides.
    assert tank.floor == pytest.approx(-100.0 - 0.025, rel=1e-12)
    assert deck.warnings == ()


def test_depth_can_be_given_from_outside(deck_of):
    assert deck_of(FLOOR, water_depth=120.0).system.tank.floor == pytest.approx(-120.025)
    bare = deck_of(FLOOR, water_depth=math.inf)
    assert (bare.system.tank, bare.water_depth) == (None, None)
    # Like MoorDyn: the floor is no higher than an anchor.
    assert deck_of(FLOOR.replace("100  WtrDpth", "80  WtrDpth")).water_depth == 100.0


def test_tow_has_no_floor_of_its_own(read):
    deck = read(TOW, {})
    assert (deck.system.tank, deck.water_depth) == (None, None)


# ------------------------------------------------------------------ stiffness of other kinds


def test_tabulated_stiffness_is_read_from_its_file(deck_of):
    """A tensioned line, straight and weightless: T from the table at the strain of the span."""
    text = FLOOR.replace("5.0e8  -0.8", "rope.txt 0").replace("50.0  ", "1.9635")
    text = text.replace("300 150", "268 4")
    rope = "a rope\nstrain tension\n(-) (N)\n0 0\n0.01 4e4\n0.02 1e5\n0.05 5e5\n"
    deck = deck_of(text, {"rope.txt": rope})
    stiffness = deck.system.lines["line1"].properties.axial_stiffness
    assert list(stiffness) == [(0, 0), (0.01, 4e4), (0.02, 1e5), (0.05, 5e5)]
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    strain = math.hypot(260, 100) / 268 - 1
    # between the points of the table a monotone curve and not a chord: within the interval
    tension = sc.Simulator(state.model, state).tensions("line1")
    assert 0.02 < strain < 0.05
    assert tension.min() == pytest.approx(tension.max(), rel=1e-6)
    chord = 1e5 + (strain - 0.02) / 0.03 * 4e5
    assert tension[0] == pytest.approx(chord, rel=0.1)
    with pytest.raises(sc.InvalidInput, match=r"5|4: EA rope.txt: strains and tensions must"):
        deck_of(text, {"rope.txt": "h\nh\n0 0\n0.02 1e5\n0.01 2e5\n"})


def test_viscoelastic_rope_creeps_from_its_dynamic_to_its_static_stiffness(deck_of):
    """MoorDyn's model (spring and dashpot EA₁, BA in series with EA_D): after a sudden stretch ε
    T = EA_S ε + (EA_D − EA_S) ε exp(−t/τ), τ = BA/(EA₁ + EA_D), 1/EA_S = 1/EA₁ + 1/EA_D."""
    static, dynamic, damping = 1e6, 3e6, 4.5e7
    text = FLOOR.replace("5.0e8  -0.8", f"{static}|{dynamic} {damping}|3e4")
    text = text.replace("50.0  ", "1.9635").replace("260 0 0 ", "100 0 -100 ")
    text = text.replace("300 150", "100 2").replace("100  WtrDpth", "500 WtrDpth")
    deck = deck_of(text)
    model = deck.system.build()
    state = sc.steady_tow(model, position=deck.positions | {"point2": (100.5, 0, -100)})
    assert sc.Simulator(model, state).tensions("line1") == pytest.approx(0.005 * static, rel=1e-6)

    tau = damping / (static * dynamic / (dynamic - static) + dynamic)
    ramp = 0.02 * tau
    stretch = sc.TimeSeries(
        time=[0.0, ramp, 10 * tau],
        position=np.array([(100.5, 0, -100), (101.0, 0, -100), (101.0, 0, -100)]),
        velocity=np.zeros((3, 3)),
    )
    laws = {"point1": sc.SteadyTow(position=(0, 0, -100)), "point2": stretch}
    run = sc.run(model, laws, state=state, t_end=3 * tau, output_step=tau / 10, max_step=tau / 200)
    tension = run.lines["line1"].tensions.mean(axis=1)
    since = run.time[2:] - ramp / 2  # the ramp counts from its middle, to (ramp/τ)²/24
    decay = np.exp(-since / tau)
    expected = 0.01 * static + 0.005 * (dynamic - static) * decay
    # the fast dashpot damps the wave after the ramp by 0.2 and adds BA_D/BA = 7e-4 to τ
    assert tension[2:] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("mean", [2e4, 8e4])
def test_dynamic_stiffness_of_a_rope_follows_its_mean_tension(deck_of, mean):
    """EA_S|α|β: at rest T = EA_S ε; against a quick small stretch α + β T (the slow dashpot holds).

    The stretch of 0.1 % changes T, and so the stiffness, by β ΔT/2, less than 1 %; the tables are
    curves through 40 points, and their slope is good to 1 %.
    """
    static, at_rest, slope = 1e6, 2e6, 20.0
    text = FLOOR.replace("5.0e8  -0.8", f"{static}|{at_rest}|{slope} 1e11|1e4")
    text = text.replace("50.0  ", "1.9635").replace("260 0 0 ", "100 0 -100 ")
    text = text.replace("300 150", "100 2").replace("100  WtrDpth", "500 WtrDpth")
    deck = deck_of(text)
    model = deck.system.build()
    span = 100.0 * (1 + mean / static)
    state = sc.steady_tow(model, position=deck.positions | {"point2": (span, 0, -100)})
    before = sc.Simulator(model, state).tensions("line1").mean()
    # between two points of the table the curve is off by up to 1e-3
    assert before == pytest.approx(mean, rel=1e-3)
    stretch = sc.TimeSeries(
        time=[0.0, 1.0, 9.0],
        position=np.array([(span, 0, -100), (span + 0.1, 0, -100), (span + 0.1, 0, -100)]),
        velocity=np.zeros((3, 3)),
    )
    laws = {"point1": sc.SteadyTow(position=(0, 0, -100)), "point2": stretch}
    run = sc.run(model, laws, state=state, t_end=5.0, output_step=1.0)
    stiffness = (run.lines["line1"].tensions[-1].mean() - before) / 1e-3
    assert stiffness == pytest.approx(at_rest + slope * mean, rel=0.02)


# ----------------------------------------------------------------------- waves and currents


def test_current_profile_beside_the_deck_is_the_waters(deck_of):
    text = FLOOR.replace("100  WtrDpth", "100  WtrDpth\n1 Currents")
    profile = "profile\nof a current\nz ux uy uz\n-100 0.1 0.2 0\n0 1.1 0.4 0\n"
    water = deck_of(text, {"current_profile.txt": profile}).system.water
    assert water.motion((0, 0, -100.0), time=0.0).velocity == pytest.approx([0.1, 0.2, 0])
    assert water.motion((5.0, 0, 0), time=9.0).velocity == pytest.approx([1.1, 0.4, 0])


def test_profile_in_the_file_of_moordyn_f(deck_of):
    text = FLOOR.replace("100  WtrDpth", '100  WtrDpth\n"kin.dat" WaterKin')
    kinematics = (
        'title\nnote\n---- WAVES ----\n0 WaveKinMod\n"" WaveKinFile\n---- CURRENT ----\n'
        "{} CurrentMod - kind\nz ux uy\n(m) (m/s) (m/s)\n-100 0.5 0\n0 0.7 0\n--- end ---\n"
    )
    water = deck_of(text, {"kin.dat": kinematics.format(1)}).system.water
    assert water.motion((0, 0, 0), time=0.0).velocity == pytest.approx([0.7, 0, 0])
    with pytest.raises(sc.InvalidInput, match="only a steady profile is read"):
        deck_of(text, {"kin.dat": kinematics.format(7)})


def test_changing_current_is_a_profile_and_a_series(deck_of):
    """U(z, t) = z-part + t-part is the sum that a Current has; another table is refused."""
    text = FLOOR.replace("100  WtrDpth", "100  WtrDpth\n2 Currents")
    head = "current\nover time\n2\n3\n-100 0\n\n"
    table = head + "0 0.1 1.1 0.2 0.2\n10 0.4 1.4 0.2 0.2\n"
    water = deck_of(text, {"current_profile_dynamic.txt": table}).system.water
    assert water.motion((0, 0, 0), time=0.0).velocity == pytest.approx([1.1, 0.2, 0])
    assert water.motion((0, 0, -100), time=10.0).velocity == pytest.approx([0.4, 0.2, 0])
    with pytest.raises(sc.InvalidInput, match="only the sum of a steady profile and a series"):
        deck_of(text, {"current_profile_dynamic.txt": head + "0 0.1 1.1\n10 0.4 1.8\n"})


def grid_of_current(velocity):
    """A file current_profile_4d.txt of two x, y, z and times."""
    x, y, z, t = (0.0, 50.0), (-20.0, 20.0), (-100.0, 0.0), (0.0, 10.0)
    axes = "\n".join(" ".join(map(str, axis)) for axis in (x, y, z, t))
    points = [
        " ".join(map(str, (*point, *velocity(*point)))) for point in itertools.product(x, y, z, t)
    ]
    return f"2 2 2 2\n{axes}\n" + "\n".join(points)


def test_current_of_a_grid_is_a_profile_and_a_series_if_it_is_alike_in_the_plane(deck_of):
    text = FLOOR.replace("100  WtrDpth", "100  WtrDpth\n5 Currents")
    file = "current_profile_4d.txt"
    alike = grid_of_current(lambda x, y, z, t: (1.1 + 0.01 * z + 0.03 * t, 0.2, 0.0))
    water = deck_of(text, {file: alike}).system.water
    assert water.motion((7, 3, 0), time=0.0).velocity == pytest.approx([1.1, 0.2, 0])
    assert water.motion((0, 0, -100), time=10.0).velocity == pytest.approx([0.4, 0.2, 0])
    sheared = grid_of_current(lambda x, y, z, t: (0.01 * x, 0.0, 0.0))
    with pytest.raises(sc.InvalidInput, match="only a current that is alike in all x and y"):
        deck_of(text, {file: sheared})
    whole = alike.splitlines()
    with pytest.raises(sc.InvalidInput, match="a line x y z t ux uy uz for each point of the grid"):
        deck_of(text, {file: "\n".join(whole[:-1])})
    with pytest.raises(sc.InvalidInput, match="after the fifth must be x y z t ux uy uz"):
        deck_of(text, {file: "\n".join([*whole[:-1], "0 1"])})


def test_sea_floor_in_a_file_is_the_floor_if_it_is_level(deck_of):
    text = FLOOR.replace("100  WtrDpth", "hills.txt SeafloorFile")
    level = "2 2\n-500 500\n-500 500\n-500 -500 -110\n-500 500 -110\n500 -500 -110\n500 500 -110\n"
    deck = deck_of(text, {"hills.txt": level})
    assert deck.water_depth == 110.0
    assert deck.system.tank == deck_of(FLOOR.replace("100  WtrDpth", "110 WtrDpth")).system.tank
    with pytest.raises(sc.InvalidInput, match="lies between -115 and -110 m, only a level one"):
        deck_of(text, {"hills.txt": level.replace("500 500 -110", "500 500 -115")})
    with pytest.raises(sc.InvalidInput, match="two counts, as many x, as many y, and x, y, z"):
        deck_of(text, {"hills.txt": level.replace("2 2\n", "2 3\n")})
    uneven = {"hills.txt": level.replace("500 500 -110", "500 500 -115")}
    deck = deck_of(text, uneven, water_depth=120.0)
    assert deck.water_depth == 120.0
    assert deck.warnings == ("deck.txt:17: water_depth 120 m in place of SeafloorFile",)


def test_wave_spectra_beside_the_deck_are_the_waters(deck_of):
    """WaveKin 2 is Re c exp(iωt), 7 its imaginary part with directions (MoorDyn-C)."""
    wave = FLOOR.replace("100  WtrDpth", "100  WtrDpth\n{} WaveKin")
    two = {"wave_frequencies.txt": "0 0 0\n0.5 1.5 0\n1.0 0 2.0\n"}
    times = np.linspace(0, 20, 41)
    sea = deck_of(wave.format(2), two).system.water.waves
    expected = 1.5 * np.cos(0.5 * times) - 2.0 * np.sin(times)
    assert sea.elevation(times) == pytest.approx(expected, abs=1e-9)
    assert sea.depth == 100.0
    seven = {"wave_frequencies.txt": "0 0 0\n0.5 1.5 0 1.0\n"}
    sea = deck_of(wave.format(7), seven).system.water.waves
    assert sea.elevation(times) == pytest.approx(1.5 * np.sin(0.5 * times), abs=1e-9)
    assert sea.direction == pytest.approx([1.0])


def test_wave_elevation_beside_the_deck_is_the_waters(deck_of):
    """Two trains that are periodic in the record of 64 s come back as they are."""
    text = FLOOR.replace("100  WtrDpth", "100  WtrDpth\n3 WaveKin\n0.5 dtWave")
    time = 0.5 * np.arange(129)
    w = 2 * math.pi / 64.0
    record = 0.8 * np.cos(5 * w * time) + 0.3 * np.sin(11 * w * time)
    lines = "\n".join(f"{t} {z}" for t, z in zip(time, record, strict=True))
    sea = deck_of(text, {"wave_elevation.txt": lines}).system.water.waves
    assert sea.elevation(time) == pytest.approx(record, abs=1e-9)
    assert len(sea.amplitude) == 2


# ---------------------------------------------------------------------- bodies of other kinds

ROD = """--- ROD TYPES ---
TypeName Diam Mass/m Cd Ca CdEnd CaEnd
(-) (m) (kg/m) (-) (-) (-) (-)
bar      0.2  120    0  0  0     0
--- RODS ---
ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs Out
(#) (-) (-) (m) (m) (m) (m) (m) (m) (-) (-)
{rods}
--- OPTIONS ---
1000 WtrDnsty
50 WtrDpth
9.81 g
--- need this line ---
"""
BODY = """--- BODIES ---
ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG I Volume CdA Ca
(#) (-) (m) (m) (m) (d) (d) (d) (kg) (m) (-) (m^3) (m^2) (-)
{bodies}
"""
IN_WATER = 120 - 1000 * math.pi / 4 * 0.2**2  # kg/m


@pytest.mark.parametrize("kind", ["Pinned", "Pinned1", "CoupledPinned", "VesPin"])
def test_pinned_rod_hangs_on_its_end_a(deck_of, kind):
    deck = deck_of(ROD.format(rods=f"1 bar {kind} 1 2 -5 4 2 -5 3 p"))
    assert deck.positions == {"pin_rod1": (1, 2, -5)}
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    # at half its length below the pin
    assert state.body_position("rod1") == pytest.approx([1, 2, -6.5], abs=1e-3)
    load = sc.Simulator(state.model, state).hook_load("pin_rod1")
    assert load == pytest.approx([0, 0, -3 * IN_WATER * 9.81], abs=1e-6 * 3 * IN_WATER * 9.81)


def test_pinned_body_carries_its_rod(deck_of):
    bodies = BODY.format(bodies="4 CoupledPinned 3 0 -10 0 0 0 20 0 1 0 0 0")
    deck = deck_of(bodies + ROD.format(rods="9 bar Body4 0 0 -1 0 0 -3 2 p"))
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    load = sc.Simulator(state.model, state).hook_load("pin_body4")
    assert load == pytest.approx([0, 0, -(2 * IN_WATER + 20) * 9.81], abs=1e-3)
    assert state.body_position("body4") == pytest.approx([3, 0, -12], abs=1e-3)


def test_rod_pinned_on_a_body_swings_on_it(deck_of):
    """Both hang: the body on its pin, the second rod below the end of the first."""
    bodies = BODY.format(bodies="1 CoupledPinned 0 0 -5 0 0 0 0 0 0 0 0 0")
    rods = "1 bar Body1 0 0 0 0 0 -2 2 p\n2 bar Body1Pinned 0 0 -2 1 0 -2 2 p"
    deck = deck_of(bodies + ROD.format(rods=rods))
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    assert state.body_position("body1") == pytest.approx([0, 0, -6], abs=1e-3)
    assert state.body_position("rod2") == pytest.approx([0, 0, -7.5], abs=1e-3)


def test_two_rods_on_a_body_are_one_piece(deck_of):
    """Two bars in a line on a pinned body: the weld holds the second in the line of the first."""
    bodies = BODY.format(bodies="1 CoupledPinned 0 0 -5 0 0 0 0 0 0 0 0 0")
    rods = "1 bar Body1 0 0 0 0 0 -2 2 p\n2 bar Body1 0 0 -2 0 0 -6 2 p"
    deck = deck_of(bodies + ROD.format(rods=rods))
    assert [name for name in deck.system.joints if "weld" in name] == [
        "weld1_rod2", "weld2_rod2", "weld3_rod2",
    ]  # fmt: skip
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    assert state.body_position("rod2") == pytest.approx([0, 0, -9], abs=2e-3)
    load = sc.Simulator(state.model, state).hook_load("pin_body1")
    assert load == pytest.approx([0, 0, -6 * IN_WATER * 9.81], abs=1e-6 * 6 * IN_WATER * 9.81)


@pytest.mark.parametrize(("drag", "area"), [("0.5", 0.5), ("0.5|9", 0.5), ("0.5|0.2|0.9", 0.5)])
def test_body_without_a_rod_has_its_own_drag_and_added_mass(deck_of, drag, area):
    """Towed on a line of no account it leans back by drag over weight: ½ρ CdA U²/W."""
    bodies = BODY.format(bodies=f"1 Free 0 0 -3 0 0 0 100 0 4|5|6 0.04 {drag} 0.5|1|2")
    deck = deck_of(
        bodies
        + """--- LINE TYPES ---
TypeName Diam Mass/m EA BA EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (-) (-) (-) (-) (-) (-)
thread 1e-6 1e-6 1e6 0 0 0 0 0 0
--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
12 Coupled 0 0 -1 0 0 0 0
7  Body1 0 0 0 0 0 0 0
--- LINES ---
ID LineType A B UnstrLen NumSegs Out
(#) (-) (-) (-) (m) (-) (-)
3 thread 12 7 2 2 -
--- OPTIONS ---
1000 WtrDnsty
9.81 g
--- need this line ---
"""
    )
    body = deck.system.bodies["body1"]
    assert np.diag(body.added_mass)[:3] == pytest.approx([20, 40, 80])  # Ca ρ V
    assert np.diag(body.inertia) == pytest.approx([4, 5, 6])
    speed = 2.0
    velocity = (speed, 0, 0)
    state = sc.steady_tow(deck.system.build(), position=deck.positions, velocity=velocity)
    pull = sc.Simulator(state.model, state).hook_load("point12")
    force = 0.5 * 1000 * area * speed**2
    assert pull == pytest.approx([-force, 0, -(100 - 40) * 9.81], rel=1e-5)
    assert list(deck.system.lines) == ["line3"]  # IDs need not count from 1


def test_turned_fixed_body_holds_its_points_where_they_are(deck_of):
    """r0, p0, y0 turn about x, then y and z of the turned axes: here 90° about y and about z."""
    bodies = BODY.format(bodies="1 Fixed 1 2 -3 0 90 90 0 0 0 0 0 0")
    deck = deck_of(
        bodies
        + """--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Body1 1 0 0 0 0 0 0
2 Body1 0 0 1 0 0 0 0
--- OPTIONS ---
50 WtrDpth
--- need this line ---
"""
    )
    # y by 90° sends x to −z and z to x; z by 90° before it x to y.
    assert deck.positions["point1"] == pytest.approx((1, 3, -3))
    assert deck.positions["point2"] == pytest.approx((2, 2, -3))


def test_rod_adrift_floats_at_its_draught(deck_of):
    """No line holds it: half as heavy as water, a round bar floats with its axis at the surface."""
    half = ROD.replace("120 ", f"{500 * math.pi / 4 * 0.2**2} ")
    deck = deck_of(half.format(rods="1 bar Free 3 4 -1 6 4 -1 3 p"))
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    assert state.body_position("rod1") == pytest.approx([4.5, 4, 0], abs=1e-6)


def test_rod_adrift_sinks_to_the_floor(deck_of):
    deck = deck_of(ROD.format(rods="1 bar Free 3 4 -1 6 4 -1 3 p"))
    state = sc.steady_tow(deck.system.build(), position=deck.positions)
    sunk = IN_WATER * 9.81 / (3e6 * 0.2)  # kBot of MoorDyn, on its diameter
    expected = [4.5, 4, -50 + 0.1 - sunk]
    assert state.body_position("rod1") == pytest.approx(expected, abs=1e-3)


def test_mass_of_points_is_the_mass_of_a_body_without_its_own(deck_of):
    bodies = BODY.format(bodies="1 Free 0 0 -5 0 0 0 0 0|0|0 0 0 0 0")
    points = """--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Body1 0 -2 0 20 0 0 0
2 Body1 0 4 0 10 0 0 0
--- OPTIONS ---
50 WtrDpth
--- need this line ---
"""
    body = deck_of(bodies + points).system.bodies["body1"]
    assert body.mass == pytest.approx(30)
    # 20 (2)² + 10 (4)² about the origin, where the centre of gravity is; balls add 2e-3 of it
    assert np.diag(body.inertia)[[0, 2]] == pytest.approx([240, 240], rel=2e-3)
    assert 0 < np.diag(body.inertia)[1] < 0.1


def test_rod_of_no_length_joins_lines_that_bend(deck_of):
    """It hands on the bending moment: both lines are one of two sections. Limp ones just meet."""
    lines = """--- LINE TYPES ---
TypeName Diam Mass/m EA BA EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (-) (-) (-) (-) (-) (-)
a 0.05 5 1e6 0 {a} 1 1 0 0
b 0.06 6 1e6 0 {b} 1 1 0 0
--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Coupled 0 0 0 0 0 0 0
2 Coupled 8 0 0 0 0 0 0
--- LINES ---
ID LineType A B UnstrLen NumSegs Out
(#) (-) (-) (-) (m) (-) (-)
1 a 1 R1A 5 5 -
2 b 2 R1B 6 3 -
"""
    rods = ROD.format(rods="1 bar Free 4 0 -3 4 0 -3 0 -")
    (line,) = deck_of(lines.format(a=40, b=50) + rods).system.lines.items()
    assert line[0] == "line1+line2"
    assert (line[1].start, line[1].end) == ("point1", "point2")
    assert [(p.diameter, n) for p, n in line[1].sections] == [(0.05, 5), (0.06, 3)]
    limp = deck_of(lines.format(a=0, b=50) + rods).system
    assert limp.points["rod1"] == sc.FreePoint()
    assert (limp.lines["line1"].end, limp.lines["line2"].end) == ("rod1", "rod1")
    three = lines.format(a=40, b=50) + "3 b R1A 2 6 3 -\n"
    with pytest.raises(sc.InvalidInput, match="hands on moments between two lines only"):
        deck_of(three + rods)


def test_of_two_rods_with_one_number_either_is_read_if_nothing_refers_to_it(deck_of):
    rods = "3 bar Free 0 0 -1 3 0 -1 3 p\n3 bar Free 0 9 -1 3 9 -1 3 p"
    assert set(deck_of(ROD.format(rods=rods)).system.bodies) == {"rod3", "rod4"}


# ---------------------------------------------------------------------- what is not supported


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        ({"0.002    dtM": "7 Springs"}, "17: left out: option Springs, of no known name, line 17"),
        (
            {"2    Coupled ": "7    Free 1 1 -1 0 0 0 0\n2    Coupled "},
            "10: left out: a free point that holds no line, line 10",
        ),
        ({"0.002    dtM": "1 WaveKin"}, "17: still water: WaveKin 1 leaves waves and current to"),
        ({"200 ": "#"}, "16: no WtrDpth: the sea floor is taken at the deepest anchor, 30 m; give"),
    ],
)  # fmt: skip
def test_what_is_left_out_or_assumed_is_told_in_one_line(read, change, warning):
    (text,) = read(CHAIN, change).warnings
    assert text.startswith(f"deck.txt:{warning}")


VIBRATING = {"0.1    0.0\n": "0.1    0.0  0.8\n"}
FAILING = {"--- need this": "--- FAILURE ---\nID\n()\n1 2 1 {} {}\n--- need this"}
CONTROLLED = {"--- need this": "--- CONTROL ---\nID\n()\n1 1\n--- need this"}


def failing(time, tension):
    return {old: new.format(time, tension) for old, new in FAILING.items()}


@pytest.mark.parametrize(
    ("changes", "name", "line", "what"),
    [
        (VIBRATING, "viv", 5, "vortex-induced vibration (Cl)"),
        (failing(10, 0), "failure", 22, "the failure of lines"),
        (failing(0, 1200e3), "failure", 22, "the failure of lines"),
        (CONTROLLED, "control", 22, "the control of lines"),
    ],
)
def test_what_changes_a_run_is_refused_unless_it_is_accepted_by_name(
    read, changes, name, line, what
):
    with pytest.raises(sc.InvalidInput) as error:
        read(CHAIN, changes)
    assert str(error.value) == (
        f"deck.txt:{line}: {what} changes a run and is not simulated: take it out, or accept that "
        f'it is left out, accept={{"{name}"}}'
    )
    others = {"viv", "failure", "control"} - {name}
    with pytest.raises(sc.InvalidInput, match="changes a run"):
        read(CHAIN, changes, accept=others)
    deck = read(CHAIN, changes, accept={name})
    assert deck.warnings == (f"deck.txt:{line}: left out: {what}, line {line}",)
    assert deck.system == read(CHAIN, {}).system


def test_all_that_is_accepted_is_told_in_one_line(read):
    deck = read(CHAIN, VIBRATING | failing(10, 0), accept={"viv", "failure"})
    assert deck.warnings == (
        "deck.txt:5: left out: vortex-induced vibration (Cl), line 5; the failure of lines, "
        "line 22",
    )


@pytest.mark.parametrize("accept", ["viv", {"vibration"}])
def test_what_can_be_accepted_is_named(accept):
    with pytest.raises(sc.InvalidInput, match=r"accept: .* \['control', 'failure', 'viv'\]"):
        sc.read_moordyn(DECKS / CHAIN, accept=accept)


def test_added_mass_along_lines_is_that_of_the_line(read):
    properties = read(CHAIN, {"0.1    0.0\n": "0.1    0.5\n"}).system.lines["line1"].properties
    assert properties.tangential_added_mass == 0.5


@pytest.mark.parametrize(
    "change",
    [
        failing(0, 0),  # neither at a time nor at a tension
        {"0.002    dtM": "3 writeLog\n0.1 dtOut\nRK4 tScheme\n60 TmaxIC\n1 disableOutTime"},
        {"--- need this line": "--- OUTPUTS ---\nFairTen1\n--- need this line"},
        {"0.002    dtM": "0 WaveKin\n0 Currents\n200.0 FricDamp"},
    ],
)
def test_what_does_not_matter_is_silent(read, change):
    assert read(CHAIN, change).warnings == ()


@pytest.mark.parametrize(
    ("deck", "old", "new", "message"),
    [
        (CHAIN, "2.0e6 ", "2e6|4e6|-2 ", "5: EA 2e6|4e6|-2: the second, dynamic stiffness must"),
        (CHAIN, "2.0e6 ", "4e6|2e6 ", "5: EA 4e6|2e6: the second, dynamic stiffness must be the"),
        (CHAIN, "2.0e6 ", "SYROPE:w.txt|1e6|9 ", "5: EA SYROPE:w.txt|1e6|9: the history of poly"),
        (CHAIN, "2.0e6 ", "polyester.txt ", "5: there is no file polyester.txt beside deck.txt"),
        (CHAIN, "-0.5       0 ", "damping.txt 0 ", "5: BA damping.txt: only a constant"),
        (CHAIN, "-0.5       0 ", "-0.5 bend.txt ", "5: EI bend.txt: only a constant"),
        (CHAIN, "0.002    dtM", "1 Currents", "17: there is no file current_profile.txt beside"),
        (CHAIN, "0.002    dtM", "7 WaveKin", "17: there is no file wave_frequencies.txt beside"),
        (CHAIN, "0.002    dtM", "6 Currents", "17: Currents 6 is not known: give 0 to 5"),
        (CHAIN, "0.002    dtM", "hills.txt SeafloorFile", "17: there is no file hills.txt beside"),
        (CHAIN, "0.002    dtM", "0.1 mu_kT", "17: friction across a line (0.1) and along it (0)"),
        (
            CHAIN,
            "0.002    dtM",
            "2 StatDynFricScale\n0.5 FrictionCoefficient",
            "17: StatDynFricScale: static friction is as dynamic friction here: give 1",
        ),
        (CHAIN, "--- need this", "--- SPRINGS ---\n1\n--- need this", "19: a section 'SPRINGS'"),
        (CHAIN, "-0.5       0 ", "-0.5", "5: a line type of MoorDyn v1"),
        (CHAIN, "20.0     2.0e6", "heavy 2.0e6", "5: Mass/m is no number: 'heavy'"),
        (CHAIN, "65        80", "65", "14: NumSegs is no whole number: 'p'"),
        (CHAIN, "65        80       p", "65", "14: 5 values, and none for NumSegs"),
        (CHAIN, "1    chain     1", "1 rope 1", "14: there is no line type 'rope'"),
        (CHAIN, "        2        65", " 7 65", "14: there is no point 7"),
        (CHAIN, "        2        65", " R1A 65", "14: there is no rod 1"),
        (CHAIN, "        2        65", " end 65", "14: 'end' is neither a point"),
        (CHAIN, "2    Coupled", "1    Coupled", "14: there are two of the ID 1 in POINTS"),
        (CHAIN, "2    Coupled", "2    Floating", "10: a point of the kind Floating"),
        (CHAIN, "- LINES -", "- POINTS -", "11: a second section POINTS"),
        (CHAIN, "1025.0   WtrDnsty ", "nan rho ", "16: rho is not finite"),
        (CHAIN, "-10    0      0       0     0", "-10 0 0 1 2 3 0 0", "10: a steady force"),
        (TOW, "hull     Free", "hull Towed", "16: a rod of the kind Towed is not known"),
        (TOW, "hull     Free", "hull Body3", "16: there is no body 3"),
        (ROD_ON_A_BODY, "2e-3  0 ", "2e-3 1|2|3|4 ", "16: CG, I and Ca have one value or three"),
        (ROD_ON_A_BODY, "1   free ", "1   Turbine1 ", "16: a body of the kind Turbine1 is not"),
    ],
)
def test_what_cannot_be_read_is_named_with_its_line(read, deck, old, new, message):
    file, changes = (TOW, deck) if isinstance(deck, dict) else (deck, {})
    with pytest.raises(sc.InvalidInput) as error:
        read(file, changes | {old: new})
    assert str(error.value).startswith(f"deck.txt:{message}")
    assert "\n" not in str(error.value)


def test_external_loads_are_refused(read):
    loads = (
        "--- EXTERNAL LOADS ---\nID Object Fext\n(#) (name) (N)\n1 Point1 1|0|0\n--- OPTIONS ---"
    )
    with pytest.raises(sc.InvalidInput, match=r"deck\.txt:18: external loads are not supported"):
        read(
            "catenary.txt", {"----------------------- OPTIONS -": loads + "\n--- need this line -"}
        )


@pytest.mark.parametrize("text", ["", "name: a rig\nwater: {}\n", "--- LINES ---\nID\n"])
def test_another_file_is_refused(tmp_path, text):
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(sc.InvalidInput, match=r"^rig\.yaml:1: "):
        sc.read_moordyn(path)
