# SPDX-License-Identifier: Apache-2.0
"""The main loop of a node's process."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from towtank_node.parameters import ParameterError


def run_node(
    make_node: Callable[[], Any],
    expected_errors: tuple[type[Exception], ...] = (),
    arguments: list[str] | None = None,
) -> int:
    """Make a node, spin it until SIGINT or SIGTERM, close it. Returns the exit status.

    A single-threaded executor: it is the fastest and most even one that rclpy has. A node with a
    `close()` method gets it called in any case, to give back its device or file. Errors of the
    types in `expected_errors` (and ParameterError, OSError) end the process with one line on
    standard error and status 1; any other error is a fault of ours and shows its traceback.
    """
    rclpy.init(args=arguments)
    node = None
    try:
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (ParameterError, OSError, *expected_errors) as error:
        print(f"error: {error}", file=sys.stderr, flush=True)
        return 1
    finally:
        if node is not None:
            with contextlib.suppress(KeyboardInterrupt):
                getattr(node, "close", lambda: None)()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
