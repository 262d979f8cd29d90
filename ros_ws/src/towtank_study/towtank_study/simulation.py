# SPDX-License-Identifier: Apache-2.0
"""How each sample of a study is simulated."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator
from towtank_rig.quantity import SI, Quantity, Section, rig_fault

import sim_core as sc


class Simulation(Section):
    """The section `simulation` of a study file.

    Each sample starts from the steady tow, runs `settling_time` so that the start's transients die
    out (the fish's slow heave mode has a period of 15 to 20 s), and is then measured over `periods`
    whole crank periods, with `samples_per_period` samples each.

    segments: of all lines together, 0 takes the rig file's own. step: longest time step.
    integrator: as one would make it in Python, `HHT(alpha=-0.1)`.
    """

    settling_time: Annotated[Quantity, SI("s", ge=0)] = Quantity(value=160.0, unit="s")
    periods: int = Field(default=10, ge=2, le=1000)
    samples_per_period: int = Field(default=64, ge=16, le=10_000)
    segments: int = Field(default=0, ge=0, le=10_000)
    step: Annotated[Quantity, SI("s", gt=0)] = Quantity(value=0.005, unit="s")
    integrator: str = "GeneralizedAlpha(rho_inf=0.8)"

    @field_validator("integrator")
    @classmethod
    def _is_a_call(cls, text: str) -> str:
        try:
            sc.parse_integrator(text)
        except sc.InvalidInput as error:
            what, _, mend = str(error).partition(": ")
            raise rig_fault(what, mend) from None
        return text
