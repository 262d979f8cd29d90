# SPDX-License-Identifier: Apache-2.0
"""What the tests across parts share: the command as a user runs it, and one recorded trial."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import pytest

TOWTANK = [sys.executable, "-m", "towtank_bringup.cli"]


def run_towtank(*arguments: object, timeout: float = 240.0) -> subprocess.CompletedProcess[str]:
    """Run the towtank command to its end."""
    return subprocess.run(
        [*TOWTANK, *map(str, arguments)], capture_output=True, text=True, timeout=timeout
    )


def processes_of(directory: Path) -> list[str]:
    """Command lines of the processes that work for the trial in `directory`."""
    found = []
    for process in psutil.process_iter(["cmdline"]):
        line = " ".join(process.info["cmdline"] or [])
        if str(directory) in line and process.pid != os.getpid() and "pytest" not in line:
            found.append(line)
    return found


@dataclass(frozen=True)
class Trial:
    """A finished trial."""

    directory: Path
    result: dict[str, Any]

    @property
    def bag(self) -> Path:
        return self.directory / "bag"


@pytest.fixture(scope="session")
def ideal_trial(tmp_path_factory) -> Trial:
    """A whole trial on the virtual board, 15 s logged: plant as the twin assumes, ideal sensors."""
    directory = tmp_path_factory.mktemp("trials") / "ideal"
    run = run_towtank("trial", "--duration", 15, "--noise", "none", "--out", directory, "--json")
    assert run.returncode == 0, run.stderr
    assert processes_of(directory) == []
    return Trial(directory, json.loads(run.stdout))
