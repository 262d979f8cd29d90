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
from towtank_study.running import PlannedStudy, plan_study


@pytest.fixture(scope="session")
def rigs(pytestconfig: pytest.Config) -> Path:
    return pytestconfig.rootpath / "hardware" / "rigs"


@pytest.fixture
def plan(tmp_path: Path, rigs: Path) -> Callable[[str], PlannedStudy]:
    """Plans a study from its text."""

    def plan_text(text: str = SMALL) -> PlannedStudy:
        path = tmp_path / "study.yaml"
        path.write_text(text)
        return plan_study(read_document(path), lambda name: rigs / f"{name}.yaml")

    return plan_text


@pytest.fixture
def one_thread():
    with ThreadPoolExecutor(1) as executor:
        yield executor
