# SPDX-License-Identifier: Apache-2.0
"""The package is typed throughout, against the stubs of the compiled part."""

import os
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "python" / "sim_core"


def test_types_agree():
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", f"--cache-dir={os.devnull}", str(PACKAGE)],
        cwd=PACKAGE.parents[1],  # where no folder hides the installed package's stubs
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (PACKAGE / "py.typed").is_file()
