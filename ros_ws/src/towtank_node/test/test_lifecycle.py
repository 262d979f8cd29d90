# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node that anybody in the domain may ask for anything."""

from __future__ import annotations

import pytest
import rclpy
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import TransitionCallbackReturn
from towtank_node.executor import StreamExecutor
from towtank_node.lifecycle import ManagedNode


class Device(ManagedNode):
    """Notes what it was led through."""

    def __init__(self, context: rclpy.Context) -> None:
        super().__init__("device", context=context)
        self.led = []

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        self.led.append("configure")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: State) -> TransitionCallbackReturn:
        self.led.append("activate")
        return TransitionCallbackReturn.SUCCESS


@pytest.fixture
def ask():
    """Asks the device's service for a transition; returns whether it was granted."""
    context = rclpy.Context()
    rclpy.init(context=context)
    device = Device(context)
    asker = rclpy.create_node("asker", context=context)
    client = asker.create_client(ChangeState, "/device/change_state")
    executor = StreamExecutor(context=context)
    executor.add_node(device)
    executor.add_node(asker)
    while not client.service_is_ready():
        executor.spin_once()

    def ask(**transition) -> bool:
        future = client.call_async(ChangeState.Request(transition=Transition(**transition)))
        while not future.done():
            executor.spin_once()
        return future.result().success

    ask.device = device
    yield ask
    executor.shutdown()
    rclpy.shutdown(context=context)


def test_wrong_transitions_are_refused_and_the_node_lives_on(ask):
    assert not ask(id=Transition.TRANSITION_ACTIVATE)
    assert not ask(label="deactivate")
    assert not ask(id=255)
    assert not ask(label="no such thing")
    assert ask(id=Transition.TRANSITION_CONFIGURE)
    assert not ask(id=Transition.TRANSITION_CONFIGURE)
    assert not ask(id=Transition.TRANSITION_UNCONFIGURED_SHUTDOWN)
    assert ask(label="activate")
    assert not ask(id=Transition.TRANSITION_CONFIGURE)
    assert not ask(id=Transition.TRANSITION_CLEANUP)
    # Those that rcl's state machine goes through by itself are nobody's to ask for
    assert not ask(id=Transition.TRANSITION_ON_ACTIVATE_ERROR)
    assert ask.device.led == ["configure", "activate"]
