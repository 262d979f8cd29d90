# SPDX-License-Identifier: Apache-2.0
"""What a trial takes from the environment that it is started in, and what it makes itself.

The script `towtank` has set aside what steers Python, ROS 2 and the loader before Python starts; in
a native ROS 2 the environment is the user's. Here, for both: variables that cannot work are named
before anything starts, and the folders and the ROS domain that nobody has named are found.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from domain_coordinator import domain_id

from towtank_bringup.ros_domain import DomainError, domain_of_environment

DISCOVERY_RANGES = ("LOCALHOST", "SUBNET", "SYSTEM_DEFAULT")
"""OFF is left out: with it not even the nodes of one machine find each other."""

SOCKET_PATH_BYTES = 107
"""The longest path of a Unix socket on Linux."""

NO_LOG_FILES = ("--ros-args", "--disable-external-lib-logs")
"""For nodes whose output is kept as it is: rcl's own log files would need a home to go to."""

_RUNTIME_PREFIX = "towtank-"
_RUNTIME_ROOM = len(f"{_RUNTIME_PREFIX}abcdefgh/bench")


class EnvironmentProblem(RuntimeError):
    """The environment cannot be worked in. One line: the variable, its value and the mend."""


def check_ros_variables() -> int | None:
    """The domain that the environment names, or None.

    Raises EnvironmentProblem if a variable that nodes read has a value that they cannot use: rcl's
    own word on it comes from each node, or not at all.
    """
    discovery = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if discovery and discovery not in DISCOVERY_RANGES:
        raise EnvironmentProblem(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{discovery}': give one of "
            f"{', '.join(DISCOVERY_RANGES)}, or unset it"
        )
    try:
        return domain_of_environment()
    except DomainError as error:
        raise EnvironmentProblem(str(error)) from error


@contextlib.contextmanager
def ros_domain() -> Iterator[int]:
    """Two trials on one machine must not hear each other: take a ROS domain that is free.

    One that the environment names is kept. Yields the domain. Raises EnvironmentProblem for a
    variable that cannot work, and if no domain is free.
    """
    if (chosen := check_ros_variables()) is not None:
        yield chosen
        return
    reservation = domain_id()
    try:
        domain = reservation.__enter__()
    except RuntimeError as error:
        raise EnvironmentProblem(
            "no ROS domain is free: end a trial, or set ROS_DOMAIN_ID"
        ) from error
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    try:
        yield domain
    finally:
        del os.environ["ROS_DOMAIN_ID"]
        # Not told of errors: it would take an OSError of the trial for a domain that is in use.
        reservation.__exit__(None, None, None)


def make_runtime_folder() -> Path:
    """A new folder for sockets and links, which the caller removes. Its path is short and plain.

    Raises EnvironmentProblem if there is no place for it.
    """
    return Path(tempfile.mkdtemp(prefix=_RUNTIME_PREFIX, dir=short_temporary_folder(_RUNTIME_ROOM)))


@contextlib.contextmanager
def runtime_folder() -> Iterator[Path]:
    """As make_runtime_folder(), removed at the end."""
    folder = make_runtime_folder()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def short_temporary_folder(room: int) -> Path:
    """A folder for temporary files below which a socket's path may have `room` bytes more.

    The one that TMPDIR names if it will do. Raises EnvironmentProblem if none does.
    """
    for folder in _temporary_folders():
        short = len(os.fsencode(folder)) + 1 + room <= SOCKET_PATH_BYTES
        if short and is_text(folder) and os.access(folder, os.W_OK | os.X_OK):
            return Path(folder)
    raise EnvironmentProblem(
        f"TMPDIR is {os.environ.get('TMPDIR', 'not set')!r}: set it to a folder that can be "
        f"written, with a path of at most {SOCKET_PATH_BYTES - 1 - room} bytes, for sockets"
    )


def is_text(path: str | Path) -> bool:
    """Whether a ROS parameter can carry the path: its bytes are UTF-8 without control characters.

    Python has other bytes as surrogates, which it does not count as printable.
    """
    return str(path).isprintable()


def as_text(path: Path, runtime: Path, name: str) -> Path:
    """The path if it is text, else a link to it of that name in the runtime folder.

    What it leads to need not exist yet.
    """
    if is_text(path):
        return path
    link = runtime / name
    if not link.is_symlink():
        link.symlink_to(path)
    return link


def _temporary_folders() -> Iterator[str]:
    with contextlib.suppress(FileNotFoundError):  # there is none to write to
        yield tempfile.gettempdir()
    yield from ("/tmp", "/var/tmp")
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        yield runtime
    yield "/dev/shm"
