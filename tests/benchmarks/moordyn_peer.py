# SPDX-License-Identifier: Apache-2.0
"""A two-part tow in MoorDyn: the input deck, and stepping it.

The fish is a free rod: cross-flow drag and added mass of its strips, axial drag half at each end,
no Munk moment. The lines have no structural damping (nor have ours), so that the fourth-order
Runge-Kutta scheme is stable up to 2.8 over the highest natural frequency.
"""

from __future__ import annotations

import contextlib
import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import moordyn
import numpy as np
from two_part_tow import DENSITY, GRAVITY, Cable, Heave, TwoPartTow, heave_of, steady_start

import sim_core as sc

ROD_SEGMENTS = 10
#: MoorDyn joins the samples of the tow point by straight lines, so they must be close.
COUPLING_STEP = 3e-4  # s


def deck(tow: TwoPartTow, start: sc.State, time_step: float) -> str:
    """The tow as MoorDyn input, at the place where `start` has it."""
    junction, depressor = start.point_position("junction"), start.point_position("depressor")
    nose = start.node_positions("secondary")[-1]
    tail = 2.0 * start.body_position("fish") - nose
    top = start.point_position("tow_point")

    def line_type(cable: Cable) -> str:
        return (
            f"{cable.diameter!r} {cable.mass_per_length!r} {cable.stiffness!r} 0.0 0.0 "
            f"{cable.normal_drag} {cable.added_mass} {cable.tangential_drag} 0.0"
        )

    def place(position: np.ndarray) -> str:
        return " ".join(repr(float(x)) for x in position)

    fish, sphere = tow.fish, tow.depressor
    rows = [
        "--- two-part tow ---",
        "---------------------- LINE TYPES ----------------------",
        "Name Diam MassDen EA BA EI Cd Ca CdAx CaAx",
        "(-) (m) (kg/m) (N) (N-s) (N-m2) (-) (-) (-) (-)",
        *(f"{name} {line_type(cable)}" for name, cable in tow.cables.items()),
        "---------------------- ROD TYPES ----------------------",
        "Name Diam MassDen Cd Ca CdEnd CaEnd",
        "(-) (m) (kg/m) (-) (-) (-) (-)",
        f"hull {fish.diameter!r} {fish.mass / fish.length!r} {fish.cross_flow_drag} 1.0 "
        f"{0.5 * fish.axial_drag} 0.0",
        "---------------------- RODS ----------------------",
        "ID Type Attachment Xa Ya Za Xb Yb Zb NumSegs Outputs",
        "(-) (-) (-) (m) (m) (m) (m) (m) (m) (-) (-)",
        f"1 hull Free {place(nose)} {place(tail)} {ROD_SEGMENTS} -",
        "---------------------- POINTS ----------------------",
        "ID Attachment X Y Z Mass Volume CdA Ca",
        "(-) (-) (m) (m) (m) (kg) (m3) (m2) (-)",
        f"1 Coupled {place(top)} 0 0 0 0",
        f"2 Free {place(junction)} 0 0 0 0",
        f"3 Free {place(depressor)} {sphere.mass!r} {sphere.volume!r} {sphere.drag_area!r} "
        f"{sphere.added_mass}",
        "---------------------- LINES ----------------------",
        "ID LineType AttachA AttachB UnstrLen NumSegs Outputs",
        "(-) (-) (-) (-) (m) (-) (-)",
        *(
            f"{i} {name} {ends} {tow.cables[name].length!r} {tow.cables[name].segments} -"
            for i, (name, ends) in enumerate(
                {"primary": "1 2", "depressor_cable": "2 3", "secondary": "2 R1A"}.items(), 1
            )
        ),
        "---------------------- OPTIONS ----------------------",
        "0 writeLog",
        "1 disableOutput",
        f"{time_step!r} dtM",
        "RK4 tScheme",
        f"{GRAVITY} g",
        f"{DENSITY} WtrDnsty",
        "1000 WtrDpth",
        "---------------------- OUTPUTS ----------------------",
        "---------------------- END ----------------------",
    ]
    return "\n".join(rows) + "\n"


@contextlib.contextmanager
def silence() -> Iterator[None]:
    """MoorDyn's library writes to the standard streams; keep what it says of blown-up runs away."""
    sys.stdout.flush()
    sys.stderr.flush()
    saved = [os.dup(1), os.dup(2)]
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 1)
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(saved[0], 1)
        os.dup2(saved[1], 2)
        for descriptor in (*saved, null):
            os.close(descriptor)


