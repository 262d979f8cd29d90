# SPDX-License-Identifier: Apache-2.0
"""What a rig's assumptions about its sensors do to the uncertainties that it states.

Some limits of errors are in no data sheet: somebody assumed them, with a range. A stated interval
is worth as much as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from pydantic import BaseModel
from towtank_rig.quantity import Tolerance
from towtank_rig.schema import Rig

from towtank_uncertainty.statement import BoardNoise, Conditions, trial_budgets

Node = TypeVar("Node", bound=BaseModel)


@dataclass(frozen=True)
class AssumptionEffect:
    """One assumption.

    Attributes:
        path: Its place in the rig file.
        value: As assumed.
        unit: Of value and range.
        range: Lowest and highest plausible value.
        source: The reasoning behind it.
        u95: By the unit of a trial's result (m depth, rad pitch, 1 heave ratio): half its 95 %
            interval with the assumption at the lower and at the upper end of its range.
    """

    path: str
    value: float
    unit: str
    range: tuple[float, float]
    source: str
    u95: dict[str, tuple[float, float]]


def assumption_effects(rig: Rig, at: Conditions, board: BoardNoise) -> list[AssumptionEffect]:
    """Return the effects of all assumed limits of errors and flow coefficients, in their order."""
    found = []
    for path, quantity in rig.assumptions().items():
        if isinstance(quantity, Tolerance) or path.endswith(".flow_coefficient"):
            assert quantity.range is not None  # Quantity refuses an assumption without one
            low, high = (
                trial_budgets(_changed(rig, path.split("."), end), at, board)
                for end in quantity.range
            )
            u95 = {a.unit: (a.u95, b.u95) for a, b in zip(low, high, strict=True)}
            figure = (quantity.value, quantity.unit, quantity.range, quantity.source)
            found.append(AssumptionEffect(path, *figure, u95))
    return found


def _changed(node: Node, keys: list[str], value: float) -> Node:
    """Return a rig with another value. Its text stays: budgets read the figures only."""
    if not keys:
        return node.model_copy(update={"value": value})
    below = _changed(getattr(node, keys[0]), keys[1:], value)
    return node.model_copy(update={keys[0]: below})
