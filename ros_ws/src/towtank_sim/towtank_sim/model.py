# SPDX-License-Identifier: Apache-2.0
"""The simulation model of the tow that a rig file describes."""

from __future__ import annotations

import math

from towtank_rig import Rig
from towtank_rig.tow import Depressor, Fin, Fish, Line

import sim_core as sc

LINES = ("primary", "depressor", "secondary")
LEAST_SEGMENTS = 2  # of each line: fewer cannot bend


class ModelError(ValueError):
    """No model can be made with these settings."""


def share_segments(total: int, lengths: list[float]) -> list[int]:
    """Share `total` segments among lines of the given lengths (m), so that all are about as long.

    Each line gets LEAST_SEGMENTS; what remains goes, one by one, to the line whose segments are
    the longest. Raises ModelError if `total` is not enough for that.
    """
    if total < LEAST_SEGMENTS * len(lengths):
        raise ModelError(
            f"{total} segments are too few for {len(lengths)} lines: "
            f"give at least {LEAST_SEGMENTS * len(lengths)}"
        )
    counts = [LEAST_SEGMENTS] * len(lengths)
    for _ in range(total - sum(counts)):
        longest = max(range(len(lengths)), key=lambda i: lengths[i] / counts[i])
        counts[longest] += 1
    return counts


def segment_counts(rig: Rig, segments: int) -> dict[str, int]:
    """Return the number of segments of each line.

    segments: all lines together, shared by `share_segments`; 0 takes the rig file's own numbers.
    """
    lines = {name: getattr(rig.lines, name) for name in LINES}
    if segments == 0:
        return {name: line.segments for name, line in lines.items()}
    shares = share_segments(segments, [line.length.value for line in lines.values()])
    return dict(zip(lines, shares, strict=True))


def describe_tow(rig: Rig, segments: int = 0) -> sc.System:
    """Return the description of the rig's tow, to be changed and built.

    Its points are tow_point (prescribed), junction and depressor (free), its body is fish, its
    lines primary, depressor and secondary, each from the point nearer to the carriage to the
    farther one. segments: see `segment_counts`. Raises ModelError.
    """
    density = rig.water.density.value
    counts = segment_counts(rig, segments)
    tow_point = rig.fish.tow_point.value
    return sc.System(
        water=sc.Water(density=density, gravity=rig.water.gravity.value),
        points={
            "tow_point": sc.PrescribedPoint(),
            "junction": sc.FreePoint(),
            "depressor": depressor_point(rig.depressor, density),
        },
        bodies={"fish": fish_body(rig.fish, density)},
        lines={
            name: sc.Line(
                start,
                end,
                line_properties(getattr(rig.lines, name), density),
                segments=counts[name],
                attachment=tow_point if end == "fish" else None,
            )
            for name, start, end in (
                ("primary", "tow_point", "junction"),
                ("depressor", "junction", "depressor"),
                ("secondary", "junction", "fish"),
            )
        },
    )


def build_model(rig: Rig, segments: int = 0) -> sc.Model:
    """Return the model of what `describe_tow` describes.

    Raises ModelError, or sim_core's InvalidInput.
    """
    return describe_tow(rig, segments).build()


def line_properties(line: Line, density: float) -> sc.LineProperties:
    """Return a line's properties; what it displaces follows from its two weights."""
    mass = line.mass_per_length.value
    bending = line.bending_stiffness
    return sc.LineProperties(
        length=line.length.value,
        diameter=line.diameter.value,
        mass_per_length=mass,
        axial_stiffness=line.axial_stiffness.value,
        axial_damping=line.axial_damping.value,
        bending_stiffness=bending.value if bending else 0.0,
        normal_drag=line.normal_drag.value,
        tangential_drag=line.tangential_drag.value,
        added_mass=line.added_mass.value,
        displaced_area=(mass - line.weight_in_water_per_length.value) / density,
    )


def depressor_point(depressor: Depressor, density: float) -> sc.FreePoint:
    """Return the depressor, a sphere whose volume follows from its two weights."""
    mass = depressor.mass.value
    displaced_mass = mass - depressor.apparent_mass_in_water.value
    return sc.FreePoint(
        mass=mass,
        volume=displaced_mass / density,
        drag_area=depressor.drag.value * math.pi / 4 * depressor.diameter.value**2,
        added_mass=depressor.added_mass.value * displaced_mass,
    )


def fish_body(fish: Fish, density: float) -> sc.Body:
    """Return the fish as a rigid body about mid-hull.

    Inertias move from the centre of gravity to the origin (parallel axes; the products of inertia
    of an offset of millimetres are left out). The fins' added mass enters the diagonal of the
    hull's. It must not raise the Munk moment, since what a fin's moving water does in steady flow
    is in its lift already: the share of the Munk moment is lowered by as much.
    """
    mass = fish.mass_in_water_filled.value
    displaced_mass = fish.displaced_mass
    x, y, z = fish.centre_of_gravity.value
    axial = fish.added_mass_axial.value * displaced_mass
    lateral = fish.added_mass_lateral.value * displaced_mass
    rotational = fish.added_pitch_inertia.value
    fin = _fins_added_mass(fish.fins)
    fins_lateral = (fin[1] + fin[2]) / 2
    munk = fish.munk_moment.value
    if fins_lateral > 0.0 and lateral > axial:
        munk *= (lateral - axial) / (lateral - axial + fins_lateral)
    return sc.Body(
        mass=mass,
        inertia=(
            fish.roll_inertia.value + mass * (y * y + z * z),
            fish.pitch_inertia.value + mass * (x * x + z * z),
            fish.yaw_inertia.value + mass * (x * x + y * y),
        ),
        centre_of_gravity=(x, y, z),
        volume=displaced_mass / density,
        diameter=fish.diameter.value,
        length=fish.length.value,
        added_mass=(
            axial + fin[0],
            lateral + fin[1],
            lateral + fin[2],
            fin[3],
            rotational + fin[4],
            rotational + fin[5],
        ),
        axial_drag=fish.axial_drag.value,
        cross_flow_drag=fish.cross_flow_drag.value,
        munk_moment=munk,
        fins=[
            sc.Fin(
                position=fin.position.value,
                normal=_normal(fin),
                area=fin.area.value,
                lift_slope=fin.lift_slope.value,
                drag=fin.profile_drag.value,
                stall_angle=fin.stall_angle.value,
            )
            for fin in fish.fins
        ],
    )


def _normal(fin: Fin) -> tuple[float, float, float]:
    return (0.0, 0.0, 1.0) if fin.plane == "horizontal" else (0.0, 1.0, 0.0)


def _fins_added_mass(fins: tuple[Fin, ...]) -> list[float]:
    """Diagonal of the fins' added-mass matrix about the origin: x, y, z (kg); roll, pitch, yaw."""
    diagonal = [0.0] * 6
    for fin in fins:
        mass = fin.added_mass.value
        x, y, z = fin.position.value
        if fin.plane == "horizontal":  # moves water along z
            diagonal[2] += mass
            diagonal[3] += mass * y * y
            diagonal[4] += mass * x * x
        else:  # along y
            diagonal[1] += mass
            diagonal[3] += mass * z * z
            diagonal[5] += mass * x * x
    return diagonal
