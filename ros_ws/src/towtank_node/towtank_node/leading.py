# SPDX-License-Identifier: Apache-2.0
"""Leading a lifecycle node of another process, whose answers may get lost (calls.py)."""

from __future__ import annotations

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.node import Node

from towtank_node import calls
from towtank_node.calls import Call

_UNCONFIGURED, _INACTIVE, _ACTIVE = (
    State.PRIMARY_STATE_UNCONFIGURED,
    State.PRIMARY_STATE_INACTIVE,
    State.PRIMARY_STATE_ACTIVE,
)
_PRIMARY = {_UNCONFIGURED, _INACTIVE, _ACTIVE, State.PRIMARY_STATE_FINALIZED}
_ENDS = {
    Transition.TRANSITION_CONFIGURE: (_UNCONFIGURED, _INACTIVE),
    Transition.TRANSITION_ACTIVATE: (_INACTIVE, _ACTIVE),
    Transition.TRANSITION_DEACTIVATE: (_ACTIVE, _INACTIVE),
    Transition.TRANSITION_CLEANUP: (_INACTIVE, _UNCONFIGURED),
}
"""State before and behind each transition."""


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
        return TransitionCall(self, transition)

    def change(self, transition: int) -> Call:
        """Ask for a transition once, a ChangeState.Response."""
        return Call(self._change_state, ChangeState.Request(transition=Transition(id=transition)))


class TransitionCall:
    """A transition under way. Where no answer comes the node's state tells.

    A node may answer for its state before it begins the transition. So only the goal says that it
    is done; and only a node that twice is still where it was has not got the request, which is then
    made again. A node that gets both refuses the second.
    """

    def __init__(self, leader: LifecycleClient, transition: int) -> None:
        self._leader = leader
        self._transition = transition
        self._before, self._goal = _ENDS[transition]
        self._changes = [leader.change(transition)]
        self._state = leader.state(calls.AGAIN_S)
        self._unmoved = 0

    def outcome(self) -> bool | None:
        """Whether the node has done it; None as long as that is not known."""
        answers = [change.answer() for change in self._changes]
        if any(answer is not None and answer.success for answer in answers):
            return True
        if len(answers) == 1 and answers[0] is not None:
            return False
        if (state := self._state.answer()) is None:
            return None
        if state.current_state.id == self._goal:
            return True
        if answers[-1] is not None or state.current_state.id in _PRIMARY - {self._before}:
            return False  # refused, or it has failed
        self._unmoved = self._unmoved + 1 if state.current_state.id == self._before else 0
        if self._unmoved == 2:
            self._unmoved = 0
            self._changes.append(self._leader.change(self._transition))
        self._state = self._leader.state(calls.AGAIN_S)
        return None
