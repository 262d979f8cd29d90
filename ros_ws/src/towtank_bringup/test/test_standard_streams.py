# SPDX-License-Identifier: Apache-2.0
"""Standard output and error that fail, are closed, or know ASCII only."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
import sys
import click
from rich.console import Console
from towtank_bringup import cli

@click.command()
def verb():
    for number in range(3):
        print(f"progress {number} \\u2192", file=sys.stderr, flush=True)
    Console().print("0.0078 \\u00b1 0.0002")
    print("tow_\\udce9 \\u221230 mm \\N{FISH}")

cli.towtank = verb
cli.main()
"""
WORDS = "".join(f"progress {number} →\n" for number in range(3)).encode()


@pytest.fixture
def closed_pipe():
    """The writing end of a pipe that nobody reads any more."""
    reader, writer = os.pipe()
    os.close(reader)
    yield writer
    os.close(writer)


def run(environment=(), **streams):
    """A verb in the command's own frame, writing progress and a result."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
    return subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "PYTHONUTF8": "1", **dict(environment)},
        check=False,
        **streams,
    )


def test_what_is_printed_arrives():
    done = run()
    assert done.returncode == 0
    assert done.stderr == WORDS
    result, other = done.stdout.splitlines()
    assert result.decode() == "0.0078 ± 0.0002"
    assert other == b"tow_\xe9 " + "−30 mm 🐟".encode()  # the bytes of a file's name as they are


def test_reader_of_the_progress_that_has_gone_does_not_matter(closed_pipe):
    done = run(stderr=closed_pipe)
    assert (done.returncode, len(done.stdout.splitlines())) == (0, 2)


def test_full_disk_behind_the_progress_does_not_matter():
    with open("/dev/full", "wb") as full:
        done = run(stderr=full)
    assert (done.returncode, len(done.stdout.splitlines())) == (0, 2)


def test_full_disk_behind_the_result_is_one_line():
    with open("/dev/full", "wb") as full:
        done = run(stdout=full)
    assert done.returncode == 1
    error = b"towtank: error: standard output: No space left on device\n"
    assert done.stderr == WORDS + error


def test_reader_of_the_result_that_has_gone_is_one_line(closed_pipe):
    done = run(stdout=closed_pipe)
    assert done.returncode == 1
    assert done.stderr == WORDS + b"towtank: error: standard output: Broken pipe\n"


@pytest.mark.parametrize("closed", ["1", "2", "0<&- 1"])
def test_stream_that_is_closed_does_not_matter(closed):
    done = subprocess.run(
        ["sh", "-c", f'exec {closed}>&-; exec "$@"', "sh", sys.executable, "-c", PROGRAM],
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr


def test_what_ascii_does_not_have_is_written_in_another_way():
    done = run({"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert done.stderr.decode() == WORDS.decode().replace("→", "->")
    assert done.stdout == b"0.0078 +/- 0.0002\ntow_\xe9 -30 mm ?\n"
