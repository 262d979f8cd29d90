# SPDX-License-Identifier: Apache-2.0
"""One description of a two-part tow for comparisons with other programs.

What every program at hand can express, and nothing else: uniform cables, a junction, a sphere, and
a neutrally buoyant cylinder towed at its nose, without fins and without a Munk moment. The input
decks of the other programs are made from the same description (tests/benchmarks).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import sim_core as sc

DENSITY = 1000.0  # kg/m³
GRAVITY = 9.81  # m/s²
TOW_POINT_HEIGHT = -2.0  # m: everything stays immersed


@dataclass(frozen=True)
class Cable:
    length: float  # m
    mass_per_length: float  # kg/m
    diameter: float  # m
    stiffness: float  # EA, N
    segments: int
    normal_drag: float = 1.2
    tangential_drag: float = 0.01
    added_mass: float = 1.0


@dataclass(frozen=True)
class Sphere:
    mass: float  # kg
    diameter: float  # m
    drag: float = 0.47
    added_mass: float = 0.5

    @property
    def volume(self) -> float:  # m³
        return math.pi / 6.0 * self.diameter**3

    @property
    def drag_area(self) -> float:  # Cd A, m²
        return self.drag * math.pi / 4.0 * self.diameter**2


@dataclass(frozen=True)
class Cylinder:
    """The fish: as heavy as the water that it displaces, filled evenly."""

    length: float  # m
    diameter: float  # m
    axial_drag: float = 1.0  # on the frontal area
    cross_flow_drag: float = 1.1

    @property
    def mass(self) -> float:  # kg
        return DENSITY * math.pi / 4.0 * self.diameter**2 * self.length


@dataclass(frozen=True)
class TwoPartTow:
    primary: Cable
    depressor_cable: Cable
    secondary: Cable
    depressor: Sphere
    fish: Cylinder
    speed: float  # m/s
    heave: float  # radius of the crank, m
    period: float  # s
    rod_length: float = 0.35  # of the crank, m

    @property
    def cables(self) -> dict[str, Cable]:
        return {
            "primary": self.primary,
            "depressor_cable": self.depressor_cable,
            "secondary": self.secondary,
        }

    def model(self, fish_as_point: bool = False, waves: sc.Sea | None = None) -> sc.Model:
        """The tow in sim_core; the fish may be a point mass of its weight and drag along x."""
        b = sc.ModelBuilder(sc.Water(density=DENSITY, gravity=GRAVITY, waves=waves))
        b.add_prescribed_point("tow_point")
        b.add_free_point("junction")
        sphere = self.depressor
        b.add_free_point(
            "depressor",
            mass=sphere.mass,
            volume=sphere.volume,
            drag_area=sphere.drag_area,
            added_mass=sphere.added_mass * DENSITY * sphere.volume,
        )
        fish = self.fish
        if fish_as_point:
            frontal = math.pi / 4.0 * fish.diameter**2
            b.add_free_point(
                "fish",
                mass=fish.mass,
                volume=fish.mass / DENSITY,
                drag_area=fish.axial_drag * frontal,
            )
        else:
            b.add_body("fish", self._body())
        ends = {
            "primary": ("tow_point", "junction"),
            "depressor_cable": ("junction", "depressor"),
            "secondary": ("junction", "fish"),
        }
        for name, cable in self.cables.items():
            at_body = name == "secondary" and not fish_as_point
            b.add_line(
                name,
                *ends[name],
                sc.LineProperties(
                    length=cable.length,
                    diameter=cable.diameter,
                    mass_per_length=cable.mass_per_length,
                    axial_stiffness=cable.stiffness,
                    normal_drag=cable.normal_drag,
                    tangential_drag=cable.tangential_drag,
                    added_mass=cable.added_mass,
                ),
                segments=cable.segments,
                attachment=(0.5 * fish.length, 0.0, 0.0) if at_body else None,
            )
        return b.build()

    def _body(self) -> sc.Body:
        fish = self.fish
        radius = 0.5 * fish.diameter
        across = fish.mass * (fish.length**2 / 12.0 + radius**2 / 4.0)
        return sc.Body(
            mass=fish.mass,
            inertia=(0.5 * fish.mass * radius**2, across, across),
            volume=fish.mass / DENSITY,
            diameter=fish.diameter,
            length=fish.length,
            # A long cylinder: Ca 1 across and 0 along, strip by strip.
            added_mass=(
                0.0,
                fish.mass,
                fish.mass,
                0.0,
                fish.mass * fish.length**2 / 12.0,
                fish.mass * fish.length**2 / 12.0,
            ),
            axial_drag=fish.axial_drag,
            cross_flow_drag=fish.cross_flow_drag,
            munk_moment=0.0,
        )

    def motion(self, ramp_time: float, run_up_time: float = 0.0) -> sc.SliderCrank:
        return sc.SliderCrank(
            mean=(0.0, 0.0, TOW_POINT_HEIGHT),
            velocity=(self.speed, 0.0, 0.0),
            crank_radius=self.heave,
            rod_length=self.rod_length,
            period=self.period,
            ramp_time=ramp_time,
            run_up_time=run_up_time,
        )


def steady_start(tow: TwoPartTow) -> sc.State:
    """The steady tow from which the crank starts."""
    position = tow.motion(tow.period)(0.0).position
    return sc.steady_tow(tow.model(), position=position, velocity=(tow.speed, 0.0, 0.0))


@dataclass(frozen=True)
class Heave:
    """What a run in heave comes to, over whole periods at its end."""

    depressor: float  # amplitude, m
    fish: float  # amplitude at the nose, m
    tension: float  # mean at the top, N
    tension_amplitude: float  # half its range, N


def heave_of(
    period: float,
    periods: int,
    time: np.ndarray,
    depressor: np.ndarray,
    nose: np.ndarray,
    tension: np.ndarray,
) -> Heave:
    """From samples (heights in m, top tension in N) over the last so many periods."""
    last = time > time[-1] - periods * period + 1e-6
    time, tension = time[last] - time[last].mean(), tension[last]

    def amplitude(values: np.ndarray) -> float:
        # First harmonic, by least squares with mean, drift, curvature and three harmonics
        angle = 2.0 * np.pi * time / period
        basis = np.column_stack(
            [np.ones_like(time), time, time**2]
            + [f(k * angle) for k in (1, 2, 3) for f in (np.cos, np.sin)]
        )
        c = np.linalg.lstsq(basis, values[last], rcond=None)[0]
        return float(np.hypot(c[3], c[4]))

    return Heave(
        amplitude(depressor), amplitude(nose), float(tension.mean()), 0.5 * float(np.ptp(tension))
    )


def simulated_heave(
    tow: TwoPartTow, t_end: float, periods: int, *, max_step: float, output_step: float = 0.01
) -> Heave:
    """The tow in sim_core: from the steady tow, the crank up to speed within one period."""
    result = sc.run(
        tow.model(),
        tow.motion(tow.period),
        t_end=t_end,
        output_step=output_step,
        max_step=max_step,
    )
    nose = result.bodies["fish"].position_of((0.5 * tow.fish.length, 0.0, 0.0))
    return heave_of(
        tow.period,
        periods,
        result.time,
        result.points["depressor"].position[:, 2],
        nose[:, 2],
        result.lines["primary"].start_tension,
    )


def cable_of_volume(
    length: float, mass_per_length: float, mass_in_water: float, stiffness: float, segments: int
) -> Cable:
    """A cable whose diameter follows from the volume that it displaces."""
    area = (mass_per_length - mass_in_water) / DENSITY
    diameter = math.sqrt(4.0 * area / math.pi)
    return Cable(length, mass_per_length, diameter, stiffness, segments)


def wu_chwang(segments: tuple[int, int, int]) -> TwoPartTow:
    """The tow of Wu & Chwang (2001) with segments in primary, depressor cable and secondary."""
    stiffness = 200e9 * math.pi / 4.0 * 0.002**2  # 2 mm steel wire
    mass, length = 12.5, 1.3
    return TwoPartTow(
        primary=cable_of_volume(2.84, 0.181, 0.104, stiffness, segments[0]),
        depressor_cable=cable_of_volume(0.30, 0.063, 0.039, stiffness, segments[1]),
        secondary=cable_of_volume(1.50, 0.124, 0.065, stiffness, segments[2]),
        depressor=Sphere(mass=5.25, diameter=0.11),
        fish=Cylinder(length, math.sqrt(4.0 * mass / (DENSITY * math.pi * length))),
        speed=1.75,
        heave=0.1,
        period=1.6,
    )
