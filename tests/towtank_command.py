# SPDX-License-Identifier: Apache-2.0
"""The towtank command as a user runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import psutil

TOWTANK = [sys.executable, "-m", "towtank_bringup.cli"]


def run_towtank(*arguments: object, timeout: float = 240.0) -> subprocess.CompletedProcess[str]:
    """Run the towtank command to its end."""
    return subprocess.run(
        [*TOWTANK, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


def processes_of(directory: Path) -> list[str]:
    """Command lines of the processes that work for the trial in `directory`."""
    found = []
    for process in psutil.process_iter(["cmdline"]):
        line = " ".join(process.info["cmdline"] or [])
        if str(directory) in line and process.pid != os.getpid():
            found.append(line)
    return found
