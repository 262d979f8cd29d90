# SPDX-License-Identifier: Apache-2.0
"""Calls to the crank drives of one or more ROS domains, as fast as they can be made.

The nodes have neither parameters nor a log topic: these took longer to make than all the rest.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from towtank_interfaces.srv import SetCrankSpeed

from towtank_bringup.environment import NO_LOG_FILES

SERVICE = "/measured/crank_drive/set_speed"
_WAIT_S = 5.0
_BESIDES_S = 1.0
_REPEAT_S = 0.5
_POLL_S = 0.002


class CrankCalls:
    """The crank drives of some domains. Used as a context manager.

    A domain that cannot be entered keeps no call from the others.
    """

    def __init__(self, domains: Iterable[int]) -> None:
        self._drives: dict[int, _Drive] = {}
        self._closed_ones: dict[int, str] = {}
        for domain in domains:
            try:
                self._drives[domain] = _Drive(domain)
            except RuntimeError as error:  # rclpy's RCLError is one
                why = str(error).partition("\n")[0]
                self._closed_ones[domain] = f"ROS domain {domain} cannot be entered: {why}"

    def __enter__(self) -> CrankCalls:
        return self

    def __exit__(self, *_: object) -> None:
        for drive in self._drives.values():
            drive.close()

    def ask(
        self, action: str, crank_rate: float = 0.0, insistent: Collection[int] | None = None
    ) -> dict[int, str]:
        """Ask every drive for an action, a constant of SetCrankSpeed; crank_rate: rad/s.

        insistent: domains that are waited for to the end (default: all); the others get a second
        beyond that. Returns, by domain, why a drive has not done it; empty if all have.
        """
        request = SetCrankSpeed.Request(
            action=getattr(SetCrankSpeed.Request, action), crank_rate=crank_rate
        )
        # A call that is lost while the nodes still learn of one another would be waited for in
        # vain. Twice stopped is stopped; what starts a crank is asked for once.
        repeat_s = _WAIT_S if action == "RUN" else _REPEAT_S
        awaited = set(self._drives if insistent is None else insistent) - set(self._closed_ones)
        start = time.monotonic()
        while (waited := time.monotonic() - start) < _WAIT_S:
            open_ones = {
                d for d, drive in self._drives.items() if not drive.attend(request, repeat_s)
            }
            if not open_ones or (not open_ones & awaited and waited > _BESIDES_S):
                break
            time.sleep(_POLL_S)
        refusals = {
            domain: why for domain, drive in self._drives.items() if (why := drive.refusal())
        }
        return self._closed_ones | refusals


class _Drive:
    """One domain's drive, in a context of its own."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._context = Context()
        rclpy.init(
            args=[*NO_LOG_FILES],
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = rclpy.create_node(
            "crank_command",
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._client = self._node.create_client(SetCrankSpeed, SERVICE)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._asked_s = float("-inf")
        self._answers: list[Any] = []

    def attend(self, request: SetCrankSpeed.Request, repeat_s: float) -> bool:
        """Do what can be done now; returns whether the drive has answered."""
        now = time.monotonic()
        answered = [answer for answer in self._answers if answer.done()]
        if answered:
            return True
        if now - self._asked_s >= repeat_s and self._client.service_is_ready():
            self._answers.append(self._client.call_async(request))
            self._asked_s = now
        if self._answers:
            self._executor.spin_once(timeout_sec=_POLL_S)
        return False

    def refusal(self) -> str:
        """Why it has not done what was asked for; empty if it has."""
        for answer in self._answers:
            if answer.done():
                return "" if answer.result().success else str(answer.result().message)
        if self._answers:
            return f"{SERVICE} does not answer in ROS domain {self._domain}: see the board's node"
        return (
            f"no {SERVICE} in ROS domain {self._domain} within {_WAIT_S:g} s: start a trial on the "
            "board first"
        )

    def close(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)
