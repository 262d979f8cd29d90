# SPDX-License-Identifier: Apache-2.0
"""The main loop of a node's process."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from towtank_node.parameters import ParameterError

_LONGEST_WAIT_S = 0.2  # a signal is noticed within this time


def run_node(
    make_node: Callable[[], Any],
    expected_errors: tuple[type[Exception], ...] = (),
    arguments: list[str] | None = None,
) -> int:
    """Make a node, spin it until SIGINT or SIGTERM, close it. Returns the exit status.

    A single-threaded executor: it is the fastest and most even one that rclpy has. A node with a
    `close()` method gets it called in any case, to give back its device or file, while it can
    still publish: rclpy's own signal handlers would tear the context down first. Errors of the
    types in `expected_errors` (and ParameterError, OSError) end the process with one line on
    standard error and status 1; any other error is a fault of ours and shows its traceback.
    """
    stop_signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: stop_signals.append(received))
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stop_signals:
            executor.spin_once(timeout_sec=_LONGEST_WAIT_S)
        executor.shutdown()
    except (ParameterError, OSError, *expected_errors) as error:
        print(f"error: {error}", file=sys.stderr, flush=True)
        return 1
    finally:
        if node is not None:
            getattr(node, "close", lambda: None)()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
