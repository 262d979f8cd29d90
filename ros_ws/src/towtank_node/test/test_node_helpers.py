# SPDX-License-Identifier: Apache-2.0
"""Parameters, diagnostics and the main loop, on real rclpy nodes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import given
from hypothesis import strategies as st
from rclpy.clock import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from std_msgs.msg import UInt32
from std_srvs.srv import Trigger
from towtank_node import topics
from towtank_node.crank_node import CrankNode
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher, subscription
from towtank_node.executor import StreamExecutor
from towtank_node.parameters import Parameter, ParameterError, read_parameters
from towtank_node.qos import RELIABLE
from towtank_node.quick_stop import quick_stop
from towtank_node.stamps import SteadyTimes, ros_minus_monotonic_ns, set_stamp, stamp_ns
from towtank_node.timers import create_steady_timer
from towtank_node.topics import Topic
from towtank_node.trial_clock import TrialClock


def node_with(context, **values):
    overrides = [RosParameter(name, value=value) for name, value in values.items()]
    return Node("probe", context=context, parameter_overrides=overrides)


RATE = Parameter("rate_hz", int, "scan rate, Hz", default=100, minimum=10, maximum=200)
COUNT = Topic("count", "std_msgs/msg/UInt32", RELIABLE)
RIG = Parameter("rig", str, "path of the rig file")
NOISE = Parameter("noise", str, "sensor noise", default="rig", choices=("rig", "none"))


def test_parameters_take_given_and_default_values(context):
    values = read_parameters(node_with(context, rig="a.yaml"), [RATE, RIG, NOISE])
    assert (values.rate_hz, values.rig, values.noise) == (100, "a.yaml", "rig")


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({}, RIG, ["'rig' is missing", "path of the rig file"]),
        ({"rate_hz": 500}, RATE, ["'rate_hz'", "[10, 200]"]),
        ({"rate_hz": "fast"}, RATE, ["'rate_hz'", "scan rate"]),
        ({"noise": "some"}, NOISE, ["'noise' is 'some'", "rig, none"]),
    ],
)
def test_bad_parameter_is_refused_in_one_line(context, given, parameter, words):
    with pytest.raises(ParameterError) as refusal:
        read_parameters(node_with(context, **given), [parameter])
    message = str(refusal.value)
    assert "\n" not in message
    assert all(word in message for word in ["/probe", *words])


def test_diagnostics_report_state_and_overruns(context):
    node = node_with(context)
    received = []
    subscription(node, topics.DIAGNOSTICS, received.append)
    diagnostics = NodeDiagnostics(node, period_s=1e-9, details=lambda: {"lost": 3})
    with diagnostics.cycle():
        sum(range(100))  # longer than a nanosecond
    diagnostics.overrun(2)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    for _ in range(200):
        if node.count_subscribers(topics.DIAGNOSTICS.name):
            diagnostics.ready()
        executor.spin_once(timeout_sec=0.05)
        if received:
            break
    status = received[-1].status[0]
    values = {pair.key: pair.value for pair in status.values}
    assert status.level == DiagnosticStatus.OK
    assert status.name == "/probe"
    assert values["state"] == "ready"
    assert values["lost"] == "3"
    assert int(values["overruns"]) == diagnostics.overruns >= 3
    node.destroy_node()


def run_script(body: str) -> subprocess.Popen:
    script = textwrap.dedent(body)
    return subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    )


def test_main_loop_says_an_expected_error_in_one_line():
    process = run_script("""
        import sys
        from towtank_node.main import run_node
        def make():
            raise FileNotFoundError("no such port: give another")
        sys.exit(run_node(make))
    """)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert errors.strip() == "error: no such port: give another"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_main_loop_closes_the_node_on_a_signal(number):
    process = run_script("""
        import sys
        from rclpy.node import Node
        from towtank_node.main import run_node
        class Device(Node):
            def __init__(self):
                super().__init__("device")
                self.create_timer(0.05, lambda: print("spinning", flush=True))
            def close(self):
                print("closed", flush=True)
        sys.exit(run_node(lambda: Device()))
    """)
    assert process.stdout.readline().strip() == "spinning"
    process.send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert output.strip().endswith("closed")


@pytest.mark.parametrize(("signalled", "status"), [(True, 0), (False, 1)])
def test_main_loop_forgives_a_peer_that_goes_after_the_signal(signalled, status):
    """Ctrl-C reaches all processes of a terminal, and the one at the other end may be faster."""
    process = run_script(f"""
        import os, signal, sys
        from rclpy.node import Node
        from towtank_node.main import run_node
        class Device(Node):
            def __init__(self):
                super().__init__("device")
                self.create_timer(0.05, self.send)
            def send(self):
                if {signalled}:
                    os.kill(os.getpid(), signal.SIGINT)
                raise BrokenPipeError("the peer is gone")
        sys.exit(run_node(Device))
    """)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status
    assert errors == ("" if signalled else "error: the peer is gone\n")


def test_stream_executor_serves_messages_timers_and_services(context):
    """All that an executor serves, in one thread, with messages in the order of sending."""
    node = node_with(context)
    executor = StreamExecutor(context=context)
    executor.add_node(node)
    received, ticks = [], []
    subscription(node, COUNT, lambda m: received.append(m.data))
    counts = publisher(node, COUNT)
    node.create_timer(0.01, lambda: ticks.append(1))
    node.create_service(Trigger, "ask", lambda _, answer: answer)
    client = node.create_client(Trigger, "ask")
    for _ in range(200):
        executor.spin_once()
        if counts.get_subscription_count() and client.service_is_ready():
            break
    future = client.call_async(Trigger.Request())
    for number in range(20):
        counts.publish(UInt32(data=number))
    for _ in range(500):
        executor.spin_once()
        if future.done() and len(received) == 20 and len(ticks) >= 3:
            break
    assert received == list(range(20))
    assert future.done()
    assert len(ticks) >= 3
    node.destroy_node()


def test_stream_executor_ends_a_wait_that_hangs_on_the_systems_clock(context, monkeypatch):
    """The middleware's timed wait is made one without end, as setting the clock back makes it."""
    node = node_with(context)
    executor = StreamExecutor(context=context)
    executor.add_node(node)
    subscription(node, COUNT, lambda m: None)
    ticks = []
    create_steady_timer(node, 0.2, lambda: ticks.append(1))
    endless = []
    real_wait_set = _rclpy.WaitSet

    class WaitSet:
        def __init__(self, *arguments):
            self._wait_set = real_wait_set(*arguments)

        def __getattr__(self, name):
            return getattr(self._wait_set, name)

        def wait(self, timeout_ns):
            if timeout_ns > 0:
                endless.append(1)
            self._wait_set.wait(-1 if timeout_ns > 0 else timeout_ns)

    monkeypatch.setattr("towtank_node.executor._rclpy.WaitSet", WaitSet)
    while len(ticks) < 2 or not endless:
        executor.spin_once()
    executor.shutdown()
    node.destroy_node()


