# SPDX-License-Identifier: Apache-2.0
"""The bench's end of the socket to the virtual board."""

from __future__ import annotations

import socket
from types import TracebackType

# The board reads all the time; if it takes nothing for so long it has stopped. Shorter than the
# plant's lead would cry wolf on a busy machine.
_SEND_TIMEOUT = 1.0  # s


class BenchSocketError(ConnectionError):
    """The virtual board cannot be reached, or is gone; the message names the socket."""


class BenchSocket:
    """Connection to the virtual board's SOCK_SEQPACKET socket at `path`; one packet a frame."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(_SEND_TIMEOUT)
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise BenchSocketError(
                f"bench socket {path}: {error.strerror or error}: start the virtual board with "
                "--bench-socket and give the bench the same path"
            ) from error

    def send(self, frame: bytes) -> None:
        """Send one frame. Raises BenchSocketError if the board is gone or takes no more."""
        try:
            self._socket.send(frame)
        except TimeoutError as error:
            raise BenchSocketError(
                f"bench socket {self._path}: the virtual board has taken no frame for "
                f"{_SEND_TIMEOUT:g} s: see its output, restart it"
            ) from error
        except OSError as error:
            raise BenchSocketError(
                f"bench socket {self._path}: the virtual board is gone ({error.strerror}): "
                "see its output, restart it"
            ) from error

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> BenchSocket:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
