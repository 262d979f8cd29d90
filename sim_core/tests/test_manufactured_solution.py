# SPDX-License-Identifier: Apache-2.0
"""A manufactured solution of a line's equations of motion, with all forces at once.

A smooth motion x(s, t) is chosen, and what the continuous equations leave unbalanced is applied to
the nodes. Then the nodes must follow x to second order in the length of a segment and in the step:
tension with damping, bending, weight, buoyancy, drag along and across, lift, added mass and
Froude-Krylov force in a sheared current with waves, each written here a second time, as a density
over the unstretched length s.

The equations and their Jacobian are the core's; the scheme is Newmark's (beta 1/4, gamma 1/2),
written out, since only thus a force can be applied at each node.
"""

import math

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

LENGTH = 2.0  # m, unstretched
DENSITY, GRAVITY = 1000.0, 9.81
DIAMETER, MASS = 0.02, 0.5  # m, kg/m
EA, DAMPING, EI = 2000.0, 60.0, 0.8  # N, N s, N m²
# Large enough that a tenth more of any one of them spoils the order
CN, CT, CL, CA, CA_ALONG = 1.2, 1.0, 0.4, 0.8, 0.5
AREA = math.pi * DIAMETER**2 / 4
DURATION = 0.4  # s

WATER = sc.Water(
    density=DENSITY,
    gravity=GRAVITY,
    current=sc.Current(
        uniform=(0.4, 0.2, 0.0), profile=[(0.0, (0.3, 0, 0)), (-4.0, (-0.3, 0.2, 0))]
    ),
    waves=sc.regular_waves(height=0.1, period=1.6, direction=0.4),
)

START, ALONG = np.array([0.0, 0.0, -0.8]), np.array([0.6, 0.0, -0.8])
STRETCH = 1.06  # taut throughout: the other parts of the strain are below 0.04
#: Half waves over the length, m, rad/s and rad. Sines end without curvature, as the hinged ends do.
WAVES = (
    (1, np.array([0.10, 0.0, 0.07]), 5.0, 0.3),
    (2, np.array([0.0, 0.05, 0.02]), 7.0, 1.1),
    (1, np.array([0.01, 0.08, 0.0]), 3.0, 2.0),
)


def motion(s, t, in_s, in_t):
    """The derivative of x of orders in_s and in_t, at one place s (m; may be complex)."""
    x = np.zeros(3, dtype=np.result_type(s, float))
    if in_t == 0:
        x = x + (START + STRETCH * s * ALONG if in_s == 0 else STRETCH * ALONG * (in_s == 1))
    for halves, amplitude, frequency, phase in WAVES:
        k = halves * math.pi / LENGTH
        over_length = k**in_s * np.sin(k * s + in_s * math.pi / 2)
        over_time = frequency**in_t * math.cos(frequency * t + phase + in_t * math.pi / 2)
        x = x + amplitude * over_length * over_time
    return x


def internal_force(s, t):
    """T t − EI (I − t tᵀ) t″/|x′|, N: tension, and the shear force of bending (′ is d/ds).

    From the energy ½ EI ∫ t′·t′ ds. Without absolute values, so that s may be complex.
    """
    x1, x2, x3 = (motion(s, t, order, 0) for order in (1, 2, 3))
    r = np.sqrt(x1 @ x1)
    r1 = x1 @ x2 / r
    r2 = (x2 @ x2 + x1 @ x3 - r1**2) / r
    tangent = x1 / r
    bend = x3 / r - 2 * x2 * r1 / r**2 - x1 * r2 / r**2 + 2 * x1 * r1**2 / r**3
    tension = EA * (r - 1) + DAMPING * (tangent @ motion(s, t, 1, 1))
    return tension * tangent - EI * (bend - (bend @ tangent) * tangent) / r


def applied_force(s, t):
    """What balances the equation of motion, N/m."""
    step = 1e-30  # of the complex differentiation, which has no truncation error
    internal = np.imag(internal_force(s + 1j * step, t)) / step
    x1 = motion(s, t, 1, 0)
    tangent = x1 / np.linalg.norm(x1)
    water = WATER.motion(motion(s, t, 0, 0), t)
    acceleration = motion(s, t, 0, 2)
    flow = np.array(water.velocity) - motion(s, t, 0, 1)
    along = flow @ tangent
    across = flow - along * tangent
    speed = np.linalg.norm(across)
    drag = 0.5 * DENSITY * CN * DIAMETER * speed * across
    drag += 0.5 * DENSITY * CT * math.pi * DIAMETER * abs(along) * along * tangent
    lift = 0.5 * DENSITY * CL * DIAMETER * speed * np.cross(tangent, across)
    pull = np.array(water.acceleration) - acceleration
    pull_along = (pull @ tangent) * tangent
    added = DENSITY * AREA * (CA * (pull - pull_along) + CA_ALONG * pull_along)
    froude_krylov = DENSITY * AREA * np.array(water.acceleration)
    weight = np.array([0.0, 0.0, -(MASS - DENSITY * AREA) * GRAVITY])
    return MASS * acceleration - internal - weight - drag - lift - added - froude_krylov


