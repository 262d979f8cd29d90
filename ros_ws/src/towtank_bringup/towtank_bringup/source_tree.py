# SPDX-License-Identifier: Apache-2.0
"""The repository that this command was started from."""

from __future__ import annotations

import os
from pathlib import Path

import click


def source_tree(what: str) -> Path:
    """The repository's root; ClickException if `what`, which lives there, is not at hand."""
    source = os.environ.get("TOWTANK_SOURCE")
    if not source:
        raise click.ClickException(f"{what} live in the source tree: start through ./towtank")
    return Path(source)
