# SPDX-License-Identifier: Apache-2.0
"""Every fault of the crank's drive in every state keeps to its bounds."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parent / "benchmarks" / "drive_faults.py"


@pytest.mark.parametrize(
    "state", ["at rest", "starting", "running up", "running", "stopping", "tripped"]
)
def test_no_fault_of_the_drive_is_unsafe_or_silent(state):
    """In a process of its own: it forks."""
    done = subprocess.run(
        [sys.executable, PROGRAM, "--state", state, "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout, done.stderr
    cells = json.loads(done.stdout)
    assert len(cells) == 17
    assert [f"{cell['fault']}: {cell['complaints']}" for cell in cells if cell["complaints"]] == []
