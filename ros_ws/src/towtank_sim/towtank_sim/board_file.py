# SPDX-License-Identifier: Apache-2.0
"""board.yaml, which says how the board sees the bench and what its crank drive does."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from ruamel.yaml import YAML


@cache
def board_file() -> dict[str, Any]:
    """The file's contents; not to be changed."""
    text = files("towtank_sim").joinpath("board.yaml").read_text("utf-8")
    return YAML(typ="safe", pure=True).load(text)
