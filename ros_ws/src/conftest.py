# SPDX-License-Identifier: Apache-2.0
"""What the tests of all ROS packages share: modules beside this, a ROS domain of their own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from domain_coordinator import domain_id

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="module", autouse=True)
def ros_domain() -> Iterator[int]:
    """ROS_DOMAIN_ID for this module's nodes: they hear neither what runs on this machine besides
    nor, where tests run on several cores, each other."""
    with domain_id() as domain, pytest.MonkeyPatch.context() as environment:
        environment.setenv("ROS_DOMAIN_ID", str(domain))
        yield domain
