# SPDX-License-Identifier: Apache-2.0
"""Heave samples out of what the topics carry, live or from a bag."""

from __future__ import annotations

import numpy as np
from towtank_bag.reader import Bag
from towtank_node.names import CRANK_JOINT, DEPRESSOR, FISH, MEASURED, PLANT, TWIN
from towtank_node.topics import DEPTH, DEPTHS, MEASURED_JOINTS, ODOMETRY
from towtank_rig import Rig

from towtank_compare.heave import HeaveSamples
from towtank_compare.kinematics import place_height
from towtank_compare.places import Place, pressure_port
from towtank_compare.series import Series

SIMULATED = (TWIN, PLANT)


def measured_heave(stamp_ns: np.ndarray, depth: np.ndarray, valid: np.ndarray) -> Series:
    """Heave (m, upwards) of a pressure port: depth downwards turned round, bad samples left out."""
    valid = np.asarray(valid, dtype=bool)
    return Series.of(np.asarray(stamp_ns)[valid], -np.asarray(depth, dtype=float)[valid])


def simulated_heave(
    stamp_ns: np.ndarray, z: np.ndarray, quaternion: np.ndarray, place: tuple[float, ...]
) -> Series:
    """Heave (m, upwards) of a place on a simulated body; see `kinematics.place_height`."""
    quaternion = np.asarray(quaternion, dtype=float).reshape(-1, 4)
    return Series.of(stamp_ns, place_height(np.asarray(z, dtype=float), quaternion, place))


def depressor_place(rig: Rig) -> tuple[float, float, float]:
    """Where the depressor's heave is measured, m, its axes."""
    return rig.sensors.depressor_pressure.position.value


def joint_series(bag: Bag, topic: str, joint: str, field: str = "position") -> Series:
    """Position (or velocity) of one joint of a JointState topic; empty where it is missing."""
    joints = bag.series(topic, ["name", field])
    if not len(joints["stamp_ns"]):
        return Series.of([], [])
    names = list(joints["name"][0])
    if joint not in names:
        return Series.of([], [])
    values = np.array([row[names.index(joint)] for row in joints[field]], dtype=float)
    return Series.of(joints["stamp_ns"], values)


def body_heave(bag: Bag, topic: str, place: tuple[float, ...]) -> Series:
    """Heave of a place on a body from its odometry; empty where the bag has none."""
    position = "pose.pose.position.z"
    turn = [f"pose.pose.orientation.{axis}" for axis in "xyzw"]
    poses = bag.series(topic, [position, *turn])
    quaternion = np.column_stack([poses[name] for name in turn])
    return simulated_heave(poses["stamp_ns"], poses[position], quaternion, place)


def bag_samples(bag: Bag, rig: Rig, source: str, fish_place: Place | None = None) -> HeaveSamples:
    """Samples of one source of a bag: measured, twin or plant.

    fish_place: place on the fish, for a simulated source; its pressure port if None.
    """
    crank = joint_series(bag, MEASURED_JOINTS.name, CRANK_JOINT)
    if source == MEASURED:
        fish, depressor = (
            measured_heave(depths["stamp_ns"], depths["depth"], depths["valid"])
            for depths in (bag.series(topic.name, ["depth", "valid"]) for topic in DEPTHS.values())
        )
        zero_depths = tuple(zero_depth(bag, topic.name) for topic in DEPTHS.values())
        return HeaveSamples(MEASURED, crank, fish, depressor, zero_depths)
    place = fish_place or pressure_port(rig)
    return HeaveSamples(
        source,
        crank,
        body_heave(bag, ODOMETRY.within(source, FISH).name, place.position),
        body_heave(bag, ODOMETRY.within(source, DEPRESSOR).name, depressor_place(rig)),
    )


def zero_depth(bag: Bag, topic: str) -> float:
    """Where the sensor of a depth topic was zeroed at last, m below still water; 0 if it was not,
    or where the bag is too old to tell."""
    if not bag.has_field(topic, "zero_depth"):
        return 0.0
    depths = bag.series(topic, ["zero_depth"])["zero_depth"]
    known = depths[np.isfinite(depths)]
    return float(known[-1]) if len(known) else 0.0


def has_source(bag: Bag, source: str) -> bool:
    """Whether a bag holds samples of a source."""
    topic = (DEPTH if source == MEASURED else ODOMETRY).within(source, FISH).name
    return topic in bag.topics and bag.topics[topic].count > 0
