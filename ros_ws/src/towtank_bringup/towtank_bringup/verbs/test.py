# SPDX-License-Identifier: Apache-2.0
"""`towtank test`: the whole test suite, in the source tree."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import click

from towtank_bringup.environment import short_temporary_folder
from towtank_bringup.source_tree import source_tree

CORES = str(os.cpu_count())
PYTEST = (sys.executable, "-m", "pytest")
# Workers take tests over from one another at the end, so that none is left without work.
SPREAD = ("--dist", "worksteal", "-n")
SANITIZED = "build/sim_core_sanitized"
SANITIZED_OPTIONS = (
    *("-G", "Ninja", "--log-level=WARNING", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON"),
    *("-DSIM_CORE_TESTS=ON", "-DSIM_CORE_SANITIZE=ON"),
)
LINT = (
    (sys.executable, "-m", "ruff", "check"),
    (sys.executable, "-m", "ruff", "format", "--check", "--quiet"),
    ("lint-imports", "--no-cache", "--no-logo"),
)
COMPILED = (
    ("make", "--no-print-directory", "--jobs", CORES, "-C", "firmware", "test"),
    # sim_core alone, without Python: no warnings, memory errors or undefined behaviour.
    ("cmake", "-S", "sim_core", "-B", SANITIZED, *SANITIZED_OPTIONS),
    ("cmake", "--build", SANITIZED, "--", "--quiet"),
    ("ctest", "--test-dir", SANITIZED, "--parallel", CORES, "--output-on-failure"),
)
ANY_TIME = ((*PYTEST, "-m", "not real_time and not alone", *SPREAD, "auto"),)
QUICK = (*PYTEST, "-m", "not slow and not real_time and not alone", *SPREAD, "auto")
IN_TIME = (
    # A trial takes little more than half a core.
    (*PYTEST, "-m", "real_time", *SPREAD, "2"),
    (*PYTEST, "-m", "alone"),
)

Steps = Iterable[tuple[str, ...]]


_ROOM_OF_A_TEST = 85
"""Of a path below the temporary folder: pytest-of-USER/pytest-N/popen-gwN/NAME_OF_THE_TEST/FILE."""


@click.command(name="test", context_settings={"ignore_unknown_options": True})
@click.option("--quick", is_flag=True, help="The linter, and the tests that are not slow.")
@click.argument("pytest_arguments", nargs=-1, type=click.UNPROCESSED)
def command(quick: bool, pytest_arguments: tuple[str, ...]) -> None:
    """Run the linter, the host tests of firmware and sim_core, and all Python tests.

    The Python tests run on all cores, with those of firmware and sim_core beside them. Behind them
    come those that run processes in real time, two at a time, and those that judge times to
    milliseconds, alone.
    With arguments, run pytest alone with them, in the project's environment.
    """
    source = source_tree("the tests")
    # Below it each test has a folder of its own, and sockets in that
    os.environ["TMPDIR"] = str(short_temporary_folder(_ROOM_OF_A_TEST))
    if quick:
        failures = _failures((*LINT, (*QUICK, *pytest_arguments)), source)
    elif pytest_arguments:
        failures = _failures([(*PYTEST, *pytest_arguments)], source)
    elif not os.access(source / "build", os.W_OK):
        raise click.ClickException(
            f"the whole test suite builds in {source / 'build'}, where you may not write: clone "
            "the repository for yourself, or give a PATH of tests that need no building"
        )
    else:
        failures = _failures(LINT, source) or _all_failures(source)
    if failures:
        raise click.ClickException("failed: " + "; ".join(failures))


def _all_failures(source: Path) -> list[str]:
    with _beside(COMPILED, source) as compiled:
        failures = _failures(ANY_TIME, source)
    return compiled + failures + _failures(IN_TIME, source)


def _failures(steps: Steps, source: Path) -> list[str]:
    """Run every step, whatever becomes of the others. Returns those that failed."""
    return [
        " ".join(step)
        for step in steps
        if subprocess.run(step, cwd=source, check=False).returncode != 0
    ]


@contextmanager
def _beside(steps: Steps, source: Path) -> Iterator[list[str]]:
    """Run the steps one after the other while the block runs, and wait for them behind it.

    What they say comes then, in one piece. If the block is left by an exception, Ctrl-C say, the
    step that runs is ended. Yields the list that those that failed are put into.
    """
    failures: list[str] = []
    stopped = threading.Event()
    with tempfile.TemporaryFile() as said, ThreadPoolExecutor(1) as lane:
        running = lane.submit(_failures_until, stopped, steps, source, said)
        try:
            yield failures
            failures += running.result()
        finally:
            stopped.set()
            running.exception()  # waits
            said.seek(0)
            click.echo(said.read())


def _failures_until(
    stopped: threading.Event, steps: Steps, source: Path, said: IO[bytes]
) -> list[str]:
    """Run every step, as long as nobody stops it, with all that they say in a file."""
    failures = []
    for step in steps:
        process = subprocess.Popen(
            step, cwd=source, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT
        )
        while process.poll() is None:
            if stopped.wait(0.1):
                process.terminate()
                process.wait()
                return failures
        if process.returncode != 0:
            failures.append(" ".join(step))
    return failures
