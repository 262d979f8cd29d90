# SPDX-License-Identifier: Apache-2.0
"""Calls to the crank drives of one or more ROS domains, as fast as they can be made.

The nodes have neither parameters nor a log topic: these took longer to make than all the rest.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node.calls import Call
from towtank_node.endpoints import client, subscription
from towtank_node.services import SET_CRANK_SPEED
from towtank_node.topics import CRANK_DRIVE

from towtank_bringup.environment import NO_LOG_FILES

_SAME_RATE = 0.01  # rad/s; the board's steps are of a tenth of that
_WAIT_S = 5.0
_BESIDES_S = 1.0
_AGAIN_S = 0.5
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
        # An answer that is lost while the nodes still learn of one another would be waited for in
        # vain. Twice stopped is stopped; what starts a crank is asked for once, for a stop may come
        # between, and then the drive's state tells.
        again_s = math.inf if action == "RUN" else _AGAIN_S
        awaited = set(self._drives if insistent is None else insistent) - set(self._closed_ones)
        start = time.monotonic()
        while (waited := time.monotonic() - start) < _WAIT_S:
            open_ones = {
                d for d, drive in self._drives.items() if not drive.attend(request, again_s)
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
        self._client = client(self._node, SET_CRANK_SPEED)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._call: Call | None = None
        self._runs = False

    def attend(self, request: SetCrankSpeed.Request, again_s: float) -> bool:
        """Do what can be done now; returns whether the drive has answered, or is seen to run."""
        if self._call is None:
            if not self._client.service_is_ready():
                return False
            if request.action == SetCrankSpeed.Request.RUN:
                self._watch(request.crank_rate)
            self._call = Call(self._client, request, again_s)
        if self._call.answer() is not None or self._runs:
            return True
        self._executor.spin_once(timeout_sec=_POLL_S)
        return False

    def refusal(self) -> str:
        """Why it has not done what was asked for; empty if it has."""
        if self._call is None:
            return (
                f"no {SET_CRANK_SPEED.name} in ROS domain {self._domain} within {_WAIT_S:g} s: "
                "start a trial on the board first"
            )
        if (answer := self._call.answer()) is not None:
            return "" if answer.success else str(answer.message)
        if self._runs:
            return ""
        return (
            f"{SET_CRANK_SPEED.name} does not answer in ROS domain {self._domain}: look at the "
            "crank, and see the board's node"
        )

    def _watch(self, rate: float) -> None:
        """Look whether the crank runs at `rate`, rad/s, as it was asked to."""
        from towtank_interfaces.msg import CrankDrive  # takes its time, and a stop needs it not

        def on_state(state: CrankDrive) -> None:
            self._runs = state.state == CrankDrive.RUNNING and math.isclose(
                state.target_rate, rate, abs_tol=_SAME_RATE
            )

        subscription(self._node, CRANK_DRIVE, on_state)

    def close(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)
