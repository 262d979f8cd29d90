# SPDX-License-Identifier: Apache-2.0
"""What the builder accepts and how it refuses the rest."""

import pytest

import sim_core as sc

LINE = {"length": 1.0, "diameter": 0.01, "mass_per_length": 0.1, "axial_stiffness": 1e4}
BODY = {
    "mass": 5.0, "inertia": (0.1, 0.5, 0.5), "volume": 5e-3, "diameter": 0.1, "length": 1.0,
    "axial_drag": 0.3, "cross_flow_drag": 1.1,
}  # fmt: skip


def builder():
    b = sc.ModelBuilder()
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=1.0)
    return b


def add(b, start="top", end="end", segments=2, **changes):
    b.add_line("line", start, end, sc.LineProperties(**(LINE | changes)), segments=segments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, "line 'line': length"),
        ({"diameter": -1.0}, "diameter"),
        ({"mass_per_length": 0.0}, "mass_per_length"),
        ({"axial_stiffness": float("nan")}, "axial_stiffness"),
        ({"normal_drag": -0.1}, "normal_drag must not be below 0"),
        ({"segments": 0}, "segments"),
        ({"end": "ende"}, "'ende' is neither a point nor a body"),
        ({"end": "top"}, "same place"),
    ],
)
def test_refuses_impossible_lines(change, message):
    with pytest.raises(sc.InvalidInput, match=message):
        add(builder(), **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "body 'fish': mass"),
        ({"inertia": (0.1, 0.5, 0.0)}, "inertia"),
        ({"centre_of_gravity": (0.5, 0, 0)}, "inertia about the origin is too small"),
        ({"munk_moment": 1.5}, "munk_moment"),
        ({"strips": 0}, "strips"),
        ({"added_mass": (0, -1, 0, 0, 0, 0)}, "added_mass"),
        (
            {"fins": [sc.Fin(position=(0, 0, 0), normal=(1, 0, 0), area=1, lift_slope=1)]},
            "normal must not point along",
        ),
    ],
)
def test_refuses_impossible_bodies(change, message):
    with pytest.raises(sc.InvalidInput, match=message):
        builder().add_body("fish", sc.Body(**(BODY | change)))


def test_refuses_repeated_names():
    with pytest.raises(ValueError, match="exists already"):
        builder().add_free_point("top")


def test_refuses_what_hangs_on_nothing():
    b = builder()
    with pytest.raises(ValueError, match="point 'end': no line or joint holds it"):
        b.build()
    with pytest.raises(ValueError, match="at least one prescribed point"):
        sc.ModelBuilder().build()


def test_attachment_goes_with_bodies_only():
    b = builder()
    b.add_body("fish", sc.Body(**BODY))
    properties = sc.LineProperties(**LINE)
    with pytest.raises(ValueError, match="attachment is needed at a body"):
        b.add_line("line", "end", "fish", properties, segments=1)
    with pytest.raises(ValueError, match="only for an end at a body"):
        b.add_line("line", "top", "end", properties, segments=1, attachment=(0, 0, 0))


def test_two_prescribed_points_take_a_motion_each():
    b = builder()
    b.add_prescribed_point("anchor")
    add(b)
    properties = sc.LineProperties(**LINE)
    b.add_line("second", "end", "anchor", properties, segments=2)
    model = b.build()
    assert model.prescribed_points == ["top", "anchor"]
    state = sc.steady_tow(model, position={"top": (0, 0, -1), "anchor": (1.5, 0, -1)})
    simulator = sc.Simulator(model, state)
    top, anchor = (sc.SteadyTow(position=(x, 0, -1)) for x in (0, 1.5))
    simulator.step(0.1, {"top": top, "anchor": anchor})
    assert simulator.point_position("end")[0] == pytest.approx(0.75, abs=1e-6)
    with pytest.raises(ValueError, match="no motion for the prescribed point 'anchor'"):
        simulator.step(0.2, {"top": top})
    with pytest.raises(ValueError, match="dict"):
        simulator.step(0.2, top)
    with pytest.raises(ValueError, match="'end' is free"):
        simulator.step(0.2, {"top": top, "anchor": anchor, "end": top})


@pytest.mark.parametrize(
    ("motion", "said"),
    [
        (None, "motion is None: give a Motion .* for each of 'top'"),
        ({}, "no motion for the prescribed point 'top': give a Motion"),
        ({"top": None}, "the motion of 'top' is None"),
        (3.0, "motion is 3.0: give a Motion"),
    ],
)
def test_a_run_without_a_motion_says_what_to_give(motion, said):
    b = builder()
    add(b)
    with pytest.raises(sc.InvalidInput, match=said):
        sc.run(b.build(), motion, t_end=0.1)


def test_bodies_read_back_as_given():
    body = sc.Body(**BODY, centre_of_gravity=(0, 0, -0.02), munk_moment=0.5)
    assert body.centre_of_gravity.tolist() == [0, 0, -0.02]
    assert (body.mass, body.munk_moment, body.strips) == (5.0, 0.5, 20)
