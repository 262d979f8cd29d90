# SPDX-License-Identifier: Apache-2.0
"""The simulation core's package, the board's driver and the benchmarks are typed throughout, in one
run of mypy."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "sim_core" / "python" / "sim_core"
DAQ = ROOT / "ros_ws" / "src" / "towtank_daq" / "towtank_daq"
# Of rclpy, some functions that nodes call have no types.
DRIVER = sorted(path for path in DAQ.rglob("*.py") if not path.stem.endswith("_node"))
BENCHMARKS = ROOT / "tests" / "benchmarks"


def test_types_agree(tmp_path):
    """Against the stubs of the compiled part: a probe shows that they were found. The other
    simulators of the benchmarks need not be installed."""
    probe = tmp_path / "probe.py"
    probe.write_text("from sim_core import _core\n\nreveal_type(_core.Simulator.time)\n")
    paths = [BENCHMARKS, ROOT / "sim_core" / "tests", *ROOT.glob("ros_ws/src/towtank_*")]
    done = subprocess.run(
        [
            *(sys.executable, "-m", "mypy", "--strict", f"--cache-dir={os.devnull}"),
            *("--ignore-missing-imports", "--follow-imports=silent"),
            *(PACKAGE, *DRIVER, probe, *sorted(BENCHMARKS.glob("*.py"))),
        ],
        env=os.environ | {"MYPYPATH": os.pathsep.join(map(str, paths))},
        cwd=tmp_path,  # where no folder hides the installed package's stubs
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'Revealed type is "def (self: sim_core._core.Simulator) -> float"' in done.stdout
    assert (PACKAGE / "py.typed").is_file()
