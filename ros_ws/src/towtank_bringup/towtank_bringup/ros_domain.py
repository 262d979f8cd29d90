# SPDX-License-Identifier: Apache-2.0
"""The ROS domain that the environment names. No ROS in here."""

from __future__ import annotations

import os

HIGHEST_DOMAIN = 232
"""Of ROS domains: with the ports of UDP there are no more."""


class DomainError(ValueError):
    """The environment names no domain that there is; one line: cause and remedy."""


def domain_of_environment() -> int | None:
    """ROS_DOMAIN_ID as a number; None where it is not set."""
    text = os.environ.get("ROS_DOMAIN_ID", "")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and int(text) <= HIGHEST_DOMAIN):
        raise DomainError(f"ROS_DOMAIN_ID is '{text}': give 0 to {HIGHEST_DOMAIN}, or unset it")
    return int(text)
