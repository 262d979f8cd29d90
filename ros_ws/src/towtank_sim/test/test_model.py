# SPDX-License-Identifier: Apache-2.0
"""The model that is built from a rig, and its state at rest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_sim.axes import to_tank
from towtank_sim.model import (
    LINES,
    ModelError,
    build_model,
    describe_tow,
    fish_body,
    line_properties,
    segment_counts,
    share_segments,
)
from towtank_sim.tow import BodyState, Tow, specific_force


@pytest.fixture(params=["nit_calicut", "wu_chwang"])
def rig(request):
    return request.getfixturevalue(request.param)


# -------------------------------------------------------------------------------- segments


def test_segments_are_shared_in_proportion(nit_calicut):
    # 1.2, 0.3 and 1.0 m. After 9, 2 and 8 segments the depressor line has the longest, 0.15 m.
    assert segment_counts(nit_calicut, 20) == {"primary": 9, "depressor": 3, "secondary": 8}


def test_zero_takes_the_rigs_own_segments(rig):
    counts = segment_counts(rig, 0)
    assert counts == {name: getattr(rig.lines, name).segments for name in LINES}


@given(lengths=st.lists(st.floats(0.01, 100.0), min_size=1, max_size=5), extra=st.integers(0, 200))
def test_shares_add_up_and_none_could_be_better_placed(lengths, extra):
    counts = share_segments(2 * len(lengths) + extra, lengths)
    assert sum(counts) == 2 * len(lengths) + extra
    assert min(counts) >= 2
    # A line that got more than its two would otherwise have had the longest segments of all.
    for length, count in zip(lengths, counts, strict=True):
        if count > 2:
            assert all(
                length / (count - 1) >= other / others * (1 - 1e-12)
                for other, others in zip(lengths, counts, strict=True)
            )


def test_too_few_segments_are_refused():
    with pytest.raises(ModelError, match="at least 6"):
        share_segments(5, [1.0, 1.0, 1.0])


# ------------------------------------------------------------------------------ properties


def test_line_displaces_what_its_weights_say(rig):
    density = rig.water.density.value
    for name in LINES:
        line = getattr(rig.lines, name)
        properties = line_properties(line, density)
        weight_in_water = properties.mass_per_length - density * properties.displaced_area
        assert weight_in_water == pytest.approx(line.weight_in_water_per_length.value, rel=1e-12)


def test_a_line_is_limp_unless_its_bending_stiffness_is_given(nit_calicut):
    stiff = replaced(nit_calicut, {"lines.primary.bending_stiffness": "0.2 N m^2"})
    density = nit_calicut.water.density.value
    assert line_properties(nit_calicut.lines.primary, density).bending_stiffness == 0.0
    assert line_properties(stiff.lines.primary, density).bending_stiffness == 0.2
    assert line_properties(stiff.lines.secondary, density).bending_stiffness == 0.0


def test_fish_inertia_moves_to_mid_hull(nit_calicut):
    """Steiner: I_origin = I_cg + m·(distance from the axis)²."""
    moved = replaced(nit_calicut, {"fish.centre_of_gravity.x": 0.01}).fish
    body = fish_body(moved, nit_calicut.water.density.value)
    mass, z = moved.mass_in_water_filled.value, moved.centre_of_gravity.z.value
    assert np.diag(body.inertia) == pytest.approx(
        (
            moved.roll_inertia.value + mass * z**2,
            moved.pitch_inertia.value + mass * (0.01**2 + z**2),
            moved.yaw_inertia.value + mass * 0.01**2,
        ),
        rel=1e-12,
    )


def test_fish_displaces_its_own_mass_where_it_is_neutral(nit_calicut):
    density = nit_calicut.water.density.value
    body = fish_body(nit_calicut.fish, density)
    weight_in_water = body.mass - density * body.volume
    assert weight_in_water == pytest.approx(
        nit_calicut.fish.apparent_mass_in_water.value, abs=1e-12
    )


def test_fins_add_mass_but_no_munk_moment(nit_calicut):
    density = nit_calicut.water.density.value
    fish = nit_calicut.fish
    body = fish_body(fish, density)
    axial = fish.added_mass_axial.value * fish.displaced_mass
    lateral = fish.added_mass_lateral.value * fish.displaced_mass
    # Two fins of 0.5 kg each way, 0.58 m abaft and 0.105 m off the axis.
    added_mass = np.diag(body.added_mass)
    assert added_mass[:3] == pytest.approx([axial, lateral + 1.0, lateral + 1.0], rel=1e-12)
    assert added_mass[3] == pytest.approx(4 * 0.5 * 0.105**2, rel=1e-12)
    assert added_mass[4] == pytest.approx(
        fish.added_pitch_inertia.value + 2 * 0.5 * 0.58**2, rel=1e-12
    )
    # Munk's moment is (lateral − axial)·U²·sin α cos α times the share.
    assert body.munk_moment * (added_mass[2] - axial) == pytest.approx(
        fish.munk_moment.value * (lateral - axial), rel=1e-12
    )


def test_a_changed_copy_of_a_rigs_tow_is_what_the_changed_rig_gives(nit_calicut):
    changed = describe_tow(nit_calicut).replace({"lines.primary.properties.length": 1.4})
    assert changed == describe_tow(replaced(nit_calicut, {"lines.primary.length": 1.4}))
    assert changed != describe_tow(nit_calicut)


# ---------------------------------------------------------------------------------- at rest


def hanging(rig):
    tow = Tow(rig, segments=20, step=0.005)
    tow.start((3.0, 0.0, rig.tow_point.height.value), (0.0, 0.0, 0.0))
    return tow


def test_at_rest_the_tow_point_carries_all_weights(wu_chwang):
    """All of this tow is under water. Its lines hang straight down, whatever else they do."""
    gravity = wu_chwang.water.gravity.value
    lines = [getattr(wu_chwang.lines, name) for name in LINES]
    weight = gravity * (
        wu_chwang.depressor.apparent_mass_in_water.value
        + wu_chwang.fish.apparent_mass_in_water.value
        + sum(line.weight_in_water_per_length.value * line.length.value for line in lines)
    )
    # Statics ends at residuals of a millionth of the weight or less.
    assert hanging(wu_chwang).top_tension() == pytest.approx(weight, rel=1e-5)


def test_at_rest_the_lines_hang_below_the_tow_point(rig):
    tow = hanging(rig)
    shapes = tow.line_shapes()
    assert shapes.x[0] == 3.0
    assert shapes.z[0] == rig.tow_point.height.value
    depth = rig.lines.primary.length.value + rig.lines.depressor.length.value
    x, y, z = tow.depressor().position
    assert (x, y) == pytest.approx((3.0, 0.0), abs=1e-3)
    unstretched = rig.tow_point.height.value - depth
    # Wire rope stretches by T·L/EA, some tenths of a millimetre; T is largest at the top.
    stretch = tow.top_tension() * depth / rig.lines.primary.axial_stiffness.value
    assert unstretched - stretch < z < unstretched


def test_at_rest_nothing_moves(rig):
    tow = hanging(rig)
    start = tow.fish().position
    for i in range(1, 101):
        tow.step_to(0.01 * i, (3.0, 0.0, rig.tow_point.height.value), (0.0, 0.0, 0.0))
    assert tow.time == 1.0
    # The residuals of statics, under a millinewton on 20 kg, move it by less than this in 1 s.
    assert tow.fish().position == pytest.approx(start, abs=5e-5)


# --------------------------------------------------------------------------- specific force


def test_specific_force_of_a_turning_body():
    """Turning about y at 2 rad/s and 5 rad/s², the place 0.3 m ahead of the origin."""
    angle = 0.4
    state = BodyState(
        position=(0.0, 0.0, 0.0),
        quaternion=(math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0),
        velocity=(1.0, 0.0, 0.0),
        acceleration=(0.5, 0.0, 0.0),
        angular_velocity=(0.0, 2.0, 0.0),
        angular_acceleration=(0.0, 5.0, 0.0),
    )
    force = specific_force(state, (0.3, 0.0, 0.0), 9.8)
    # a + g ẑ in body axes, bow down by `angle`; ω × (ω × r) = −ω²r; α × r = −α·r ẑ.
    expected = (
        0.5 * math.cos(angle) - 9.8 * math.sin(angle) - 4.0 * 0.3,
        0.0,
        0.5 * math.sin(angle) + 9.8 * math.cos(angle) - 5.0 * 0.3,
    )
    assert force == pytest.approx(expected, abs=1e-12)


def test_rotation_turns_the_bow_down_with_positive_pitch():
    quaternion = (math.cos(0.1), 0.0, math.sin(0.1), 0.0)  # 0.2 rad about +y (REP-103)
    assert to_tank(quaternion, (1.0, 0.0, 0.0)) == pytest.approx(
        (math.cos(0.2), 0.0, -math.sin(0.2)), abs=1e-15
    )


def test_a_model_is_built_from_every_rig_file(pytestconfig):
    files = sorted((pytestconfig.rootpath / "hardware" / "rigs").glob("*.yaml"))
    assert len(files) >= 2
    for file in files:
        model = build_model(load_rig(file))
        assert list(model.lines) == list(LINES)
        assert list(model.bodies) == ["fish"]
