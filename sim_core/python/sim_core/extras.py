# SPDX-License-Identifier: Apache-2.0
"""Packages that only some functions need, imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any


def needed(module: str, extra: str) -> Any:
    """Return a module of an optional dependency; ``extra`` is what installs it."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        what = f"{module} is not installed: pip install 'sim_core[{extra}]'"
        raise ModuleNotFoundError(what, name=error.name) from None
