# SPDX-License-Identifier: Apache-2.0
"""A second trial in a ROS domain is refused, whoever started the first one."""

from __future__ import annotations

import pytest
import rclpy
from towtank_bringup.graph import RosNode
from towtank_bringup.only_trial import DomainTaken, only_trial

GRAPH = (RosNode("towtank_bag", "recorder", "/", "recorder"),)


def test_a_second_trial_is_refused_and_a_later_one_is_not(ros_domain):
    for _ in range(2):
        with only_trial((), 0.0):
            refusal = rf"a trial runs in ROS domain {ros_domain} already: .* unset ROS_DOMAIN_ID"
            with pytest.raises(DomainTaken, match=refusal), only_trial((), 0.0):
                raise AssertionError


def test_another_domain_is_free(monkeypatch):
    with only_trial((), 0.0):
        monkeypatch.setenv("ROS_DOMAIN_ID", "102")
        with only_trial((), 0.0):
            pass


@pytest.mark.parametrize("name", ["recorder", "conductor"])
def test_nodes_of_a_trial_elsewhere_are_seen(name):
    """A graph on another machine, or one that was started by hand."""
    with only_trial(GRAPH, 0.1):
        pass
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node(name, context=context)
    try:
        # It ends as soon as it has seen one
        with pytest.raises(DomainTaken, match=rf"\(/{name} is there\)"), only_trial(GRAPH, 60.0):
            raise AssertionError
    finally:
        node.destroy_node()
        context.shutdown()
