# SPDX-License-Identifier: Apache-2.0
"""A soft spring on a stiff one (Bathe & Noh 2012): what the step cannot resolve must not show."""

import numpy as np
import pytest

import sim_core as sc

RATE = 1.2  # rad/s, of the forced motion
STEP = 0.2618  # s, a twentieth of the forced period; the stiff spring's is 500 times shorter
END = 40 * STEP


def run(step, integrator, stiffness=1e7):
    """Heave of the two masses of 1 kg, and acceleration of the stiffly held one, from rest.

    Gravity keeps the springs taut; strains count for the soft one as they do for a spring.
    """
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("drive")
    b.add_free_point("stiff", mass=1.0)
    b.add_free_point("soft", mass=1.0)
    # a line of one segment with EI is a spring both ways
    spring = {
        "length": 1.0, "diameter": 1e-3, "mass_per_length": 1e-12, "bending_stiffness": 1e6
    }  # fmt: skip
    for name, start, end, k in (("k1", "drive", "stiff", stiffness), ("k2", "stiff", "soft", 1.0)):
        b.add_line(name, start, end, sc.LineProperties(axial_stiffness=k, **spring), segments=1)
    model = b.build()
    state = sc.State(model)
    rest = {"drive": 0.0, "stiff": -1.0 - 2 * 9.81 / stiffness}
    rest["soft"] = rest["stiff"] - 1.0 - 9.81
    for name, z in rest.items():
        state.set_point(name, (0, 0, z))
    drive = sc.Sinusoid(mean=(0, 0, 0), amplitude=1.0, period=2 * np.pi / RATE)
    result = sc.run(
        model, drive, t_end=END, output_step=STEP, max_step=step, state=state, integrator=integrator
    )
    stiff, soft = result.points["stiff"], result.points["soft"]
    heave = [stiff.position[:, 2] - rest["stiff"], soft.position[:, 2] - rest["soft"]]
    return result.time, *heave, stiff.acceleration[:, 2]


def exact(time):
    """ü + u = sin(1.2 t) from rest: the stiff spring moves as it is driven."""
    forced = 1 / (1 - RATE**2)
    return forced * (np.sin(RATE * time) - RATE * np.sin(time))


@pytest.mark.parametrize("integrator", [sc.SingleStepHoubolt(), sc.GeneralizedAlpha(rho_inf=0.0)])
def test_the_stiff_mass_does_not_ring(integrator):
    """It starts at rest, 1.2 m/s off the drive: gone in a few steps, in the acceleration too."""
    time, stiff, _, acceleration = run(STEP, integrator)
    # the quasi-static stretch of k1 by the forces of a few newtons
    assert stiff[1:] == pytest.approx(np.sin(RATE * time[1:]), abs=1e-5)
    later = time > 5 * STEP
    expected = -(RATE**2) * np.sin(RATE * time)
    # of the second order: 11/12 (ω Δt)² of the amplitude
    assert np.abs(acceleration - expected)[later].max() < 11 / 12 * (RATE * STEP) ** 2 * RATE**2


@pytest.mark.parametrize("rho_inf", [0.0, 0.5])
def test_the_soft_mass_moves_as_if_the_stiff_one_were_driven(rho_inf):
    errors = []
    for step in (STEP / 4, STEP / 8):
        time, _, soft, _ = run(step, sc.GeneralizedAlpha(rho_inf=rho_inf))
        errors.append(np.abs(soft - exact(time)).max() / np.abs(exact(time)).max())
    assert errors[1] < 0.01
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
