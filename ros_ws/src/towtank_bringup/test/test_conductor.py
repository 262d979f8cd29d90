# SPDX-License-Identifier: Apache-2.0
"""How the conductor judges what it hears."""

from __future__ import annotations

import contextlib
import threading
import time

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lifecycle_msgs.msg import State, Transition
from sensor_msgs.msg import JointState
from towtank_bringup.conductor import Conductor, TrialError
from towtank_bringup.course import OperatorDrive, run_course
from towtank_bringup.graph import NodeGroup, RosNode, joined
from towtank_interfaces.msg import CrankDrive, HeaveRatio, TrialEvent
from towtank_interfaces.srv import SetCrankSpeed, SetDrive
from towtank_node import names, topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher, server, subscription
from towtank_node.executor import StreamExecutor
from towtank_node.lifecycle import ManagedNode
from towtank_node.services import SET_CRANK_SPEED, ZERO
from towtank_node.stamps import stamp_ns


@pytest.fixture
def context(monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    context.try_shutdown()


def test_a_drive_that_is_not_heard_is_not_steady(context):
    """The encoder falls silent before the drive has run steadily for long enough; it may tell no
    positions."""
    said = []

    def watch():
        if len(said) < 20:
            message = JointState(
                name=[names.CRANK_JOINT, names.CARRIAGE_JOINT], velocity=[3.0, 1.0]
            )
            joints.publish(message)
            said.append(message)

    conductor = Conductor((), watch, context=context)
    joints = publisher(conductor, topics.MEASURED_JOINTS)
    with pytest.raises(TrialError, match="steady run at crank 3, carriage 1: not within 8 s"):
        conductor.wait_for_steady_drive({"crank": 3.0, "carriage": 1.0}, 0.03, 4.0, 8.0)
    assert len(said) == 20
    conductor.close()


class Device(ManagedNode):
    """A lifecycle node of the graph, spun in a thread of its own."""

    def __init__(self, context) -> None:
        super().__init__("device", context=context)
        self.diagnostics = NodeDiagnostics(self, 1.0)
        self.executor_ = StreamExecutor(context=context)
        self.executor_.add_node(self)
        self.asked = []
        self.led_to = []
        self.answers_lost = 0
        self._answering = self._service_change_state.callback
        self._service_change_state.callback = self._answer
        self._ending = False
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def on_activate(self, state):
        self.diagnostics.ready()
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.diagnostics.stop("deactivated")
        return super().on_deactivate(state)

    def _answer(self, request, response):
        self.led_to.append(request.transition.id)
        answer = self._answering(request, response)
        if self.answers_lost:
            self.answers_lost -= 1
            raise LookupError  # the transition is done, and no answer given
        return answer

    def end(self) -> None:
        self._ending = True
        self._thread.join()
        self.executor_.shutdown()
        self.destroy_node()

    def _spin(self) -> None:
        while not self._ending:
            while self.asked:
                self.asked.pop(0)()
            with contextlib.suppress(LookupError):
                self.executor_.spin_once()


GRAPH = joined((RosNode("p", "e", "/", "device", lifecycle=True),), clock_offset_ns=7)


@pytest.fixture
def led(context):
    """A conductor that has brought a device up, the device, and the events it has marked."""
    device = Device(context)
    said = []
    conductor = Conductor(GRAPH, say=said.append, context=context)
    events = []
    conductor.mark = lambda event, **detail: events.append((event, detail))
    conductor.bring_up()
    yield conductor, device, events, said
    device.end()
    conductor.close()


def test_a_node_that_somebody_else_deactivates_is_activated_again(led):
    conductor, device, events, said = led
    device.asked.append(device.trigger_deactivate)
    conductor.wait_until(lambda: events, 60.0, "the device to be back")
    assert events == [("restarted", {"node": "/device"})]
    assert "activating /device again, which somebody else had deactivated" in said
    conductor.shut_down()


def test_a_node_that_somebody_else_cleans_up_ends_the_trial(led):
    conductor, device, _, _ = led
    device.asked += [device.trigger_deactivate, device.trigger_cleanup]
    with pytest.raises(TrialError, match="/device is unconfigured: somebody else has ended its"):
        conductor.spin_for(60.0)


def test_strangers_are_told_of_once_and_their_word_is_not_taken(led):
    """Errors, values that are no numbers, and a second set of ratios."""
    conductor, _, events, said = led
    gamepad = rclpy.create_node("gamepad", context=conductor.context)
    diagnostics = publisher(gamepad, topics.DIAGNOSTICS)
    ratios = publisher(gamepad, topics.TWIN_RATIO)
    error = DiagnosticStatus(name="joy", level=DiagnosticStatus.ERROR)
    odd = DiagnosticStatus(name="/device", values=[KeyValue(key="overruns", value="n/a")])

    def publish():
        diagnostics.publish(DiagnosticArray(status=[error, odd]))
        ratios.publish(HeaveRatio(value=0.5, valid=True))
        return len(events) == 2 and sum(conductor._senders.left_out.values()) >= 10

    conductor.wait_until(publish, 60.0, "the strangers to be told of")
    assert sorted(events, key=str) == [
        ("stranger", {"node": "/gamepad", "topic": topic})
        for topic in (topics.DIAGNOSTICS.name, topics.TWIN_RATIO.name)
    ]
    assert sum("warning: /gamepad, which is none of this" in line for line in said) == 2
    assert conductor.reported("overruns") == {"/device": 0}
    assert conductor.ratios == {}
    gamepad.destroy_node()


def test_a_trip_is_told_as_a_warning(context):
    """Which no progress writes over."""
    said = []
    conductor = Conductor((), say=said.append, context=context)
    conductor._on_crank_drive(CrankDrive(trip=CrankDrive.RUNAWAY))
    assert said[0].startswith("warning: the crank's drive has tripped: runaway")
    conductor.close()


def test_events_are_stamped_by_the_trials_clock(context):
    conductor = Conductor(GRAPH, context=context)
    heard = []
    subscription(conductor, topics.EVENTS, heard.append)
    before_ns = time.monotonic_ns()
    conductor.mark(TrialEvent.STARTED)
    conductor.wait_until(lambda: heard, 60.0, "the event")
    assert before_ns + 7 <= stamp_ns(heard[0].header.stamp) <= time.monotonic_ns() + 7
    conductor.close()


def test_an_answer_that_got_lost_is_asked_for_again(context, monkeypatch):
    monkeypatch.setattr("towtank_node.calls.AGAIN_S", 0.1)
    conductor = Conductor((), context=context)
    plant = rclpy.create_node("simulator", namespace="plant", context=context)
    asked = []

    def answer(request, response):
        asked.append(request.crank_rate)
        if len(asked) < 3:
            raise LookupError  # the request is taken, and no answer given
        response.success = True
        return response

    plant.create_service(SetDrive, "set_drive", answer)
    with served(plant, context):
        conductor.set_drive(1.0, 3.0, 5.0)
    assert asked == [3.0] * 3
    plant.destroy_node()
    conductor.close()


def test_a_transition_whose_answer_got_lost_is_judged_by_the_nodes_state(context, monkeypatch):
    """Each of a trial's four: asked for once, and known to be done."""
    monkeypatch.setattr("towtank_node.calls.AGAIN_S", 0.1)
    device = Device(context)
    conductor = Conductor(GRAPH, context=context)
    device.answers_lost = 4
    conductor.bring_up()
    conductor.shut_down()
    assert device.led_to == [
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
    ]
    device.end()
    conductor.close()


def test_the_state_before_a_transition_does_not_decide_it(led, monkeypatch):
    """Both requests may wait for the node, and the one for its state may be served first."""
    monkeypatch.setattr("towtank_node.calls.AGAIN_S", 0.1)
    conductor, device, _, _ = led
    states, waiting = [], []
    get_state = device._service_get_state.callback

    def wait(request, response):
        waiting.append(lambda: device._answering(request, response))
        raise LookupError  # no answer

    def tell_state(request, response):
        states.append(get_state(request, response).current_state.id)
        device.asked += waiting  # done after the state was told
        waiting.clear()
        return response

    device._service_change_state.callback = wait
    device._service_get_state.callback = tell_state
    conductor.leading = False
    conductor._transition("/device", Transition.TRANSITION_DEACTIVATE, "deactivated")
    assert states[0] == State.PRIMARY_STATE_ACTIVE
    assert states[-1] == State.PRIMARY_STATE_INACTIVE


def test_a_transition_whose_request_got_lost_is_asked_for_again(led, monkeypatch):
    """The node is where it was whenever it is asked."""
    monkeypatch.setattr("towtank_node.calls.AGAIN_S", 0.1)
    conductor, device, _, _ = led
    asked = []

    def lose_the_first(request, response):
        asked.append(request.transition.id)
        if len(asked) == 1:
            raise LookupError  # neither done nor answered
        return change_state(request, response)

    change_state = device._service_change_state.callback
    device._service_change_state.callback = lose_the_first
    conductor.leading = False
    conductor._transition("/device", Transition.TRANSITION_DEACTIVATE, "deactivated")
    assert asked == [Transition.TRANSITION_DEACTIVATE] * 2
    assert device.led_to.count(Transition.TRANSITION_DEACTIVATE) == 1


def test_a_zero_whose_answer_got_lost_is_done_once(context):
    """A second could come when the carriage runs; the sensor's diagnostics tell of the first."""
    name = names.pressure_node(names.FISH)
    group = NodeGroup("p", "e", (name,))
    conductor = Conductor((group,), context=context)
    namespace, own_name = names.split_name(name)
    sensor = rclpy.create_node(own_name, namespace=namespace, context=context)
    zeroed = ["zero at 0.1 m"]  # of an earlier trial
    diagnostics = NodeDiagnostics(sensor, 1.0, lambda: {"zeroed": zeroed[-1]})

    def zero(request, response):
        zeroed.append(f"zero at 0.{len(zeroed) + 1} m")
        raise LookupError  # done, and no answer given

    server(sensor, ZERO.of("~"), zero)
    with served(sensor, context):
        diagnostics.ready()
        conductor.wait_until(lambda: conductor._ready(name), 60.0, "the sensor")
        assert conductor.zero(name) == "zero at 0.2 m"
    assert zeroed == ["zero at 0.1 m", "zero at 0.2 m"]
    sensor.destroy_node()
    conductor.close()


@contextlib.contextmanager
def served(node, context):
    """The node is spun by a thread of its own meanwhile."""
    ending = threading.Event()

    def spin():
        executor = StreamExecutor(context=context)
        executor.add_node(node)
        while not ending.is_set():
            with contextlib.suppress(LookupError):
                executor.spin_once()
        executor.shutdown()

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()


class DrivenCrank:
    """A board's drive that tells its state often; a stop takes some time, or has no end."""

    def __init__(self, context, obeys: bool) -> None:
        namespace, name = names.split_name(names.CRANK_DRIVE_NODE)
        self.node = rclpy.create_node(name, namespace=namespace, context=context)
        self.told, self.asked, self._obeys = [], [], obeys
        self._publisher = publisher(self.node, topics.CRANK_DRIVE)
        server(self.node, SET_CRANK_SPEED, self._on_set_speed)
        self._timer = self.node.create_timer(0.02, self._tell)

    def falls_silent(self) -> None:
        self._timer.cancel()

    def _tell(self) -> None:
        state = CrankDrive.STOPPING if self.asked else CrankDrive.RUNNING
        if self._obeys and self.asked and len(self.told) > self.asked[0] + 10:
            state = CrankDrive.STOPPED
        self.told.append(state)
        self._publisher.publish(CrankDrive(state=state))

    def _on_set_speed(self, request, response):
        assert request.action == SetCrankSpeed.Request.STOP
        self.asked.append(len(self.told))
        response.success = True
        return response


@contextlib.contextmanager
def driven(context, obeys: bool = True):
    """A crank that turns, a conductor that knows of it, and what that says."""
    said = []
    crank = DrivenCrank(context, obeys)
    conductor = Conductor((), say=said.append, context=context)
    with served(crank.node, context):
        conductor.wait_until(lambda: conductor.crank_turns, 60.0, "a crank that turns")
        yield crank, conductor, said
    crank.node.destroy_node()
    conductor.close()


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr("towtank_bringup.conductor._RUN_OUT_S", 60.0)
    monkeypatch.setattr("towtank_bringup.conductor._REST_S", 0.1)


def test_the_end_of_a_trial_sees_the_crank_at_rest(context, quick):
    """The graph goes down after that: an emergency stop would reach nothing any more."""
    with driven(context) as (crank, conductor, said):
        conductor.bring_crank_to_rest()
        assert crank.told[-1] == CrankDrive.STOPPED
        assert not said


def test_a_crank_that_does_not_obey_is_told_of(context, quick, monkeypatch):
    monkeypatch.setattr("towtank_bringup.conductor._RUN_OUT_S", 1.0)
    with driven(context, obeys=False) as (crank, conductor, said):
        conductor.bring_crank_to_rest()
        assert crank.asked
        assert "press the emergency stop" in said[-1]


def test_a_drive_that_is_not_heard_any_more_is_not_waited_for(context, quick, monkeypatch):
    monkeypatch.setattr("towtank_bringup.conductor._UNHEARD_S", 0.2)
    with driven(context) as (crank, conductor, said):
        crank.falls_silent()
        conductor.bring_crank_to_rest()  # else for a minute, and the test's time is over
        assert "press the emergency stop" in said[-1]


@pytest.mark.parametrize("error", [TrialError("a fault"), KeyboardInterrupt("SIGINT")])
def test_a_trial_that_breaks_off_stops_the_crank_first(context, quick, monkeypatch, error):
    """Also where the graph is what broke: what watches that must not keep the stop."""

    def broken(*_):
        raise error

    monkeypatch.setattr("towtank_bringup.course._lead", broken)
    with driven(context) as (crank, conductor, said):
        conductor._watch = broken
        with pytest.raises(type(error)):
            run_course(conductor, None, OperatorDrive(), None)
        assert crank.told[-1] == CrankDrive.STOPPED
        assert said == [f"stopping the crank first: {error}"]


def test_a_crank_that_something_else_turns_is_left_to_that(context):
    conductor = Conductor((), context=context)
    conductor.bring_crank_to_rest()  # asks nobody: there is no drive that would answer
    conductor.close()