def test_steady_timer_is_not_on_the_nodes_clock(context):
    """Whose time stands still here, as that of a system whose clock was set back."""
    node = node_with(context, use_sim_time=True)
    ticks = []
    create_steady_timer(node, 0.01, lambda: ticks.append(1))
    NodeDiagnostics(node, 1.0)
    assert {timer.clock.clock_type for timer in node.timers} == {ClockType.STEADY_TIME}
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while len(ticks) < 3:
        executor.spin_once(timeout_sec=1.0)
    node.destroy_node()


def test_stream_executor_passes_errors_of_callbacks_on(context):
    node = node_with(context)
    executor = StreamExecutor(context=context)
    executor.add_node(node)

    def fail(_):
        raise ZeroDivisionError

    subscription(node, COUNT, fail)
    counts = publisher(node, COUNT)
    with pytest.raises(ZeroDivisionError):
        for _ in range(500):
            if counts.get_subscription_count():
                counts.publish(UInt32())
            executor.spin_once()
    node.destroy_node()


def test_ros_clock_is_read_between_interruptions():
    """Of twenty readings only one is not held up for 1 ms; half of its 100 ns may be wrong."""
    now = 0
    delays = iter([1_000_000] * 7 + [100] + [1_000_000] * 12)

    def ros_ns() -> int:
        nonlocal now
        reading = now + 777
        now += next(delays)
        return reading

    assert ros_minus_monotonic_ns(ros_ns, lambda: now) == pytest.approx(777, abs=50)


_S = 1_000_000_000


class _Host:
    """A host with both clocks; the system's is ahead of the monotonic one by `offset_ns`."""

    def __init__(self, offset_ns: int) -> None:
        self.now_ns, self.offset_ns = 5 * _S, offset_ns

    def monotonic_ns(self) -> int:
        return self.now_ns

    def system_ns(self) -> int:
        return self.now_ns + self.offset_ns


@given(
    st.integers(-3600 * _S, 3600 * _S).filter(lambda step: abs(step) > _S // 2),
    st.lists(st.integers(1, 30_000_000), min_size=30, max_size=60),
    st.integers(0, 29),
)
def test_times_of_messages_know_nothing_of_a_step_of_the_clock(step_ns, intervals, step_at):
    """Messages 1 to 30 ms apart and published 1 ms before, looked at every ten; the clock steps
    between two of them. All times come out even, to the nanosecond."""
    offset = 1_790_000_000 * _S
    host = _Host(offset)
    times = SteadyTimes(offset, host.system_ns, host.monotonic_ns)
    noted, expected = [], []
    for number, interval in enumerate(intervals):
        if number == step_at:
            host.offset_ns += step_ns
        host.now_ns += interval
        noted.append(host.system_ns())
        expected.append(host.now_ns + offset)
        if number % 10 == 9:
            times.look()
            received = [times.received(time_ns) for time_ns in noted]
            assert received == expected
            before = [t - 1_000_000 for t in noted]
            assert list(map(times.published, before, received)) == [t - 1_000_000 for t in expected]
            noted.clear()
            expected.clear()


def test_trial_clock_goes_on_where_the_trial_began(context):
    """A node that is told the trial's offset stamps by it, whatever the system's clock says now."""
    node = node_with(context, clock_offset_ns=7 * _S)
    clock = TrialClock(node)
    assert clock.given
    before = time.monotonic_ns()
    assert before + 7 * _S <= clock.now_ns() <= time.monotonic_ns() + 7 * _S
    alone = TrialClock(node_with(context))
    assert not alone.given
    assert abs(alone.now_ns() - node.get_clock().now().nanoseconds) < _S


@given(st.integers(0, 2**31 * 1_000_000_000 - 1))
def test_stamps_keep_every_nanosecond(time_ns):
    stamp = Time()
    set_stamp(stamp, time_ns)
    assert stamp_ns(stamp) == time_ns


def test_a_crank_node_that_is_destroyed_listens_to_no_emergency_stop(context):
    """Else the next one in the process would find the place taken."""
    for _ in range(2):
        node = CrankNode("crank_drive", context=context)
        node.heed(lambda: "")
        assert quick_stop(context.get_domain_id()) == ""
        node.destroy_node()
        assert quick_stop(context.get_domain_id()) is None
