# SPDX-License-Identifier: Apache-2.0
"""The tow at rest and in steady towing: where it hangs, by the simulator of the twin."""

from __future__ import annotations

from dataclasses import dataclass

from towtank_rig import Quantity, Rig
from towtank_sim.axes import to_tank
from towtank_sim.model import LINES
from towtank_sim.tow import Tow

Point = tuple[float, float]

_STEP_S = 0.01  # of a simulator that only starts


@dataclass(frozen=True)
class Equilibrium:
    """Places are x forward, z up from still water, m, the tow point at x = 0.

    Attributes:
        lines: Nodes of each line by its name, from its upper end on.
        tensions: Tension of the uppermost segment of each line, N.
        at_junction: Tension of each line's segment at the junction, N.
        fish: Origin of the fish, mid-hull.
        forward: Direction of the fish's x axis.
    """

    lines: dict[str, list[Point]]
    tensions: dict[str, float]
    at_junction: dict[str, float]
    fish: Point
    forward: Point

    @property
    def junction(self) -> Point:
        return self.lines["primary"][-1]

    @property
    def depressor(self) -> Point:
        return self.lines["depressor"][-1]


def shaping(rig: Rig) -> tuple[Quantity, ...]:
    """Return the lengths and weights that the shape hangs on most."""
    lines = (rig.lines.primary, rig.lines.depressor, rig.lines.secondary)
    lengths = (line.length for line in lines)
    return (*lengths, rig.tow_point.height, rig.depressor.apparent_mass_in_water)


def hang(rig: Rig, speed: float) -> Equilibrium:
    """Return the tow with its tow point at mean height, towed at a steady speed, m/s, or at rest.

    Errors of sim_core (ConvergenceError) where there is no such state.
    """
    tow = Tow(rig, 0, _STEP_S)
    tow.start((0.0, 0.0, rig.tow_point.height.value), (speed, 0.0, 0.0))
    shapes, fish = tow.line_shapes(), tow.fish()
    lines: dict[str, list[Point]] = {}
    tensions: dict[str, float] = {}
    at_junction: dict[str, float] = {}
    node = segment = 0
    for name, count in zip(LINES, shapes.segments, strict=True):
        end = node + count + 1
        lines[name] = list(zip(shapes.x[node:end], shapes.z[node:end], strict=True))
        tensions[name] = shapes.tension[segment]
        nearest = segment + count - 1 if name == "primary" else segment
        at_junction[name] = shapes.tension[nearest]
        node, segment = end, segment + count
    ahead = to_tank(fish.quaternion, (1.0, 0.0, 0.0))
    return Equilibrium(
        lines,
        tensions,
        at_junction,
        (fish.position[0], fish.position[2]),
        (float(ahead[0]), float(ahead[2])),
    )
