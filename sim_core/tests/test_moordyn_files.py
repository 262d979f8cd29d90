# SPDX-License-Identifier: Apache-2.0
"""MoorDyn input files: what they describe here, and how the rest is named."""

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

    def changed(name: str, changes: dict[str, str]) -> sc.MoorDynDeck:
        text = (DECKS / name).read_text(encoding="utf-8")
        for old, new in changes.items():
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "deck.txt"
        path.write_text(text, encoding="utf-8")
        return sc.read_moordyn(path)

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
    tension = sc.Simulator(state.model, state).tensions("line1")
    # The segment nearest to an end carries the end's force but for half its own weight.
    half = weight * length / 80 / 2
    assert tension[-1] == pytest.approx(np.hypot(h, v - half), rel=3e-4)
    assert tension[0] == pytest.approx(np.hypot(h, v - weight * length + half), rel=3e-4)
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
    assert deck.warnings == ("two_part_tow.txt:33: option TmaxIC is not used",)
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
    assert set(deck.system.build().prescribed_points) == {line.start, "point2"}


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


# ---------------------------------------------------------------------- what is not supported


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        ({"0.1    0.0\n": "0.1    0.5\n"}, "deck.txt:5: CaAx: added mass along a line"),
        ({"0.1    0.0\n": "0.1    0.0   0.8\n"}, "deck.txt:5: Cl: vortex-induced vibration"),
        ({"0.002    dtM": "7 WaveKin"}, "deck.txt:17: WaveKin: waves: left out"),
        ({"0.002    dtM": "50 WtrDpth"}, "deck.txt:17: WtrDpth: contact with the sea floor"),
        ({"0.002    dtM": "3e6 kBot"}, "deck.txt:17: option kBot is not used"),
        (
            {
                "2    Coupled ": "2    Fixed 1 1 -1 0 0 0 0\n3    Coupled ",
                "        2        65": " 3 65",
            },
            "deck.txt:10: point 2 holds no line",
        ),
        (
            {"--- need this line": "--- OUTPUTS ---\nFairTen1\n--- need this line"},
            "deck.txt:19: OUTPUTS: the choice of output is left out",
        ),
        (
            {"--- need this line": "--- SPRINGS ---\n1 2 3\n--- need this line"},
            "deck.txt:18: 'SPRINGS': a section of no known name",
        ),
    ],
)  # fmt: skip
def test_what_is_left_out_is_named(read, change, warning):
    deck = read(CHAIN, change)
    assert [text for text in deck.warnings if text.startswith(warning)], deck.warnings


@pytest.mark.parametrize(
    ("deck", "old", "new", "message"),
    [
        (CHAIN, "2.0e6 ", "2e6|4e6", "5: EA 2e6|4e6: only a constant"),
        (CHAIN, "2.0e6 ", "polyester.txt ", "5: EA polyester.txt"),
        (CHAIN, "-0.5       0 ", "-0.5", "5: a line type of MoorDyn v1"),
        (CHAIN, "20.0     2.0e6", "heavy 2.0e6", "5: Mass/m is no number: 'heavy'"),
        (CHAIN, "65        80", "65", "14: NumSegs is no whole number: 'p'"),
        (CHAIN, "65        80       p", "65", "14: 5 values, and none for NumSegs"),
        (CHAIN, "1    chain     1", "1 rope 1", "14: there is no line type 'rope'"),
        (CHAIN, "        2        65", " 7 65", "14: '7' is not there"),
        (CHAIN, "        2        65", " R1A 65", "14: 'R1A' is not there"),
        (CHAIN, "        2        65", " end 65", "14: 'end' is neither a point"),
        (CHAIN, "2    Coupled", "3    Coupled", "10: ID 3 in POINTS: the next is 2"),
        (CHAIN, "2    Coupled", "2    Floating", "10: a point of the kind Floating"),
        (CHAIN, "- LINES -", "- POINTS -", "11: a second section POINTS"),
        (CHAIN, "1025.0   WtrDnsty ", "nan rho ", "16: rho is not finite"),
        (CHAIN, "-10    0      0       0     0", "-10 0 0 1 2 3 0 0", "10: a steady force"),
        (TOW, "hull     Free", "hull Pinned", "16: a rod of the kind Pinned"),
        (TOW, "-2.8  10", "-2.8  0", "16: a rod of no length (NumSegs 0) must be fixed"),
        (TOW, "hull     Free", "hull Body3", "16: there is no body 3"),
        (ROD_ON_A_BODY, "2e-3  0 ", "2e-3 0.5 ", "16: CdA and Ca of a body"),
        (ROD_ON_A_BODY, "1   free ", "1   CoupledPinned", "16: a body of the kind CoupledPinned"),
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
