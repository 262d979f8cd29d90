# SPDX-License-Identifier: Apache-2.0
"""Publishers, subscriptions, clients and servers of the graph's topics and services."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.client import Client
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.service import Service as Server
from rclpy.subscription import Subscription

from towtank_node.qos import Qos
from towtank_node.services import Service
from towtank_node.topics import Topic


def qos_profile(qos: Qos) -> QoSProfile:
    """A quality of service as rclpy takes it."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )


def publisher(node: Any, topic: Topic) -> Publisher:
    """A publisher of a topic."""
    return node.create_publisher(topic.type, topic.name, qos_profile(topic.qos))


def subscription(
    node: Any,
    topic: Topic,
    callback: Callable[[Any], None],
    raw: bool = False,
    callback_group: CallbackGroup | None = None,
) -> Subscription:
    """A subscription to a topic; raw: its callback gets the messages as bytes."""
    return node.create_subscription(
        topic.type,
        topic.name,
        callback,
        qos_profile(topic.qos),
        callback_group=callback_group,
        raw=raw,
    )


def client(node: Any, service: Service) -> Client:
    """A client of a service."""
    return node.create_client(service.type, service.name)


def server(node: Any, service: Service, callback: Callable[[Any, Any], Any]) -> Server:
    """A server of a service."""
    return node.create_service(service.type, service.name, callback)
