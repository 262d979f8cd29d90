# SPDX-License-Identifier: Apache-2.0
"""What the tests of all ROS packages share: a ROS domain that nobody else is in."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from domain_coordinator import domain_id


@pytest.fixture(scope="module", autouse=True)
def ros_domain() -> Iterator[int]:
    """ROS_DOMAIN_ID for this module's nodes: they hear neither what runs on this machine besides
    nor, where tests run on several cores, each other."""
    with domain_id() as domain, pytest.MonkeyPatch.context() as environment:
        environment.setenv("ROS_DOMAIN_ID", str(domain))
        yield domain
