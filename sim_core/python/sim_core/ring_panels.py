# SPDX-License-Identifier: Apache-2.0
"""Potential flow round a moving body of revolution, by a panel method of rings.

On the surface the potential φ(x, r) cos mθ, m = 0 for motion along the axis and 1 across it, obeys
Green's identity ½ φ = ∫ (φ ∂G/∂n − G ∂φ/∂n) dS, G = 1/(4πR), n into the water (Newman, Marine
Hydrodynamics, 1977, § 4.11; Hess & Smith 1967, Prog. Aeronaut. Sci. 8, 1–138, on panels). Rings are
straight pieces of the meridian with constant φ, taken at their middles. The integrals over θ are
complete elliptic ones; a ring's own ∂G/∂n follows from an interior potential, 1 or r cos θ, for
which the identity holds with −½ φ.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(6)
HALVINGS = 8  #: of a ring towards its middle, where its own G is singular like a logarithm


def elliptic(complement: Array) -> tuple[Array, Array]:
    """Return the complete elliptic integrals K and E of the parameter 1 − `complement`.

    By the arithmetic-geometric mean (Abramowitz & Stegun, § 17.6), to rounding.
    """
    a, b = np.ones_like(complement), np.sqrt(complement)
    loss = 0.5 * (1.0 - complement)
    power = 0.5
    for _ in range(9):  # quadratic: from 1 and 1e-8 to rounding
        a, b, c = 0.5 * (a + b), np.sqrt(a * b), 0.5 * (a - b)
        power *= 2.0
        loss = loss + power * c**2
    first = 0.5 * math.pi / a
    return first, first * (1.0 - loss)


def ring_integrals(m: int, at: Array, ring: Array, normal: Array) -> tuple[Array, Array]:
    """∫ cos mθ G r' dθ and ∫ cos mθ ∂G/∂n' r' dθ.

    at: (n, 1, 2), places (x, r); ring: (k, 2), of rings with the normal (2,). Both (n, k).
    """
    x, r = at[..., 0] - ring[:, 0], at[..., 1]
    r_ring = ring[:, 1]
    a = x**2 + r**2 + r_ring**2
    b = 2.0 * r * r_ring
    near, far = x**2 + (r - r_ring) ** 2, np.sqrt(a + b)
    first, second = elliptic(near / (a + b))
    j0 = 4.0 * first / far  # ∫ (a − b cos θ)^−1/2 dθ over the circle
    i0 = 4.0 * second / (near * far)  # … ^−3/2
    j1 = (a * j0 - 4.0 * far * second) / b  # … cos θ
    i1 = (a * i0 - j0) / b
    i2 = (a * i1 - j1) / b  # … cos² θ
    if m == 0:
        single, moved, turned = j0, i0, i1
    else:
        single, moved, turned = j1, i1, i2
    double = (x * normal[0] - r_ring * normal[1]) * moved + r * normal[1] * turned
    return single * r_ring / (4.0 * math.pi), double * r_ring / (4.0 * math.pi)


def towards_the_middle() -> tuple[Array, Array]:
    """Gauss's points and weights on 0 … 1, on pieces that halve towards the middle."""
    half = 0.5 * np.concatenate([[0.0], 0.5 ** np.arange(HALVINGS, -1, -1)])
    cuts = np.concatenate([0.5 - half[::-1], 0.5 + half[1:]])
    width = np.diff(cuts)[:, None]
    return (cuts[:-1, None] + 0.5 * width * (1.0 + POINTS)).ravel(), (0.5 * width * WEIGHTS).ravel()


class Rings:
    """A meridian (n + 1, 2) from tail to nose, points (x, r) in m, as n rings."""

    def __init__(self, meridian: Array) -> None:
        along = np.diff(meridian, axis=0)
        self.length = np.hypot(along[:, 0], along[:, 1])
        self.start, self.along = meridian[:-1], along
        self.middle = self.start + 0.5 * along
        self.normal = np.column_stack([-along[:, 1], along[:, 0]]) / self.length[:, None]

    def impulse(self, m: int, motions: Array) -> Array:
        """(k, k) impulse over density of motions (n, k): their normal velocities over cos mθ."""
        size = len(self.length)
        single, double = np.empty((size, size)), np.empty((size, size))
        share, weight = towards_the_middle()
        at = self.middle[:, None, :]
        for j in range(size):
            points = self.start[j] + share[:, None] * self.along[j]
            of_single, of_double = ring_integrals(m, at, points, self.normal[j])
            single[:, j] = of_single @ (weight * self.length[j])
            double[:, j] = of_double @ (weight * self.length[j])
        radius = self.middle[:, 1]
        inside = np.ones(size) if m == 0 else radius
        flux = np.zeros(size) if m == 0 else self.normal[:, 1]
        np.fill_diagonal(double, 0.0)
        np.fill_diagonal(double, (single @ flux - double @ inside) / inside - 0.5)
        potential = np.linalg.solve(0.5 * np.eye(size) - double, -single @ motions)
        circle = (2.0 if m == 0 else 1.0) * math.pi * radius * self.length
        matrix = -(motions * circle[:, None]).T @ potential
        symmetric: Array = 0.5 * (matrix + matrix.T)
        return symmetric
