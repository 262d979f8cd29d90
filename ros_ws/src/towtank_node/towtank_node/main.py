# SPDX-License-Identifier: Apache-2.0
"""The main loop of a node's process."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.signals import SignalHandlerOptions

from towtank_node.executor import HOUSEKEEPING_PERIOD_S, StreamExecutor
from towtank_node.parameters import ParameterError


def run_node(
    make_node: Callable[[], Any],
    expected_errors: tuple[type[Exception], ...] = (),
    arguments: list[str] | None = None,
) -> int:
    """Make a node, spin it until SIGINT or SIGTERM, close it: run_nodes() with one."""
    return run_nodes(lambda: [make_node()], expected_errors, arguments)


def run_nodes(
    make_nodes: Callable[[], Sequence[Any]],
    expected_errors: tuple[type[Exception], ...] = (),
    arguments: list[str] | None = None,
    make_executor: Callable[[], Any] = StreamExecutor,
) -> int:
    """Make nodes, spin them until SIGINT or SIGTERM, close them. Returns the exit status.

    A node with a `close()` method gets it called in any case, to give back its device or file,
    while it can still publish: rclpy's own signal handlers would tear the context down first.
    Errors of the types in `expected_errors` (and ParameterError, OSError) end the process with
    one line on standard error and status 1; any other error is ours and shows its traceback.
    A `failure` that a node has is such an error too: what a callback raises itself, EventsExecutor
    tells with a traceback.
    A ConnectionError after the signal is none: what it was connected to has been stopped too.

    make_executor: StreamExecutor, or rclpy's EventsExecutor for nodes that subscribe to nothing: it
    waits for events instead of asking all entities, but takes no messages by their sender and knows
    no guard conditions.
    """
    stop_signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: stop_signals.append(received))
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    nodes: Sequence[Any] = ()
    executor: Any = None
    try:
        nodes = make_nodes()
        executor = make_executor()
        for node in nodes:
            executor.add_node(node)
        while not stop_signals:
            executor.spin_once(timeout_sec=HOUSEKEEPING_PERIOD_S)
            for node in nodes:
                if failure := getattr(node, "failure", None):
                    raise failure
    except (ParameterError, OSError, *expected_errors) as error:
        if stop_signals and isinstance(error, ConnectionError):
            return 0
        print(f"error: {error}", file=sys.stderr, flush=True)
        return 1
    finally:
        if executor is not None:
            executor.shutdown()  # while what it listens to is there
        for node in nodes:
            getattr(node, "close", lambda: None)()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
