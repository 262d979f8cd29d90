# SPDX-License-Identifier: Apache-2.0
"""A node hears the nodes that it is told to, and counts what others send."""

from __future__ import annotations

import types

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.serialization import serialize_message
from std_msgs.msg import String, UInt32
from towtank_node.endpoints import publisher, subscription
from towtank_node.executor import StreamExecutor
from towtank_node.polling import PolledSubscription
from towtank_node.qos import RELIABLE
from towtank_node.senders import UNKNOWN_NODE, Senders, publishers
from towtank_node.taking import Taker
from towtank_node.topics import Topic

NUMBER = Topic("/number", "std_msgs/msg/UInt32", RELIABLE)
TEXT = Topic("/text", "std_msgs/msg/String", RELIABLE)


def listener(context, senders: str = "") -> Node:
    told = [RosParameter("senders", value=senders)]
    return Node("listener", context=context, parameter_overrides=told)


class Publisher:
    """A publisher of its own node, known to be matched with `readers` subscriptions."""

    def __init__(self, context, name: str) -> None:
        self.node = Node(name, context=context, namespace="/there")
        self._publisher = publisher(self.node, NUMBER)

    def wait(self, readers: int = 1) -> Publisher:
        while self._publisher.get_subscription_count() < readers:
            pass
        return self

    def send(self, *numbers: int) -> None:
        for number in numbers:
            self._publisher.publish(UInt32(data=number))


def test_a_message_comes_with_its_publisher(context):
    """As the graph names it, and with what rclpy tells of a message."""
    node = listener(context)
    taker = Taker(subscription(node, NUMBER, lambda m: None))
    assert taker.take() is None
    one, two = Publisher(context, "one").wait(), Publisher(context, "two").wait()
    one.send(7, 8)
    two.send(9)
    taken = []
    while len(taken) < 3:
        taken += filter(None, [taker.take()])
    names = publishers(node, NUMBER.name)
    assert {(names[each.publisher], each.data, each.number) for each in taken} == {
        ("/there/one", serialize_message(UInt32(data=7)), 1),
        ("/there/one", serialize_message(UInt32(data=8)), 2),
        ("/there/two", serialize_message(UInt32(data=9)), 1),
    }
    assert all(0 < each.published_ns <= each.received_ns for each in taken)


def test_messages_of_any_length_come_whole(context):
    """Longer ones than the buffer, and short ones after them."""
    node = listener(context)
    texts_out = publisher(node, TEXT)
    polled = PolledSubscription(node, TEXT, Senders(node))
    while not texts_out.get_subscription_count():
        pass
    texts = ["", "x" * 10, "y" * 100_000, "z"]
    received = []
    for text in texts:
        texts_out.publish(String(data=text))
    while len(received) < len(texts):
        received += [each.message.data for each in polled.take()]
    assert received == texts
    assert polled.lost == 0


@pytest.mark.parametrize("polled", [True, False])
def test_only_those_who_belong_are_heard(context, polled):
    """By both kinds of subscription, from the first message on, in the order of sending."""
    node = listener(context, "/there/ours /there/other")
    senders, heard = Senders(node), []
    executor = StreamExecutor(context=context)
    executor.add_node(node)
    if polled:
        inputs = PolledSubscription(node, NUMBER, senders)
    else:
        senders.subscribe(NUMBER, lambda m: heard.append(m.data))
    stranger, ours = Publisher(context, "gamepad").wait(), Publisher(context, "ours").wait()
    for number in range(50):
        stranger.send(1000 + number)
        ours.send(number)
    left_out = (NUMBER.name, "/there/gamepad")
    while len(heard) < 50 or senders.left_out.get(left_out, 0) < 50:
        if polled:
            heard += [each.message.data for each in inputs.take()]
        else:
            executor.spin_once()
    assert heard == list(range(50))
    assert senders.left_out == {left_out: 50}
    if polled:
        assert inputs.lost == 0
    executor.shutdown()
    assert senders.includes("/there/other")
    assert not senders.includes("/there/gamepad")


def test_everybody_is_heard_where_nobody_is_named(context):
    node = listener(context)
    senders, heard = Senders(node), []
    executor = StreamExecutor(context=context)
    executor.add_node(node)
    senders.subscribe(NUMBER, lambda m: heard.append(m.data))
    Publisher(context, "any").wait().send(1, 2)
    while heard != [1, 2]:
        executor.spin_once()
    executor.shutdown()


class _Graph:
    """Stands in for a node: what the graph says of the publishers of a topic, and the time."""

    def __init__(self) -> None:
        self.names: dict[bytes, str] = {}
        self.now_s = 100.0

    def has_parameter(self, name: str) -> bool:
        return True

    def get_parameter(self, name: str):
        return types.SimpleNamespace(value="/a/ours /b")

    def get_publishers_info_by_topic(self, topic: str):
        return [
            types.SimpleNamespace(
                endpoint_gid=list(publisher),
                node_namespace=name.rpartition("/")[0] or "/",
                node_name=name.rpartition("/")[2],
            )
            for publisher, name in self.names.items()
        ]

    def senders(self) -> Senders:
        return Senders(self, lambda: self.now_s)


def test_a_publisher_whose_node_is_not_known_yet_is_neither_in_nor_out():
    graph = _Graph()
    senders = graph.senders()
    graph.names[b"1"] = "_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_"
    assert senders.accepts("/t", b"1") is None
    graph.names[b"1"] = "/a/ours"
    graph.now_s += 1.0
    assert senders.accepts("/t", b"1")
    senders.leave_out("/t", b"2")
    assert senders.left_out == {("/t", UNKNOWN_NODE): 1}


def test_a_node_that_is_started_again_takes_its_place_once_the_old_one_is_silent():
    """The graph goes on naming the dead one. A second one beside a living one stays outside."""
    graph = _Graph()
    senders = graph.senders()
    graph.names = {b"old": "/b", b"new": "/b"}
    assert senders.accepts("/t", b"old")
    graph.now_s += 1.0
    assert senders.accepts("/t", b"new") is None
    assert senders.accepts("/t", b"old")
    graph.now_s += 1.0
    assert senders.accepts("/t", b"new") is None
    graph.now_s += 1.0  # the old one has been silent for 2 s
    assert senders.accepts("/t", b"new")
    assert senders.accepts("/t", b"old") is None
    assert senders.accepts("/other", b"old")  # each topic has its own


def test_the_graph_is_not_asked_for_every_message():
    graph = _Graph()
    senders = graph.senders()
    graph.names = {b"1": "/b"}
    assert senders.accepts("/t", b"1")
    graph.names = {}
    assert senders.accepts("/t", b"1")
    assert senders.accepts("/t", b"2") is None
