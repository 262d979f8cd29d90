# SPDX-License-Identifier: Apache-2.0
"""The benchmarks, which the tests do not run: they call what there is."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_types_agree():
    """The other simulators need not be installed for it."""
    programs = sorted((ROOT / "tests" / "benchmarks").glob("*.py"))
    paths = [programs[0].parent, ROOT / "sim_core" / "tests", *ROOT.glob("ros_ws/src/towtank_*")]
    mypy = [sys.executable, "-m", "mypy", "--strict", f"--cache-dir={os.devnull}"]
    done = subprocess.run(
        [*mypy, "--ignore-missing-imports", "--follow-imports=silent", *programs],
        env=os.environ | {"MYPYPATH": os.pathsep.join(map(str, paths))},
        cwd=ROOT / "tests",  # where no folder hides the installed package's stubs
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
