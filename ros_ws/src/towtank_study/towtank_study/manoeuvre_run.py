# SPDX-License-Identifier: Apache-2.0
"""A tow through a manoeuvre: histories, and the numbers that tell how it went."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from towtank_rig.document import Document

import sim_core as sc
from towtank_study.loading import validate
from towtank_study.manoeuvre import Manoeuvre, Stop, Turn

Array = NDArray[np.float64]

SETTLED = 0.01
"""A depth within this share of its lasting value, or a speed within this share of the tow's."""

FIGURES: dict[str, str] = {
    "depth_before": "m",
    "greatest_depth": "m",
    "depth_at_end": "m",
    "top_tension_before": "N",
    "greatest_top_tension": "N",
    "least_top_tension": "N",
    "ship_radius": "m",
    "body_radius": "m",
    "depth_in_turn": "m",
    "recovery_time": "s",
    "way_after_stop": "m",
    "time_to_rest": "s",
}
"""Names and units of all figures; those of the other kind of manoeuvre are left out.

depth_before, top_tension_before: of the steady straight tow. In a turn, over the last quarter of
the steady rate of turn: depth_in_turn, and body_radius, the radius on which the body goes round;
recovery_time from the ship's being straight again until the depth stays within 1 % of
depth_before. After a stop: way_after_stop and time_to_rest, of the body from the order to stop
until its speed stays below 1 % of the tow's. A time that the run does not contain is null.
"""


@dataclass(frozen=True)
class Passage:
    """What was recorded of one case, the sample of that number.

    time: s, (n,). ship, body: position, m, (n, 3). body_velocity: m/s, (n, 3). top_tension: N,
    (n,). figures: by name, see FIGURES.
    """

    sample: int
    time: Array
    ship: Array
    body: Array
    body_velocity: Array
    top_tension: Array
    figures: dict[str, float | None]

    def entry(self) -> dict[str, Any]:
        arrays = {name: getattr(self, name).tolist() for name in _ARRAYS}
        return {"sample": self.sample, **arrays, "figures": self.figures}

    @classmethod
    def of_entry(cls, entry: Mapping[str, Any]) -> Passage:
        arrays = {name: np.array(entry[name]) for name in _ARRAYS}
        return cls(sample=entry["sample"], **arrays, figures=entry["figures"])


_ARRAYS = ("time", "ship", "body", "body_velocity", "top_tension")


def case_of(document: Document, changes: Mapping[str, float | str]) -> Manoeuvre:
    """Return the study as one of its cases changes it; StudyError as for the file itself."""
    text = document.replaced({path: {"value": new} for path, new in changes.items()})
    return validate(Document(text, document.source), Manoeuvre)


def pass_through(sample: int, study: Manoeuvre) -> Passage:
    """Simulate the manoeuvre. Raises sim_core's InvalidInput and ConvergenceError."""
    result = sc.run(
        tow(study).build(),
        law(study.manoeuvre),
        t_end=study.manoeuvre.end.value,
        output_step=study.sample_interval.value,
        max_step=study.step.value,
    )
    body = result.points["body"]
    histories = {
        "time": result.time,
        "ship": result.points["ship"].position,
        "body": body.position,
        "body_velocity": body.velocity,
        "top_tension": result.lines["cable"].start_tension,
    }
    return Passage(sample=sample, **histories, figures=figures(study.manoeuvre, **histories))


def tow(study: Manoeuvre) -> sc.System:
    """The ship's tow point at the surface, the cable, and the body at its end."""
    cable, body, water = study.cable, study.body, study.water
    density, gravity = water.density.value, water.gravity.value
    displaced = cable.mass_per_length.value - cable.weight_in_water_per_length.value / gravity
    return sc.System(
        water=sc.Water(density=density, gravity=gravity),
        points={
            "ship": sc.PrescribedPoint(),
            "body": sc.FreePoint(
                mass=body.mass.value,
                volume=(body.mass.value - body.apparent_mass_in_water.value) / density,
                drag_area=body.drag_area.value,
                added_mass=body.added_mass.value,
            ),
        },
        lines={
            "cable": sc.Line(
                "ship",
                "body",
                sc.LineProperties(
                    length=cable.length.value,
                    diameter=cable.diameter.value,
                    mass_per_length=cable.mass_per_length.value,
                    axial_stiffness=cable.axial_stiffness.value,
                    normal_drag=cable.normal_drag.value,
                    tangential_drag=cable.tangential_drag.value,
                    added_mass=cable.added_mass.value,
                    displaced_area=displaced / density,
                ),
                segments=cable.segments,
            )
        },
    )


def law(manoeuvre: Turn | Stop) -> sc.Motion:
    """The ship's motion, along x before the manoeuvre."""
    common = {"position": (0.0, 0.0, 0.0), "velocity": (manoeuvre.speed.value, 0.0, 0.0)}
    if isinstance(manoeuvre, Stop):
        return sc.EmergencyStop(
            **common,
            stop_time=manoeuvre.start.value,
            stopping_time=manoeuvre.stopping_time.value,
        )
    return sc.Turn(
        **common,
        start_time=manoeuvre.start.value,
        angle=manoeuvre.angle.value,
        circle_time=manoeuvre.circle_time.value,
        entry_time=manoeuvre.entry_time.value,
    )


def figures(
    manoeuvre: Turn | Stop,
    time: Array,
    ship: Array,
    body: Array,
    body_velocity: Array,
    top_tension: Array,
) -> dict[str, float | None]:
    """Return the figures of a passage, see FIGURES."""
    depth = -body[:, 2]
    during = time >= manoeuvre.start.value
    found: dict[str, float | None] = {
        "depth_before": float(depth[0]),
        "greatest_depth": float(depth.max()),
        "depth_at_end": float(depth[-1]),
        "top_tension_before": float(top_tension[0]),
        "greatest_top_tension": float(top_tension.max()),
        "least_top_tension": float(top_tension.min()),
    }
    if isinstance(manoeuvre, Stop):
        slow = np.linalg.norm(body_velocity, axis=1) < SETTLED * manoeuvre.speed.value
        rest = _first_of_the_lasting(slow)
        steps = np.linalg.norm(np.diff(body[during], axis=0), axis=1)
        return found | {
            "way_after_stop": float(steps.sum()),
            "time_to_rest": _after(time, rest, manoeuvre.start.value),
        }
    rate = 2 * math.pi / manoeuvre.circle_time.value
    steady = manoeuvre.angle.value / rate - manoeuvre.entry_time.value
    straight_again = manoeuvre.start.value + steady + 2 * manoeuvre.entry_time.value
    fading = straight_again - manoeuvre.entry_time.value
    last_quarter = (time >= fading - steady / 4) & (time <= fading)
    speed = np.linalg.norm(body_velocity[last_quarter, :2], axis=1)
    recovered = (np.abs(depth / depth[0] - 1.0) < SETTLED) & (time >= straight_again)
    return found | {
        "ship_radius": manoeuvre.speed.value / rate,
        "body_radius": float(speed.mean()) / rate,
        "depth_in_turn": float(depth[last_quarter].mean()),
        "recovery_time": _after(time, _first_of_the_lasting(recovered), straight_again),
    }


def _first_of_the_lasting(holds: NDArray[np.bool_]) -> int | None:
    """Return the index from which on something holds to the end."""
    if not holds[-1]:
        return None
    failing = np.flatnonzero(~holds)
    return int(failing[-1] + 1) if len(failing) else 0


def _after(time: Array, index: int | None, start: float) -> float | None:
    return None if index is None else float(time[index] - start)
