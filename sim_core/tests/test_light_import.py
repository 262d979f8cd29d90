# SPDX-License-Identifier: Apache-2.0
"""The package stays light: what only some functions need is imported by them."""

import subprocess
import sys


def test_import_needs_numpy_and_nothing_else():
    program = (
        "import sys; known = set(sys.modules); import sim_core; print(*set(sys.modules) - known)"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", program], check=True, capture_output=True, text=True
    )
    packages = {name.partition(".")[0] for name in done.stdout.split()}
    foreign = {name for name in packages if name not in sys.stdlib_module_names}
    assert foreign == {"sim_core", "numpy"}
