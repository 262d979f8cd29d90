# SPDX-License-Identifier: Apache-2.0
"""From a sample's values to its outputs, or to the reason why there are none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from pydantic import ValidationError
from towtank_compare.harmonic import AnalysisError
from towtank_rig import Quantity, Rig, RigError, parse_rig
from towtank_rig.loading import vary
from towtank_sim.model import ModelError

import sim_core as sc
from towtank_study.loading import parse_study
from towtank_study.simulation import Simulation
from towtank_study.study import Study
from towtank_study.tow_run import measure, simulate
from towtank_study.variables import Value, holder, value_at

UNSOLVED = (AnalysisError, ModelError, RigError, sc.ConvergenceError, sc.InvalidInput)
"""What a sample may fail with; the reason goes into its `error`."""


@dataclass(frozen=True)
class Outcome:
    """What came of one sample: outputs by name (NaN where it failed) and the error, or None."""

    sample: int
    outputs: dict[str, float]
    error: str | None

    def entry(self) -> dict[str, Any]:
        outputs = {
            name: value if math.isfinite(value) else None for name, value in self.outputs.items()
        }
        return {"sample": self.sample, "outputs": outputs, "error": self.error}

    @classmethod
    def of_entry(cls, entry: Mapping[str, Any]) -> Outcome:
        outputs = {
            name: math.nan if value is None else value for name, value in entry["outputs"].items()
        }
        return cls(entry["sample"], outputs, entry["error"])


@dataclass(frozen=True)
class TowEvaluation:
    """Evaluates samples of a study: `evaluation(number, values)`.

    Holds texts, so that it is small to send to another process or machine.
    """

    study_text: str
    rig_text: str

    def __call__(self, number: int, values: Mapping[str, Value]) -> Outcome:
        study, rig = parsed(self.study_text, self.rig_text)
        try:
            changed_rig, simulation = changed(study, rig, values)
            everything = measure(simulate(changed_rig, simulation))
        except UNSOLVED as error:
            return Outcome(number, dict.fromkeys(study.outputs, math.nan), _one_line(error))
        return Outcome(number, {name: everything[name] for name in study.outputs}, None)


@lru_cache(maxsize=4)
def parsed(study_text: str, rig_text: str) -> tuple[Study, Rig]:
    """Return study and rig; a process that is given the same texts again reads them once."""
    return parse_study(study_text).study, parse_rig(rig_text)


def changed(study: Study, rig: Rig, values: Mapping[str, Value]) -> tuple[Rig, Simulation]:
    """Return rig and simulation with the values of a sample.

    The rig has no text of its own. A quantity becomes a stated one, without its range: a study may
    look beyond what is plausible. Raises RigError for values that the rig's schema refuses,
    InvalidInput for the simulation's.
    """
    of_rig: dict[str, object] = {}
    of_simulation: dict[str, object] = {}
    for path, value in _all_values(study, values).items():
        model, within = holder(rig, study.simulation, path)
        at = value_at(model, within)
        if isinstance(at, Quantity):
            form: object = value if at.unit == "1" else f"{value!r} {at.unit}"
        else:
            form = int(value) if isinstance(value, float) and value.is_integer() else value
        (of_simulation if model is study.simulation else of_rig)[within] = form
    changed_rig = vary(rig, of_rig)
    if not of_simulation:
        return changed_rig, study.simulation
    try:
        simulation = Simulation.model_validate(dict(study.simulation) | of_simulation)
    except ValidationError as error:
        raise sc.InvalidInput(f"simulation: {error.errors()[0]['msg']}") from None
    return changed_rig, simulation


def _all_values(study: Study, values: Mapping[str, Value]) -> dict[str, Value]:
    """Return the values of the parameters and of the paths that follow them."""
    everything = dict(values)
    for parameter in study.parameters:
        value = values[parameter.path]
        for linked in parameter.also:
            follows = linked.factor != 1.0 or linked.offset != 0.0
            everything[linked.path] = (
                linked.factor * float(value) + linked.offset if follows else value
            )
    return everything


def _one_line(error: Exception) -> str:
    # A rig's fault without the name of the file: it is the study's own text with other values.
    text = f"{error.where}: {error.what}" if isinstance(error, RigError) else str(error)
    return " ".join(text.split())
