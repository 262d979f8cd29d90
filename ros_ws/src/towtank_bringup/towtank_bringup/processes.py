# SPDX-License-Identifier: Apache-2.0
"""Starting, watching and stopping the processes of a graph."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from towtank_bringup.environment import NO_LOG_FILES
from towtank_bringup.graph import Graph, Item, NodeGroup, Program, RosNode

STOP_TIMEOUT_S = 10.0
_PR_SET_PDEATHSIG = 1


class ProcessError(RuntimeError):
    """A process of the graph could not start, or ended before its time."""


def command_of(item: Item) -> list[str]:
    """The command line that starts an item of the graph."""
    if isinstance(item, Program):
        return list(item.command)
    try:
        prefix = Path(get_package_prefix(item.package))
    except PackageNotFoundError as error:
        raise ProcessError(
            f"package {item.package} is not in the environment: build the workspace and source it"
        ) from error
    # By the interpreter: a script's first line cannot name one whose path has a blank.
    executable = str(prefix / "lib" / item.package / item.executable)
    command = [sys.executable, executable, *NO_LOG_FILES]
    if isinstance(item, RosNode):
        command += ["-r", f"__ns:={item.namespace}", "-r", f"__node:={item.name}"]
    for name, value in item.parameters.items():
        command += ["-p", f"{name}:={_yaml(value)}"]
    return command


def _yaml(value: Any) -> str:
    """A parameter's value in the YAML that rcl reads: JSON, but for text.

    JSON writes a character beyond the first 65536 as a pair, which is no YAML.
    """
    if not isinstance(value, str):
        return json.dumps(value)
    return '"' + "".join(map(_yaml_character, value)) + '"'


def _yaml_character(character: str) -> str:
    if character.isascii() and character.isprintable() and character not in '"\\':
        return character
    return f"\\U{ord(character):08X}"


def _die_with_parent() -> None:
    """In the child, before it becomes the program: no orphans, even if the parent is killed."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


@dataclass
class Process:
    """A running item of the graph, with its output in a log file."""

    item: Item
    popen: subprocess.Popen[bytes]
    log: Path
    restarts_left: int

    def last_words(self) -> str:
        """The line of its log that tells most: the last error, or the last line."""
        try:
            text = self.log.read_text(errors="replace")
        except OSError as error:  # the disk's fault, or the directory is gone
            return f"its log cannot be read: {error.strerror}"
        lines = [line for line in text.splitlines() if line.strip()]
        errors = [line for line in lines if "error" in line.lower()]
        return (errors or lines or ["it said nothing"])[-1].strip().removeprefix("error: ")


class ProcessGroup:
    """The processes of a graph. Children get their own session: Ctrl-C reaches only us, and we
    stop them in order."""

    def __init__(self, logs: Path) -> None:
        self._logs = logs
        self._processes: list[Process] = []
        logs.mkdir(parents=True, exist_ok=True)

    def start(self, graph: Graph, watch: Callable[[], None]) -> None:
        """Start every item, in order; a Program is waited for until it says that it is ready.

        watch: called between the items and a few times a second while waiting.
        """
        for item in graph:
            log = self._logs / (item.full_name.strip("/").replace("/", ".") + ".log")
            restarts = item.restarts if isinstance(item, NodeGroup) else 0
            process = Process(item, self._spawn(item, log), log, restarts)
            self._processes.append(process)
            watch()
            if isinstance(item, Program):
                self._wait_for_line(process, item.ready_line, watch)

    def _spawn(self, item: Item, log: Path) -> subprocess.Popen[bytes]:
        command = command_of(item)
        with log.open("ab") as output:
            try:
                return subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    preexec_fn=_die_with_parent,
                    env={**os.environ, "PYTHONUNBUFFERED": "1"},
                )
            except OSError as error:
                raise ProcessError(
                    f"{item.full_name} cannot start: {command[0]}: {error.strerror}: "
                    "build the project first"
                ) from error

    def _wait_for_line(
        self, process: Process, beginning: str, watch: Callable[[], None], timeout_s: float = 30.0
    ) -> None:
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            if any(
                line.startswith(beginning)
                for line in process.log.read_text(errors="replace").splitlines()
            ):
                return
            watch()
            time.sleep(0.02)
        raise ProcessError(f"{process.item.full_name} is not up after {timeout_s:.0f} s")

    def pids(self) -> dict[str, int]:
        """Process identifiers by name."""
        return {process.item.full_name: process.popen.pid for process in self._processes}

    def check(self, may_restart: bool = False) -> None:
        """Raise ProcessError if any process has ended.

        may_restart: one that has restarts left is started again instead.
        """
        for process in self._processes:
            status = process.popen.poll()
            if status is None:
                continue
            if not (may_restart and process.restarts_left):
                raise ProcessError(
                    f"{process.item.full_name} ended with status {status}: {process.last_words()}"
                )
            process.restarts_left -= 1
            process.popen = self._spawn(process.item, process.log)

    def stop(self) -> list[str]:
        """Stop all, the last started first. Returns the names of those that had to be killed."""
        killed = []
        for process in reversed(self._processes):
            if process.popen.poll() is None:
                process.popen.send_signal(signal.SIGINT)
                try:
                    process.popen.wait(STOP_TIMEOUT_S)
                except subprocess.TimeoutExpired:
                    process.popen.kill()
                    process.popen.wait()
                    killed.append(process.item.full_name)
        self._processes.clear()
        return killed
