# SPDX-License-Identifier: Apache-2.0
"""Mass, centre of gravity, inertia and buoyancy of a body, from its parts.

Weight, buoyancy and flooded water stay apart until they are added up: dry parts weigh and displace
by their solid volume, the water that the hull encloses weighs what it displaces and lends the
body its inertia. Enclosed water moves with the hull as a rigid body and stays in it, also where the
hull leaves the surface.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_core.arguments import require_finite


@dataclass(frozen=True)
class Part:
    """A piece of a body."""

    mass: float  #: kg
    volume: float  #: m³ of water that it displaces; 0 for what is inside a watertight part
    centre: Sequence[float]  #: (3,) m, body axes, of mass and volume
    #: kg·m² about its own centre: (Ixx, Iyy, Izz) or (3, 3); zero for a point
    inertia: Sequence[float] | NDArray[np.float64] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_finite("Part", name, value)


@dataclass(frozen=True)
class MassProperties:
    """What :class:`Body` wants to know; the fields have its argument names."""

    mass: float  #: kg
    inertia: NDArray[np.float64]  #: (3, 3) kg·m² about the origin
    centre_of_gravity: NDArray[np.float64]  #: (3,) m
    volume: float  #: m³
    centre_of_buoyancy: NDArray[np.float64]  #: (3,) m

    def weight_in_water(self, density: float = 1000.0, gravity: float = 9.81) -> float:
        """N, positive where the body sinks."""
        return gravity * (self.mass - density * self.volume)


def enclosed_water(
    volume: float,
    centre: Sequence[float],
    inertia_per_mass: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    density: float = 1000.0,
) -> Part:
    """Return the water in a flooded space as a part: it displaces what it weighs.

    volume: m³; inertia_per_mass: (3,) m², squared radii of gyration about its centre
    (see :func:`cylinder_gyration`); density: kg/m³ of the water around.
    """
    mass = density * volume
    return Part(mass, volume, centre, mass * np.asarray(inertia_per_mass, dtype=float))


def cylinder_gyration(length: float, diameter: float) -> NDArray[np.float64]:
    """Return the squared radii of gyration (3,) m² of an even cylinder along x about its centre."""
    across = length**2 / 12.0 + diameter**2 / 16.0
    return np.array([diameter**2 / 8.0, across, across])


def mass_properties(parts: Iterable[Part]) -> MassProperties:
    """Add up parts, inertia by the parallel-axis theorem. Raises ValueError without any mass."""
    mass = volume = 0.0
    moment, displaced_moment, inertia = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for part in parts:
        centre = np.asarray(part.centre, dtype=float)
        own = np.asarray(part.inertia, dtype=float)
        mass += part.mass
        volume += part.volume
        moment += part.mass * centre
        displaced_moment += part.volume * centre
        inertia += own if own.ndim == 2 else np.diag(own)
        inertia += part.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    if not mass > 0.0:
        raise ValueError("the parts have no mass")
    return MassProperties(
        mass=mass,
        inertia=inertia,
        centre_of_gravity=moment / mass,
        volume=volume,
        centre_of_buoyancy=displaced_moment / volume if volume > 0.0 else np.zeros(3),
    )
