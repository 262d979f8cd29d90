# SPDX-License-Identifier: Apache-2.0
"""The node that leads a trial: waits for the others, zeroes, drives, marks the log.

The conductor knows the graph by name only. It configures and activates the lifecycle nodes, waits
until every node has reported itself ready on /diagnostics, and publishes the trial's events. A
lifecycle node whose process was started again under way, by whoever watches the processes, tells
by its diagnostics that it is not ready any more; the conductor then activates it once more.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import State, Transition
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from towtank_interfaces.msg import CrankDrive, HeaveRatio, TrialEvent
from towtank_interfaces.srv import SetCrankSpeed, SetDrive
from towtank_node import calls, topics
from towtank_node.calls import Call
from towtank_node.endpoints import client, publisher
from towtank_node.executor import StreamExecutor
from towtank_node.leading import LifecycleClient
from towtank_node.names import (
    BODIES,
    CARRIAGE_JOINT,
    CONDUCTOR_NODE,
    CRANK_DRIVE_NODE,
    MEASURED,
    PLANT_NODE,
    TWIN,
    pressure_node,
    split_name,
)
from towtank_node.senders import UNKNOWN_NODE, Senders, publishers
from towtank_node.services import SET_CRANK_SPEED, SET_DRIVE, ZERO, Service
from towtank_node.trial_clock import TrialClock

from towtank_bringup.crank_watch import CrankWatch
from towtank_bringup.environment import NO_LOG_FILES
from towtank_bringup.graph import Graph, NodeGroup, told_to_all

SERVICE_TIMEOUT_S = 30.0
_SPIN_S = 0.05
_STRANGERS_S = 1.0  # between two looks for them
_RUN_OUT_S = 10.0  # for a soft stop, which takes 6 s from 60 rpm
_UNHEARD_S = 2.0
_STOP_AGAIN_S = 1.0
_REST_S = 1.0  # in which the board tells of a crank that turns on without power


class TrialError(RuntimeError):
    """The trial cannot go on; the message names the cause and the mend."""


class CrankStopped(TrialError):
    """The crank does not run any more as the trial needs it."""


class Conductor(Node):
    """Leads the nodes of `graph`.

    watch: called a few times a second while waiting; raises if a process of the graph has ended.
    say: called with one line of progress.
    """

    def __init__(
        self,
        graph: Graph,
        watch: Callable[[], None] = lambda: None,
        say: Callable[[str], None] = print,
        context: rclpy.Context | None = None,
    ) -> None:
        told = [RosParameter(name, value=value) for name, value in told_to_all(graph).items()]
        super().__init__(
            split_name(CONDUCTOR_NODE)[1],
            context=context,
            use_global_arguments=False,
            parameter_overrides=told,
        )
        self._node_names = [name for item in graph for name in item.node_names]
        self._restarts = {
            name: item.restarts if isinstance(item, NodeGroup) else 0
            for item in graph
            for name in item.lifecycle_names
        }
        """Of the lifecycle nodes, in the graph's order: how often the process may die."""
        self._watch = watch
        self.say = say
        self.leading = False
        """True while all nodes are up, so that one that dies may be started again."""
        self._statuses: dict[str, DiagnosticStatus] = {}
        self.ratios: dict[str, HeaveRatio] = {}
        self._trial_clock = TrialClock(self)
        self._crank = CrankWatch()
        self._kept: dict[str, Client] = {}
        self._leaders = {name: LifecycleClient(self, name) for name in self._restarts}
        self._client(SET_CRANK_SPEED)
        for name in self._node_names:
            if name in map(pressure_node, BODIES):
                self._client(ZERO.of(name))
            if name == PLANT_NODE:
                self._client(SET_DRIVE)
        self._executor = StreamExecutor(context=context)
        self._executor.add_node(self)
        self._events = publisher(self, topics.EVENTS)
        self._senders = Senders(self)
        self._watch_at = 0.0
        self._publisher_counts: dict[str, int] = {}
        self._strangers: set[tuple[str, str]] = set()
        self._nameless: set[bytes] = set()
        self._senders.subscribe(topics.DIAGNOSTICS, self._on_status)
        self._senders.subscribe(topics.CRANK_DRIVE, self._on_crank_drive)
        for source in (MEASURED, TWIN):
            self._senders.subscribe(
                topics.HEAVE_RATIO.within(source),
                lambda ratio, source=source: self.ratios.__setitem__(source, ratio),
            )

    # ------------------------------------------------------------------ what the others say
    def _on_status(self, array: DiagnosticArray) -> None:
        for status in array.status:
            self._statuses[status.name] = status

    def _on_crank_drive(self, state: CrankDrive) -> None:
        if words := self._crank.take(state):
            self.say(f"warning: {words}")

    def _check(self) -> None:
        self._watch()
        if words := self._crank.fault():
            self._see_whether_the_crank_rests()
            words = self._crank.fault() or words
            raise CrankStopped(f"{words}: see that all is well and start a new trial")
        if time.monotonic() >= self._watch_at:
            self._watch_at = time.monotonic() + _STRANGERS_S
            self._look_for_strangers()
        for name, status in self._statuses.items():
            # The crank's drive is judged by its state: before the run a trip may be cleared
            if status.level >= DiagnosticStatus.ERROR and name != CRANK_DRIVE_NODE:
                raise TrialError(f"{name}: {status.message}")
        for node in self._restarts:
            if self.leading and not self._ready(node):
                self._bring_back(node)

    def _look_for_strangers(self) -> None:
        """Tell of the publishers of the trial's topics that are none of the trial's nodes."""
        if self._senders.everybody:
            return
        for topic in (topic.name for topic in topics.TRIAL):
            count = self.count_publishers(topic)
            if count == self._publisher_counts.get(topic):
                continue
            self._publisher_counts[topic] = count
            for sender, node in publishers(self, topic).items():
                if node == UNKNOWN_NODE and sender not in self._nameless:
                    self._nameless.add(sender)  # its name may come; looked at once more
                    del self._publisher_counts[topic]
                    break
                if not self._senders.includes(node) and (topic, node) not in self._strangers:
                    self._strangers.add((topic, node))
                    self.say(
                        f"warning: {node}, which is none of this trial's nodes, publishes {topic} "
                        "too: what it sends is left out"
                    )
                    self.mark(TrialEvent.STRANGER, node=node, topic=topic)

    def _see_whether_the_crank_rests(self) -> None:
        """Waits for what the board tells of a crank that turns on without power: its operator is
        to know of that, whatever stopped the run."""
        deadline = time.monotonic() + _REST_S
        while (left := deadline - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def _value(self, name: str, key: str) -> str:
        """What a node has last told under that name; '' if nothing."""
        status = self._statuses.get(name)
        pairs = status.values if status is not None else ()
        return next((str(pair.value) for pair in pairs if pair.key == key), "")

    def reported(self, key: str) -> dict[str, int]:
        """Return the last count of that name by node, of those that report it."""
        return {
            name: int(pair.value)
            for name, status in sorted(self._statuses.items())
            for pair in status.values
            if pair.key == key
        }

    # ------------------------------------------------------------------------------ waiting
    def spin_for(self, duration_s: float, progress: Callable[[], None] = lambda: None) -> None:
        """Let time pass; raises TrialError (or what `watch` raises) if something breaks."""
        deadline = time.monotonic() + duration_s
        while (left := deadline - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=min(_SPIN_S, left))
            self._check()
            progress()

    def wait_until(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Spin until `condition` holds; TrialError naming `what` after `timeout_s`."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                raise TrialError(f"{what}: not within {timeout_s:.0f} s")
            self._executor.spin_once(timeout_sec=_SPIN_S)
            self._check()

    def wait_for_steady_drive(
        self, targets: dict[str, float], tolerance: float, steady_s: float, timeout_s: float
    ) -> float:
        """Wait until the measured rates of the joints have been at their targets for `steady_s`.

        targets: rate by joint, crank in rad/s and carriage in m/s; tolerance: fraction of it.
        Returns the way that the carriage has run meanwhile, m, as far as it is known.
        """
        steady_since, steady_for = math.inf, 0.0
        positions: list[float] = []  # of the carriage: the first and the last

        def on_joints(joints: JointState) -> None:
            nonlocal steady_since, steady_for
            position = dict(zip(joints.name, joints.position, strict=False)).get(CARRIAGE_JOINT)
            if position is not None and math.isfinite(position):
                positions[1:] = [position]
            rates = dict(zip(joints.name, joints.velocity, strict=True))
            near = all(
                abs(rates[name] - target) <= tolerance * abs(target)
                for name, target in targets.items()
            )
            now = time.monotonic()
            steady_since = min(steady_since, now) if near else math.inf
            steady_for = now - steady_since  # by what is measured: a silent encoder adds nothing

        # Only while it is needed: a hundred messages a second are work.
        subscription = self._senders.subscribe(topics.MEASURED_JOINTS, on_joints)
        try:
            self.wait_until(
                lambda: steady_for >= steady_s,
                timeout_s,
                "steady run at " + ", ".join(f"{n} {rate:.4g}" for n, rate in targets.items()),
            )
        finally:
            self.destroy_subscription(subscription)
        return positions[-1] - positions[0] if positions else 0.0

    def hold_crank(self, tolerance: float) -> None:
        """From now on the trial ends if the crank's drive does not hold its present speed.

        tolerance: fraction of it.
        """
        self._crank.hold(tolerance)

    def release_crank(self) -> None:
        """The trial has no more need of the crank."""
        self._crank.release()

    @property
    def crank_turns(self) -> bool:
        """Whether a drive turns the crank, as far as it has told."""
        return self._crank.turns

    def bring_crank_to_rest(self) -> None:
        """Stop the crank softly, if the board's drive turns it, and look on until it stands.

        As long as it turns the graph is to be there: for an emergency stop, and to tell of a crank
        that does not obey. Nothing breaks this off, neither Ctrl-C nor a process that has ended;
        it takes 10 s at most, or 2 s where the drive is not heard.
        """
        if not self._crank.turns:
            return
        client = self._client(SET_CRANK_SPEED)
        request = SetCrankSpeed.Request(action=SetCrankSpeed.Request.STOP)
        begun = time.monotonic()
        ask_at = begun
        while self._crank.turns and time.monotonic() - begun < _RUN_OUT_S:
            unheard_s = min(self._crank.silence_s, time.monotonic() - begun)
            if unheard_s > _UNHEARD_S:
                break
            if time.monotonic() >= ask_at and client.service_is_ready():
                client.call_async(request)  # its states tell whether it obeys
                ask_at = time.monotonic() + _STOP_AGAIN_S
            self._executor.spin_once(timeout_sec=_SPIN_S)
        if self._crank.turns:
            self.say("warning: the crank is not seen at rest: press the emergency stop")
        else:
            self._see_whether_the_crank_rests()

    def _client(self, service: Service) -> Client:
        """The client of a service. Made once: a server answers those that it has known for long."""
        if service.name not in self._kept:
            self._kept[service.name] = client(self, service)
        return self._kept[service.name]

    def _wait_for_service(self, client: Client) -> None:
        self.wait_until(
            client.service_is_ready, SERVICE_TIMEOUT_S, f"service {client.srv_name} to come up"
        )

    # -------------------------------------------------------------------------- leading nodes
    def _transition(self, node: str, transition: int, word: str) -> None:
        leader = self._leaders[node]
        self.wait_until(leader.is_ready, SERVICE_TIMEOUT_S, f"{node} to come up")
        call = leader.transition(transition)
        self.wait_until(
            lambda: call.outcome() is not None, SERVICE_TIMEOUT_S, f"{node} to be {word}"
        )
        if not call.outcome():
            self.spin_for(1.0)  # its diagnostics say why
            raise TrialError(f"{node} could not be {word}: see its log")

    def bring_up(self) -> None:
        """Activate the lifecycle nodes in the graph's order and wait until every node is ready."""
        for node in self._restarts:
            self._activate(node)
        self.wait_until(
            lambda: all(map(self._ready, self._node_names)),
            SERVICE_TIMEOUT_S,
            "all nodes to report ready",
        )
        self.leading = True

    def _activate(self, node: str) -> None:
        self._transition(node, Transition.TRANSITION_CONFIGURE, "configured")
        self._transition(node, Transition.TRANSITION_ACTIVATE, "activated")

    def _ready(self, name: str) -> bool:
        return self._value(name, "state") == "ready"

    def _bring_back(self, node: str) -> None:
        """Activate a node whose process was started again, or which somebody else has deactivated,
        and mark that in the trial.

        One that dies meanwhile ends the trial, for the answers that are waited for would not come.
        """
        self.leading = False
        leader = self._leaders[node]
        self.wait_until(leader.is_ready, SERVICE_TIMEOUT_S, f"{node} to come up")
        asked = leader.state()
        self.wait_until(lambda: asked.answer() is not None, SERVICE_TIMEOUT_S, f"{node}'s state")
        state = asked.answer().current_state
        if state.id == State.PRIMARY_STATE_INACTIVE:
            self.say(f"activating {node} again, which somebody else had deactivated")
            self._transition(node, Transition.TRANSITION_ACTIVATE, "activated")
        elif self._restarts[node]:
            self.say(f"restarting {node}, whose process had ended")
            self._activate(node)
        else:
            raise TrialError(
                f"{node} is {state.label}: somebody else has ended its work; keep other "
                "programs' lifecycle requests out of the trial's domain and start again"
            )
        self.wait_until(lambda: self._ready(node), SERVICE_TIMEOUT_S, f"{node} to be ready")
        self.leading = True
        self.mark(TrialEvent.RESTARTED, node=node)

    def shut_down(self) -> None:
        """Deactivate and clean up the lifecycle nodes, the last activated first."""
        self.leading = False
        for node in reversed(self._restarts):
            self._transition(node, Transition.TRANSITION_DEACTIVATE, "deactivated")
            self._transition(node, Transition.TRANSITION_CLEANUP, "cleaned up")

    def zero(self, node_name: str) -> str:
        """Zero a pressure sensor at rest. Returns what the node says of it.

        Asked for once: a second request could be served when the carriage runs already. Where its
        answer gets lost the node's diagnostics tell what it has done.
        """
        client = self._client(ZERO.of(node_name))
        self._wait_for_service(client)
        before = self._value(node_name, "zeroed")
        call = Call(client, Trigger.Request())

        def told() -> str:
            words = self._value(node_name, "zeroed")
            return "" if words == before else words

        self.wait_until(
            lambda: call.answer() is not None or told() != "",
            SERVICE_TIMEOUT_S,
            f"{node_name} to be zeroed",
        )
        answer = call.answer()
        if answer is None:
            return told()
        if not answer.success:
            raise TrialError(f"{node_name} could not be zeroed: {answer.message}")
        return answer.message

    def set_drive(self, carriage_speed: float, crank_rate: float, ramp_time: float) -> None:
        """Command the virtual tank's carriage (m/s) and crank (rad/s) along a ramp (s)."""
        client = self._client(SET_DRIVE)
        self._wait_for_service(client)
        request = SetDrive.Request(
            carriage_speed=carriage_speed, crank_rate=crank_rate, ramp_time=ramp_time
        )
        call = Call(client, request, calls.AGAIN_S)
        self.wait_until(
            lambda: call.answer() is not None, SERVICE_TIMEOUT_S, f"answer of {SET_DRIVE.name}"
        )
        if not call.answer().success:
            raise TrialError(f"the drive refused {carriage_speed} m/s: {call.answer().message}")

    def mark(self, event: str, **detail: Any) -> None:
        """Publish an event of the trial, stamped now."""
        message = TrialEvent(event=event, detail=json.dumps(detail))
        self._trial_clock.stamp(message.header.stamp)
        self._events.publish(message)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()


def open_conductor(
    graph: Graph,
    watch: Callable[[], None],
    say: Callable[[str], None],
    ros_arguments: Sequence[str] = NO_LOG_FILES,
) -> Conductor:
    """A conductor in a ROS context without signal handlers: Ctrl-C stays the caller's."""
    rclpy.init(args=[*ros_arguments], signal_handler_options=SignalHandlerOptions.NO)
    return Conductor(graph, watch, say)
