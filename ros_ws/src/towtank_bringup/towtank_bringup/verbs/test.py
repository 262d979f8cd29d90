# SPDX-License-Identifier: Apache-2.0
"""`towtank test`: the whole test suite, in the source tree."""

from __future__ import annotations

import os
import subprocess
import sys

import click


@click.command(name="test", context_settings={"ignore_unknown_options": True})
@click.argument("pytest_arguments", nargs=-1, type=click.UNPROCESSED)
def command(pytest_arguments: tuple[str, ...]) -> None:
    """Run the linter, the firmware's host tests and all Python tests.

    With arguments, run pytest alone with them, in the project's environment.
    """
    source = os.environ.get("TOWTANK_SOURCE")
    if not source:
        raise click.ClickException("the tests live in the source tree: start through ./towtank")
    pytest = [sys.executable, "-m", "pytest", *pytest_arguments]
    steps = [
        [sys.executable, "-m", "ruff", "check"],
        [sys.executable, "-m", "ruff", "format", "--check", "--quiet"],
        ["make", "--no-print-directory", "-C", "firmware", "test"],
    ]
    for step in [pytest] if pytest_arguments else [*steps, pytest]:
        status = subprocess.run(step, cwd=source, check=False).returncode
        if status:
            raise click.ClickException(f"failed: {' '.join(step)}")
