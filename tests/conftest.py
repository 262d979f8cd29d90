# SPDX-License-Identifier: Apache-2.0
"""What the tests across parts share."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).parent))  # for the modules beside this one

from towtank_command import processes_of, run_towtank


def pytest_itemcollected(item: pytest.Item) -> None:
    """What runs across parts emulates the firmware, simulates tows or starts the whole command."""
    item.add_marker(pytest.mark.slow)


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
