# SPDX-License-Identifier: Apache-2.0
"""What several tests of this package need."""

from pathlib import Path

import pytest
from towtank_daq.description import BoardDescription, load_description
from towtank_daq.protocol import Protocol

BOARD_YAML = Path(__file__).parents[1] / "protocol" / "board.yaml"


@pytest.fixture(scope="session")
def description() -> BoardDescription:
    """The board of the source tree."""
    return load_description(BOARD_YAML)


@pytest.fixture(scope="session")
def protocol(description) -> Protocol:
    """Its protocol."""
    return Protocol(description)
