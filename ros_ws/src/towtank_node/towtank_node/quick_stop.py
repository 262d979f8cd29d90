# SPDX-License-Identifier: Apache-2.0
"""An emergency stop past ROS 2: its discovery takes a new node up to three seconds to be heard.

Whoever drives a crank listens on a Unix socket whose name, in Linux's abstract namespace, follows
from user and ROS domain: there is no file to be found, left over or replaced, and the name is free
when the process ends, however it does. The kernel tells each side who the other is, and only the
user's own processes, and root's, are heard and believed. No ROS in here, and little to import.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import threading
from collections.abc import Callable
from pathlib import Path

ANSWER_S = 2.5
"""A stop is answered by then, be it that it failed."""
_LARGEST = 4096  # bytes of an answer


class QuickStop:
    """Calls `stop` when an emergency stop is asked for in a ROS domain, until it is closed.

    stop: called from a thread of its own; returns why it has not stopped, or ''. Raises OSError if
    another process of the user listens for that domain already.
    """

    def __init__(self, domain: int, stop: Callable[[], str]) -> None:
        self._stop = stop
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._listener.bind(_name(os.geteuid(), domain))
            self._listener.listen(4)
        except OSError:
            self._listener.close()
            raise
        self._thread = threading.Thread(target=self._serve, name="quick_stop", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Listen no more."""
        with contextlib.suppress(OSError):  # closed before
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes the thread
        self._thread.join(ANSWER_S)  # the name is free once it waits no more
        self._listener.close()

    def _serve(self) -> None:
        while True:
            try:
                caller, _ = self._listener.accept()
            except OSError:
                return  # closed
            with caller:
                if _peer(caller) in (os.geteuid(), 0):
                    answer = self._stop().encode()[:_LARGEST] or b"\0"
                    with contextlib.suppress(OSError):  # the caller has gone: stopped all the same
                        caller.send(answer, socket.MSG_NOSIGNAL)


def quick_stop(domain: int) -> str | None:
    """Ask for an emergency stop in a domain.

    Returns why it was not done, '' if it was, None if nobody of this user's listens there.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as call:
        call.settimeout(ANSWER_S)
        try:
            call.connect(_name(os.geteuid(), domain))
            if _peer(call) != os.geteuid():
                return None
            answer = call.recv(_LARGEST)
        except OSError:
            return None
    return answer.decode(errors="replace").strip("\0") if answer else None


def listens(domain: int) -> bool:
    """Whether a node of this user's listens in a domain. It is not asked, as it would stop."""
    name = _name(os.geteuid(), domain).replace("\0", "@")
    try:
        sockets = Path("/proc/net/unix").read_text(errors="replace")  # proc(5)
    except OSError:
        return False
    return any(line.endswith(f" {name}") for line in sockets.splitlines())


def _name(uid: int, domain: int) -> str:
    return f"\0towtank/{uid}/{domain}/emergency_stop"


def _peer(connection: socket.socket) -> int:
    """The user that a connected process runs as."""
    credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
    return struct.unpack("3i", credentials)[1]
