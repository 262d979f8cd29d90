# SPDX-License-Identifier: Apache-2.0
"""`towtank test`: the whole test suite, in the source tree."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import click

from towtank_bringup.environment import short_temporary_folder
from towtank_bringup.source_tree import source_tree

CORES = str(os.cpu_count())
PYTEST = (sys.executable, "-m", "pytest")
SANITIZED = "build/sim_core_sanitized"
SANITIZED_OPTIONS = (
    *("-G", "Ninja", "--log-level=WARNING", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON"),
    *("-DSIM_CORE_TESTS=ON", "-DSIM_CORE_SANITIZE=ON"),
)
CHECKS = (
    (sys.executable, "-m", "ruff", "check"),
    (sys.executable, "-m", "ruff", "format", "--check", "--quiet"),
    ("make", "--no-print-directory", "--jobs", CORES, "-C", "firmware", "test"),
    # sim_core alone, without Python: no warnings, memory errors or undefined behaviour.
    ("cmake", "-S", "sim_core", "-B", SANITIZED, *SANITIZED_OPTIONS),
    ("cmake", "--build", SANITIZED, "--", "--quiet"),
    ("ctest", "--test-dir", SANITIZED, "--parallel", CORES, "--output-on-failure"),
)
TESTS = (
    # Workers take tests over from one another at the end, so that none is left without work.
    (*PYTEST, "-m", "not real_time and not alone", "-n", "auto", "--dist", "worksteal"),
    # A trial takes little more than half a core.
    (*PYTEST, "-m", "real_time", "-n", "2", "--dist", "worksteal"),
    (*PYTEST, "-m", "alone"),
)


_ROOM_OF_A_TEST = 85
"""Of a path below the temporary folder: pytest-of-USER/pytest-N/popen-gwN/NAME_OF_THE_TEST/FILE."""


@click.command(name="test", context_settings={"ignore_unknown_options": True})
@click.argument("pytest_arguments", nargs=-1, type=click.UNPROCESSED)
def command(pytest_arguments: tuple[str, ...]) -> None:
    """Run the linter, the host tests of firmware and sim_core, and all Python tests.

    The Python tests run on all cores. Behind them come those that run processes in real time, two
    at a time, and those that judge times to milliseconds, alone.
    With arguments, run pytest alone with them, in the project's environment.
    """
    source = source_tree("the tests")
    # Below it each test has a folder of its own, and sockets in that
    os.environ["TMPDIR"] = str(short_temporary_folder(_ROOM_OF_A_TEST))
    if pytest_arguments:
        failures = _failures([(*PYTEST, *pytest_arguments)], source)
    elif not os.access(source / "build", os.W_OK):
        raise click.ClickException(
            f"the whole test suite builds in {source / 'build'}, where you may not write: clone "
            "the repository for yourself, or give a PATH of tests that need no building"
        )
    else:
        failures = _failures(CHECKS, source) or _failures(TESTS, source)
    if failures:
        raise click.ClickException("failed: " + "; ".join(failures))


def _failures(steps: Iterable[tuple[str, ...]], source: Path) -> list[str]:
    """Run every step, whatever becomes of the others. Returns those that failed."""
    return [
        " ".join(step)
        for step in steps
        if subprocess.run(step, cwd=source, check=False).returncode != 0
    ]
