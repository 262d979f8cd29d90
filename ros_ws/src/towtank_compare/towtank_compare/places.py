# SPDX-License-Identifier: Apache-2.0
"""Places on the fish at which its heave is taken. A pitching fish heaves differently along its
length, so that a heave ratio means nothing without its place."""

from __future__ import annotations

from dataclasses import dataclass

from towtank_rig import Rig


@dataclass(frozen=True)
class Place:
    """A named place on a body; position: m, body axes, from mid-hull."""

    name: str
    position: tuple[float, float, float]

    def __str__(self) -> str:
        x, y, z = self.position
        return f"{self.name} (x {x:+.3f} m, y {y:+.3f} m, z {z:+.3f} m from mid-hull)"


def pressure_port(rig: Rig) -> Place:
    """Where the fish's heave is measured, and compared."""
    return Place("pressure port", rig.sensors.fish_pressure.position.value)


def nose(rig: Rig) -> Place:
    """Foremost point of the hull."""
    return Place("nose", (rig.fish.length.value / 2, 0.0, 0.0))


def mid_hull(rig: Rig) -> Place:
    """Origin of the fish's axes."""
    return Place("mid-hull", (0.0, 0.0, 0.0))
