# SPDX-License-Identifier: Apache-2.0
"""The integrators that there are, by name: the subclasses of Integrator that the core binds."""

from __future__ import annotations

import ast
from functools import partial

from sim_core._core import Integrator, InvalidInput

#: By name. A class makes its integrator of its parameters, which it has as properties.
INTEGRATORS: dict[str, type[Integrator]] = {
    scheme.__name__: scheme
    for scheme in sorted(Integrator.__subclasses__(), key=lambda scheme: scheme.__name__)
}


def parameters_of(scheme: type[Integrator]) -> list[str]:
    """Return the names of an integrator's parameters; all have values by default."""
    return [name for name, member in vars(scheme).items() if isinstance(member, property)]


def parse_integrator(text: str) -> partial[Integrator]:
    """Return what makes the integrator that is written as in Python: `HHT(alpha=-0.1)` or `Box`.

    Raises InvalidInput for what is no such text and for names that there are not; calling what it
    returns does for values that are impossible.
    """
    name, parameters = _call(text)
    scheme = INTEGRATORS.get(name)
    if scheme is None:
        raise InvalidInput(f"{name!r} is no integrator: use one of {', '.join(INTEGRATORS)}")
    known = parameters_of(scheme)
    for parameter in parameters:
        if parameter not in known:
            has = f"it has {', '.join(known)}" if known else "it has no parameters"
            raise InvalidInput(f"{name} has no '{parameter}', {has}")
    return partial(scheme, **parameters)


def _call(text: str) -> tuple[str, dict[str, float]]:
    """Return the name that is called, and the numbers that it is given by keyword."""
    try:
        call = ast.parse(text.strip(), mode="eval").body
        if isinstance(call, ast.Name):
            return call.id, {}
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            return call.func.id, {
                str(keyword.arg): float(ast.literal_eval(keyword.value))
                for keyword in call.keywords
            }
    except (SyntaxError, TypeError, ValueError):
        pass
    raise InvalidInput(f"{text!r} is no integrator: write it like HHT(alpha=-0.1)")
