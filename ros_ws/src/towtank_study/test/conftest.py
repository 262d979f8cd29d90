# SPDX-License-Identifier: Apache-2.0
"""Planning and running small studies."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # the tests share small_study

from small_study import SMALL
from towtank_study.loading import read_document
from towtank_study.tow_study import PlannedTows, plan_tows


@pytest.fixture(scope="session")
def rigs(pytestconfig: pytest.Config) -> Path:
    return pytestconfig.rootpath / "hardware" / "rigs"


@pytest.fixture
def plan(tmp_path: Path, rigs: Path) -> Callable[[str], PlannedTows]:
    """Plans a study from its text."""

    def plan_text(text: str = SMALL) -> PlannedTows:
        path = tmp_path / "study.yaml"
        path.write_text(text)
        return plan_tows(read_document(path), lambda name: rigs / f"{name}.yaml")

    return plan_text


@pytest.fixture
def one_thread():
    with ThreadPoolExecutor(1) as executor:
        yield executor
