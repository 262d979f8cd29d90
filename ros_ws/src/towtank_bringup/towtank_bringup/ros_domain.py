# SPDX-License-Identifier: Apache-2.0
"""The ROS domain that the environment names. No ROS in here."""

from __future__ import annotations

import os

HIGHEST_DOMAIN = 232
"""Of ROS domains: with the ports of UDP there are no more."""


class DomainError(ValueError):
    """The environment names no domain that there is; one line: cause and remedy."""


def domain_of_environment() -> int | None:
    """ROS_DOMAIN_ID as a number; None where it is not set.

    rcl takes a number that begins with 0 for an octal one: 010 would be 8 to the nodes and 10 to
    people. Such a one is refused.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "")
    if not text:
        return None
    if text not in map(str, range(HIGHEST_DOMAIN + 1)):
        raise DomainError(f"ROS_DOMAIN_ID is '{text}': give 0 to {HIGHEST_DOMAIN}, or unset it")
    return int(text)
