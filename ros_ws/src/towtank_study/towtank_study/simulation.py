# SPDX-License-Identifier: Apache-2.0
"""How each sample of a study is simulated."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import Field, field_validator
from towtank_rig.quantity import SI, Quantity, Section, rig_fault

import sim_core as sc

SCHEMES: dict[str, type[sc.Integrator]] = {
    scheme.__name__: scheme
    for scheme in (
        sc.BackwardEuler,
        sc.Box,
        sc.ForwardEuler,
        sc.GeneralizedAlpha,
        sc.HHT,
        sc.Newmark,
        sc.SingleStepHoubolt,
    )
}

_CALL = re.compile(r"(\w+)(?:\((.*)\))?")
_ARGUMENT = re.compile(r"\s*(\w+)\s*=\s*([-+.\deE]+)\s*")


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
        scheme_and_parameters(text)
        return text


def scheme_and_parameters(text: str) -> tuple[str, dict[str, float]]:
    """Split `HHT(alpha=-0.1)` into the scheme's name and its parameters; rig_fault otherwise."""
    call = _CALL.fullmatch(text.strip())
    if call is None or call[1] not in SCHEMES:
        raise rig_fault(f"{text!r} is no integrator", f"use one of {', '.join(sorted(SCHEMES))}")
    parameters = {}
    for argument in filter(None, (call[2] or "").split(",")):
        match = _ARGUMENT.fullmatch(argument)
        try:
            parameters[match[1]] = float(match[2])  # type: ignore[index]
        except (TypeError, ValueError):
            raise rig_fault(
                f"{argument!r} is no parameter of an integrator", "write it like HHT(alpha=-0.1)"
            ) from None
    return call[1], parameters


def make_integrator(text: str) -> sc.Integrator:
    """Return the integrator; sim_core's InvalidInput if it refuses the parameters."""
    scheme, parameters = scheme_and_parameters(text)
    try:
        return SCHEMES[scheme](**parameters)
    except TypeError:
        raise sc.InvalidInput(f"{scheme} has no parameters {', '.join(parameters)}") from None
