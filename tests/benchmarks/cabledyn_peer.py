# SPDX-License-Identifier: Apache-2.0
"""A two-part tow in CableDyn, with the fish as a point mass: the input deck, and stepping it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from cabledyn.model import CableDyn
from two_part_tow import DENSITY, GRAVITY, Cable, TwoPartTow

import sim_core as sc


def deck(tow: TwoPartTow, top: float, time_step: float) -> str:
    """The tow as CableDyn input, hanging straight down from height `top` (m)."""

    def line_type(cable: Cable) -> str:
        return (
            f"{cable.diameter!r} {cable.mass_per_length!r} {cable.stiffness!r} 0 0 "
            f"{cable.normal_drag} {cable.tangential_drag} {cable.added_mass} 0"
        )

    sphere, fish = tow.depressor, tow.fish
    frontal = fish.axial_drag * math.pi / 4.0 * fish.diameter**2
    # Every line a little stretched: CableDyn's statics may fail from taut but unstrained ones.
    stretch = 3e-4  # m
    junction = top - tow.primary.length - stretch
    depressor = junction - tow.depressor_cable.length - stretch
    nose = junction - tow.secondary.length - stretch
    ends = {"primary": "1 2", "depressor_cable": "2 3", "secondary": "2 4"}
    rows = [
        "--- CableDyn Input File ---",
        "two-part tow",
        "--- LINE TYPES ---",
        "Name Diam Mass EA BA EI Cdn Cdt Can Cat",
        "(-) (m) (kg/m) (N) (N-s) (N-m^2) (-) (-) (-) (-)",
        *(f"{name} {line_type(cable)}" for name, cable in tow.cables.items()),
        "--- POINTS ---",
        "ID Type X Y Z Mass Vol CdA Ca",
        "(-) (-) (m) (m) (m) (kg) (m3) (m2) (-)",
        f"1 Coupled 0 0 {top!r} 0 0 0 0",
        f"2 Free 0 0 {junction!r} 0 0 0 0",
        f"3 Free 0 0 {depressor!r} {sphere.mass!r} {sphere.volume!r} {sphere.drag_area!r} "
        f"{sphere.added_mass}",
        f"4 Free 0 0 {nose!r} {fish.mass!r} {fish.mass / DENSITY!r} {frontal!r} 0",
        "--- LINES ---",
        "ID LineType NodeA NodeB UnstrLen NumSegs Outputs",
        "(-) (-) (-) (-) (m) (-) (-)",
        *(
            f"{i} {name} {ends[name]} {cable.length!r} {cable.segments} -"
            for i, (name, cable) in enumerate(tow.cables.items(), 1)
        ),
        "--- OPTIONS ---",
        f"{GRAVITY} g",
        f"{DENSITY} rhoW",
        "200 WtrDpth",
        f"{time_step} dtM",
        "1000 TMax",  # asked for with free points, not used when stepped from outside
        "--- need this line ---",
    ]
    return "\n".join(rows) + "\n"


class CableDynTow:
    """A tow in CableDyn, from rest."""

    def __init__(
        self, tow: TwoPartTow, motion: sc.Motion, time_step: float, directory: Path
    ) -> None:
        file = directory / "tow.dat"
        file.write_text(deck(tow, float(motion(0.0).position[2]), time_step))
        self._model = CableDyn(file)
        self._motion = motion
        self._step = time_step
        self._host = self._model.host_dofs()
        self._kinematics = [x.copy() for x in self._model.get_coupled_motion()]
        # Still water has to be given: without it CableDyn leaves out the drag of points.
        still = np.zeros(3 * self._model.n_points)
        self._model.update_point_fluid_fields(still, still, np.zeros(self._model.n_points), DENSITY)
        self.iterations = 0
        self.steps = 0

    @property
    def time(self) -> float:
        return self.steps * self._step

    def step_to(self, end: float) -> None:
        """Steps until `end` (s), a multiple of the time step."""
        while self.time < end - 0.5 * self._step:
            sample = self._motion(self.time + self._step)
            for values, now in zip(
                self._kinematics,
                (sample.position, sample.velocity, sample.acceleration),
                strict=True,
            ):
                values[self._host] = now
            self.iterations += self._model.step(self._step, *self._kinematics)
            self.steps += 1

    def depressor_height(self) -> float:
        return float(self._model.point(3).position()[2])

    def top_tension(self) -> float:
        return float(self._model.line(1).segment_tensions()[0])

    def close(self) -> None:
        self._model.close()
