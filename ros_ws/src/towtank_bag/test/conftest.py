# SPDX-License-Identifier: Apache-2.0
"""Modules beside the tests can be imported; a bag to be damaged."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from other_bags import copy_bag, write_bag


@pytest.fixture(scope="module")
def original(request, tmp_path_factory):
    """The file of a bag with as many chunks as the module's CHUNKS says."""
    return write_bag(tmp_path_factory.mktemp("bags") / "bag", request.module.CHUNKS)


@pytest.fixture
def bag(original, tmp_path):
    """A copy of it, to be damaged."""
    return copy_bag(original, tmp_path)
