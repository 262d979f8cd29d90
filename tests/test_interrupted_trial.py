# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C at any moment leaves a readable bag, a marked directory and no process."""

from __future__ import annotations

import signal
import subprocess
import time

import pytest
from mcap.reader import make_reader
from towtank_command import TOWTANK, processes_of

pytestmark = pytest.mark.real_time


@pytest.mark.parametrize("stage", ["starting", "zeroing", "logging"])
def test_ctrl_c(tmp_path, stage):
    directory = tmp_path / "trial"
    process = subprocess.Popen(
        [*TOWTANK, "trial", "--out", directory], stderr=subprocess.PIPE, text=True
    )
    said = []
    for line in process.stderr:
        said.append(line)
        if line.startswith(stage):
            break
    time.sleep(0.7)  # into the stage, not at its first instant
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == 130, "".join(said) + rest
    assert processes_of(directory) == []
    assert (directory / "INCOMPLETE").exists()
    assert not (directory / "result.json").exists()
    for bag in directory.glob("bag/*.mcap"):
        with bag.open("rb") as file:
            messages = sum(1 for _ in make_reader(file).iter_messages())
        assert messages > 0 or stage == "starting"
    if stage != "starting":
        assert list(directory.glob("bag/*.mcap"))