class MoorDynTow:
    """A tow in MoorDyn, starting in sim_core's steady tow."""

    def __init__(self, tow: TwoPartTow, time_step: float, directory: Path) -> None:
        start = steady_start(tow)
        file = directory / "tow.txt"
        file.write_text(deck(tow, start, time_step))
        self.time = 0.0
        self._position = start.point_position("tow_point").tolist()
        per_call = max(1, round(COUPLING_STEP / time_step))
        self._coupling_step = per_call * time_step
        with silence():
            self._system = moordyn.Create(str(file))
            # Without MoorDyn's own search for an equilibrium, which knows no tow
            velocity = [tow.speed, 0.0, 0.0]
            moordyn.Init_NoIC(self._system, self._position, velocity)
            saved = directory / "state"
            moordyn.SaveState(self._system, str(saved))
            saved.write_bytes(_moving(saved.read_bytes(), start, list(tow.cables), velocity))
            moordyn.LoadState(self._system, str(saved))
        self._lines = [moordyn.GetLine(self._system, i + 1) for i in range(len(tow.cables))]
        self._depressor = moordyn.GetPoint(self._system, 3)
        self._fish = moordyn.GetRod(self._system, 1)

    def close(self) -> None:
        with silence():
            moordyn.Close(self._system)

    def track(self, motion: sc.Motion, end: float) -> list[list[float]]:
        """Where the law has the tow point after each coupling step until `end` (s)."""
        steps = round((end - self.time) / self._coupling_step)
        return [
            list(motion(self.time + (i + 1) * self._coupling_step).position) for i in range(steps)
        ]

    def follow(self, track: list[list[float]]) -> None:
        """Coupling steps along straight lines from place to place."""
        step = self._coupling_step
        for place in track:
            start = self._position
            velocity = [(b - a) / step for a, b in zip(start, place, strict=True)]
            moordyn.Step(self._system, start, velocity, self.time, step)
            self._position = place
            self.time += step

    @property
    def coupling_step(self) -> float:
        return self._coupling_step

    def depressor_height(self) -> float:
        return float(moordyn.GetPointPos(self._depressor)[2])

    def top_tension(self) -> float:
        return float(np.linalg.norm(moordyn.GetLineNodeTen(self._lines[0], 0)))

    def nose_height(self) -> float:
        return float(moordyn.GetRodNodePos(self._fish, 0)[2])

    def largest_tension(self) -> float:
        return max(float(moordyn.GetLineMaxTen(line)) for line in self._lines)

    def heave(self, motion: sc.Motion, t_end: float, period: float, periods: int) -> Heave:
        """Follows the law until `t_end` (s) and sums up the last so many periods."""
        track = self.track(motion, t_end)
        calls = max(1, round(0.01 / self._coupling_step))
        samples = []
        for i in range(0, len(track), calls):
            self.follow(track[i : i + calls])
            samples.append(
                (self.time, self.depressor_height(), self.nose_height(), self.top_tension())
            )
        return heave_of(period, periods, *np.array(samples).T)


def _moving(saved: bytes, start: sc.State, cables: list[str], velocity: list[float]) -> bytes:
    """MoorDyn's state file with the positions of `start` and one velocity for all.

    After 9 bytes of name and version and a count, it holds 64-bit words: the number of objects,
    then for each its rows and columns and a row-major array: the rod's end (position, quaternion,
    velocity, angular velocity), the points' and the lines' inner nodes' positions and velocities.
    """
    header = 9
    words = np.frombuffer(saved[header:], dtype=np.uint64)[1:].copy()
    arrays = []
    at = 1
    for _ in range(int(words[0])):
        rows, columns = (int(n) for n in words[at : at + 2])
        size = rows * columns
        arrays.append(words[at + 2 : at + 2 + size].view(np.float64).reshape(rows, columns))
        at += 2 + size
    rod, _, junction, depressor, *lines = arrays
    rod[0, 7:10] = velocity
    for name, point in (("junction", junction), ("depressor", depressor)):
        point[0, :3] = start.point_position(name)
        point[0, 3:] = velocity
    for name, nodes in zip(cables, lines, strict=True):
        nodes[:, :3] = start.node_positions(name)[1:-1]
        nodes[:, 3:] = velocity
    return saved[: header + 8] + words.tobytes()


def largest_stable_step(tow: TwoPartTow, directory: Path) -> float:
    """The largest stable time step of RK4, s, to 1 %, by bisection of runs in steady tow.

    1 % above the limit the fastest mode grows by 7 % a step, so 3000 steps bring it from rounding
    to a tension that is not there.
    """
    # 2.83 over the highest natural frequency 2c/l, where c² = EA/m
    fastest = max(
        2.0 * math.sqrt(c.stiffness / c.mass_per_length) * c.segments / c.length
        for c in tow.cables.values()
    )
    estimate = 2.0 * math.sqrt(2.0) / fastest
    motion = sc.SteadyTow(position=tow.motion(0.0)(0.0).position, velocity=(tow.speed, 0.0, 0.0))

    def stable(time_step: float) -> bool:
        peer = MoorDynTow(tow, time_step, directory)
        try:
            with silence():
                peer.follow(peer.track(motion, 300 * time_step))
                before = peer.largest_tension()
                peer.follow(peer.track(motion, 3000 * time_step))
                after = peer.largest_tension()
        except RuntimeError:  # MoorDyn found a position that is not a number
            return False
        finally:
            peer.close()
        return abs(after - before) < 0.05 * before

    low, high = 0.7 * estimate, 1.6 * estimate
    while high / low > 1.01:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low
