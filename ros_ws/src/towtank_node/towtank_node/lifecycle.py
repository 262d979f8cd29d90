# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node that refuses what it is asked for in the wrong state, and lives on."""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode


class ManagedNode(LifecycleNode):
    """rclpy's LifecycleNode raises out of the service's callback, and so ends its process, when it
    is asked for a transition that its state does not have. Anybody in the domain may ask."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self._change_state = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state

    def _on_change_state(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        if self._has(request.transition):
            return self._change_state(request, response)
        asked = request.transition.label or f"transition {request.transition.id}"
        _, state = self._state_machine.current_state
        self.get_logger().warning(f"{asked} is refused: the node is {state}")
        response.success = False
        return response

    def _has(self, transition: Transition) -> bool:
        """Whether the node's state has this transition. A label counts before the number."""
        possible = self._state_machine.available_transitions
        if transition.label:
            return any(label == transition.label for _, label, *_ in possible)
        return any(number == transition.id for number, *_ in possible)
