# SPDX-License-Identifier: Apache-2.0
"""Whose messages a node takes: in a trial those of the trial's own nodes, and of nobody else.

A domain is open to every program on the machine. A replayed bag, a test publisher that was left
running or a second graph would be taken for the measurement otherwise. Messages are known by the
publisher that they came from, publishers by the node that they belong to.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.serialization import deserialize_message

from towtank_node.endpoints import subscription
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.taking import Taken, Taker
from towtank_node.topics import Topic

SENDERS = Parameter(
    "senders",
    str,
    "full names of the nodes whose messages are taken, separated by blanks; empty: of all nodes",
    default="",
)

UNKNOWN_NODE = "a node that does not tell its name"

_HOLD_S = 2.0
"""A message waits so long for its sender to be known: the names come by another way."""

_SILENCE_S = 1.5
"""A node of the same name takes a publisher's place once that has been silent for so long. Nodes
that are started again do; the middleware notices the death of the old one much later."""

_LOOK_S = 0.02  # between two looks at the publishers of a topic


class Senders:
    """Knows, for one node, which publishers are those of the nodes that it listens to.

    left_out: messages of others so far, by topic and full name of the node.
    """

    def __init__(self, node: Any, monotonic_s: Callable[[], float] = time.monotonic) -> None:
        if not node.has_parameter(SENDERS.name):
            read_parameters(node, [SENDERS])
        self._node = node
        self._monotonic_s = monotonic_s
        self._names = frozenset(node.get_parameter(SENDERS.name).value.split())
        self._owners: dict[bytes, str] = {}
        self._places: dict[tuple[str, str], bytes] = {}  # the publisher of each topic and node
        self._heard: dict[bytes, float] = {}
        self._looked: dict[str, float] = {}
        self.left_out: dict[tuple[str, str], int] = {}

    @property
    def everybody(self) -> bool:
        """Whether all messages are taken."""
        return not self._names

    def includes(self, name: str) -> bool:
        """Whether a node, by its full name, is one of those that are listened to."""
        return self.everybody or name in self._names

    def accepts(self, topic: str, publisher: bytes) -> bool | None:
        """Whether a publisher's messages are taken; None while that cannot be said yet."""
        if not self._names:
            return True
        owner = self._owners.get(publisher)
        if owner is None:
            self._look(topic)
            owner = self._owners.get(publisher)
            if owner is None:
                return None
        if owner not in self._names:
            return False
        place, now = (topic, owner), self._monotonic_s()
        holder = self._places.setdefault(place, publisher)
        if holder != publisher:
            if now - self._heard[holder] < _SILENCE_S:
                return None
            self._places[place] = publisher
        self._heard[publisher] = now
        return True

    def leave_out(self, topic: str, publisher: bytes) -> None:
        """Count a message that is not taken."""
        key = (topic, self._owners.get(publisher, UNKNOWN_NODE))
        self.left_out[key] = self.left_out.get(key, 0) + 1

    def subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> Any:
        """Like endpoints.subscription, for nodes that a StreamExecutor spins; returns the
        subscription."""
        if self.everybody:
            return subscription(self._node, topic, callback)
        stream = Stream()
        made = subscription(self._node, topic, callback, callback_group=stream)
        stream.attend(made, Intake(self, made, self._monotonic_s))
        return made

    def _look(self, topic: str) -> None:
        now = self._monotonic_s()
        if now - self._looked.get(topic, -_LOOK_S) < _LOOK_S:
            return
        self._looked[topic] = now
        for publisher, name in publishers(self._node, topic).items():
            if name != UNKNOWN_NODE:
                self._owners[publisher] = name


def publishers(node: Any, topic: str) -> dict[bytes, str]:
    """The publishers of a topic by their identifiers: full names of their nodes, or UNKNOWN_NODE
    where that has not got about yet, or never does."""
    return {
        bytes(each.endpoint_gid): UNKNOWN_NODE
        if each.node_name.startswith("_NODE_NAME_UNKNOWN")
        else f"{each.node_namespace.rstrip('/')}/{each.node_name}"
        for each in node.get_publishers_info_by_topic(topic)
    }


class Intake:
    """What a subscription brings of those that its node listens to, in the order of sending."""

    def __init__(
        self,
        senders: Senders,
        subscription: Any,
        monotonic_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._senders = senders
        self._topic = subscription.topic_name
        self._taker = Taker(subscription)
        self._monotonic_s = monotonic_s
        self._held: list[tuple[float, Taken]] = []

    def take(self) -> list[Taken]:
        """All messages that are waiting, oldest first; of a sender who is not known yet later."""
        now = self._monotonic_s()
        held, self._held = self._held, []
        while taken := self._taker.take():
            held.append((now, taken))
        messages = []
        for since, taken in held:
            accepted = self._senders.accepts(self._topic, taken.publisher)
            if accepted:
                messages.append(taken)
            elif accepted is None and now - since < _HOLD_S:
                self._held.append((since, taken))
            else:
                self._senders.leave_out(self._topic, taken.publisher)
        return messages


class Unattended(CallbackGroup):
    """A group whose members rclpy's executors never wait for."""

    def can_execute(self, entity: Any) -> bool:
        return False

    def beginning_execution(self, entity: Any) -> bool:
        return False

    def ending_execution(self, entity: Any) -> None:
        pass


class Stream(Unattended):
    """The group of one subscription that StreamExecutor serves by `deliver`."""

    def attend(self, subscription: Any, intake: Intake) -> None:
        """Serve this subscription."""
        self._subscription, self._intake = subscription, intake

    def deliver(self) -> None:
        """Call back with all messages that are waiting."""
        subscription = self._subscription
        for taken in self._intake.take():
            subscription.callback(deserialize_message(taken.data, subscription.msg_type))
