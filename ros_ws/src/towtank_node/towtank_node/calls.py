# SPDX-License-Identifier: Apache-2.0
"""Calls of services whose answers may get lost.

A server that has not found the caller's reader within a tenth of a second (rmw_fastrtps) drops its
answer: it has done what it was asked for, and the caller waits in vain. That happens where one of
the two is new to the other and the machine is busy. So clients are made long before they are used
and kept, and what is asked is asked again, if it may be done twice, or judged by what can be seen
of it.
"""

from __future__ import annotations

import math
import time
from typing import Any

from rclpy.client import Client
from rclpy.task import Future

AGAIN_S = 5.0
"""Between two requests where one is not answered, s."""


class Call:
    """A request to a service that is there; looked at while the client's node is spun.

    again_s: asked again so often until an answer comes, s; only what may be done twice.
    after_s: asked for the first time so much later, s.
    """

    def __init__(
        self, client: Client, request: Any, again_s: float = math.inf, after_s: float = 0.0
    ) -> None:
        self._client = client
        self._request = request
        self._again_s = again_s
        self._ask_at = time.monotonic() + after_s
        self._asked: list[Future] = []

    def answer(self) -> Any | None:
        """The first answer that has come, or None; asks if it is time to."""
        answer = next((each.result() for each in self._asked if each.done()), None)
        now = time.monotonic()
        if answer is None and now >= self._ask_at:
            self._asked.append(self._client.call_async(self._request))
            self._ask_at = now + self._again_s
        return answer
