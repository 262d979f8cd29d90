# SPDX-License-Identifier: Apache-2.0
"""Leading a lifecycle node of another process, whose answers may get lost (calls.py)."""

from __future__ import annotations

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.node import Node

from towtank_node import calls
from towtank_node.calls import Call

_GOALS = {
    Transition.TRANSITION_CONFIGURE: State.PRIMARY_STATE_INACTIVE,
    Transition.TRANSITION_ACTIVATE: State.PRIMARY_STATE_ACTIVE,
    Transition.TRANSITION_DEACTIVATE: State.PRIMARY_STATE_INACTIVE,
    Transition.TRANSITION_CLEANUP: State.PRIMARY_STATE_UNCONFIGURED,
}


class LifecycleClient:
    """Leads a lifecycle node of another process; to be made early and kept.

    node: that the clients belong to. name: full name of the node that is led.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._change_state = node.create_client(ChangeState, f"{name}/change_state")
        self._get_state = node.create_client(GetState, f"{name}/get_state")

    def is_ready(self) -> bool:
        """Whether the node is there to be asked."""
        return self._change_state.service_is_ready() and self._get_state.service_is_ready()

    def state(self, after_s: float = 0.0) -> Call:
        """Ask for the node's state, a GetState.Response, after so much time."""
        return Call(self._get_state, GetState.Request(), calls.AGAIN_S, after_s)

    def transition(self, transition: int) -> TransitionCall:
        """Ask for a transition, one of Transition's constants to a primary state."""
        request = ChangeState.Request(transition=Transition(id=transition))
        return TransitionCall(self, Call(self._change_state, request), _GOALS[transition])


class TransitionCall:
    """A transition under way, asked for once. Where no answer comes the node's state tells.

    A node may answer for its state before it begins the transition: only the goal says something.
    """

    def __init__(self, leader: LifecycleClient, change: Call, goal: int) -> None:
        self._leader = leader
        self._change = change
        self._goal = goal
        self._state = leader.state(calls.AGAIN_S)

    def outcome(self) -> bool | None:
        """Whether the node has done it; None as long as that is not known."""
        if (change := self._change.answer()) is not None:
            return bool(change.success)
        if (state := self._state.answer()) is None:
            return None
        if state.current_state.id == self._goal:
            return True
        self._state = self._leader.state(calls.AGAIN_S)
        return None
