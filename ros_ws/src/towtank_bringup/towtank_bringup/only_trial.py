# SPDX-License-Identifier: Apache-2.0
"""One trial in a ROS domain: a second one is refused before it starts anything.

Its nodes would have the names and topics of the first one's. On one machine a lock says so at once
(an abstract socket, which goes with its process); from other machines, or started by other means,
the graph itself does.
"""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Iterator

import rclpy
from rclpy.signals import SignalHandlerOptions
from towtank_node.names import CONDUCTOR_NODE

from towtank_bringup.environment import NO_LOG_FILES
from towtank_bringup.graph import Graph

DISCOVERY_S = 1.0
"""How long nodes of the machine and the network may take to show themselves."""


class DomainTaken(RuntimeError):
    """Another trial runs in the domain; one line with the mend."""


@contextlib.contextmanager
def only_trial(graph: Graph, look_s: float = DISCOVERY_S) -> Iterator[None]:
    """Around a trial: holds the domain that ROS_DOMAIN_ID names (0 if it is not set).

    look_s: how long to look for nodes of the graph's names, s; 0 where nobody else can be in the
    domain. Raises DomainTaken where there is a trial already.
    """
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
        try:
            lock.bind(f"\0towtank-trial-in-domain-{domain}")
        except OSError as error:
            raise DomainTaken(_refusal(domain, "")) from error
        names = {CONDUCTOR_NODE, *(name for item in graph for name in item.node_names)}
        if found := _nodes_there(names, look_s):
            raise DomainTaken(_refusal(domain, f" ({found} is there)"))
        yield


def _refusal(domain: str, found: str) -> str:
    return (
        f"a trial runs in ROS domain {domain} already{found}: wait for its end, or unset "
        "ROS_DOMAIN_ID to have a domain of your own"
    )


def _nodes_there(names: set[str], look_s: float) -> str:
    """The first node of these names that shows itself within `look_s`, or nothing."""
    if look_s <= 0:
        return ""
    context = rclpy.Context()
    rclpy.init(
        args=[*NO_LOG_FILES], context=context, signal_handler_options=SignalHandlerOptions.NO
    )
    node = rclpy.create_node("towtank_look", context=context)
    try:
        end = time.monotonic() + look_s
        while time.monotonic() < end:
            for name, namespace in node.get_node_names_and_namespaces():
                if (full_name := f"{namespace.rstrip('/')}/{name}") in names:
                    return full_name
            time.sleep(0.05)
        return ""
    finally:
        node.destroy_node()
        context.shutdown()