def line(segments):
    builder = sc.ModelBuilder(WATER)
    builder.add_prescribed_point("first")
    builder.add_prescribed_point("last")
    properties = sc.LineProperties(
        length=LENGTH, diameter=DIAMETER, mass_per_length=MASS, axial_stiffness=EA,
        axial_damping=DAMPING, bending_stiffness=EI, normal_drag=CN, tangential_drag=CT, lift=CL,
        added_mass=CA, tangential_added_mass=CA_ALONG,
    )  # fmt: skip
    builder.add_line("line", "first", "last", properties, segments=segments)
    return builder.build()


def places(model):
    """The nodes' s, m."""
    return np.linspace(0.0, LENGTH, len(_core.State(model).node_positions("line")))


def exact_state(model, t):
    """The chosen motion at the nodes."""
    state = _core.State(model)
    state.set_time(t)
    first, *inner, last = places(model)
    for name, s in (("first", first), ("last", last)):
        state.set_point(name, motion(s, t, 0, 0), motion(s, t, 0, 1))
    for i, s in enumerate(inner, 1):
        state.set_line_node("line", i, motion(s, t, 0, 0), motion(s, t, 0, 1))
    accelerations = np.concatenate([motion(s, t, 0, 2) for s in inner])
    return _core._displaced(state, accelerations, (0, 0, 1))


def lumped_force(model, t):
    """The applied force per length, at the inner nodes, N."""
    s = places(model)
    return np.concatenate([applied_force(node, t) for node in s[1:-1]]) * s[1]


def balancing_force(model, t):
    """What keeps the nodes on the chosen motion with the segments that there are, N."""
    return -_core._residual(exact_state(model, t))


def error(segments, steps, force):
    """The largest distance of a node from the chosen motion at any step, m."""
    model = line(segments)
    h = DURATION / steps
    state = exact_state(model, 0.0)
    # What _displaced adds to position, velocity and acceleration in Newmark's scheme
    rates = (1.0, 2 / h, 4 / h**2)
    v, a = (
        state.node_velocities("line")[1:-1].ravel(),
        state.node_accelerations("line")[1:-1].ravel(),
    )
    largest = 0.0
    for n in range(1, steps + 1):
        exact = exact_state(model, n * h)
        state.set_time(n * h)
        for name in ("first", "last"):
            state.set_point(name, exact.point_position(name), exact.point_velocity(name))
        # The acceleration kept at first
        state = _core._displaced(state, h * v + h**2 * a / 2, (1, 0, 0))
        state = _core._displaced(state, h * a, (0, 1, 0))
        v = v + h * a
        applied = force(model, n * h)
        for _ in range(20):
            residual = _core._residual(state) + applied
            if np.abs(residual).max() < 1e-8:  # N; EA/l turns the rounding of positions into 1e-10
                break
            change = np.linalg.solve(_core._jacobian(state, rates), -residual)
            state = _core._displaced(state, change, rates)
            v = v + rates[1] * change
            a = a + rates[2] * change
        else:
            raise AssertionError(f"no convergence at {n * h} s: {np.abs(residual).max()} N")
        off = state.node_positions("line") - exact.node_positions("line")
        largest = max(largest, np.linalg.norm(off, axis=1).max())
    return largest


def orders(errors):
    return np.log2(np.divide(errors[:-1], errors[1:]))


def test_order_in_step():
    errors = [error(10, 40 * 2**i, balancing_force) for i in range(3)]
    assert orders(errors) == pytest.approx(2.0, abs=0.1), errors


def test_order_in_segment():
    """The step is halved with the segments: by the order above it leaves theirs as it is."""
    errors = [error(10 * 2**i, 20 * 2**i, lumped_force) for i in range(3)]
    assert orders(errors) == pytest.approx(2.0, abs=0.1), errors
