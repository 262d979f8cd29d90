# SPDX-License-Identifier: Apache-2.0
"""A trial's ROS domain."""

from __future__ import annotations

import errno
import os

import pytest
from towtank_bringup.verbs.trial import _ros_domain


def test_domain_is_given_back_and_an_error_passes(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID")
    for _ in range(2):
        with pytest.raises(OSError, match="No space left"), _ros_domain():
            domain = int(os.environ["ROS_DOMAIN_ID"])
            assert 1 <= domain <= 100
            with _ros_domain():  # one that is set is kept
                assert os.environ["ROS_DOMAIN_ID"] == str(domain)
            raise OSError(errno.ENOSPC, "No space left on device")
        assert "ROS_DOMAIN_ID" not in os.environ
