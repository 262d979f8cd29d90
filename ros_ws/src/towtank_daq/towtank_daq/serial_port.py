# SPDX-License-Identifier: Apache-2.0
"""A serial port as the driver's transport."""

from __future__ import annotations

import errno
import os
import select
import time

import serial

_CHUNK = 4096
_REOPEN_PERIOD_S = 0.2


class SerialPortError(OSError):
    """The port cannot be opened or has gone; one line with cause and mend."""


class SerialPort:
    """An open serial port: 8 data bits, no parity, one stop bit, for this program alone.

    Reading blocks in the kernel until bytes come: nothing polls, nothing waits longer than needed.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._path = path
        self._baud = baud
        self._open()

    def _open(self) -> None:
        try:
            self._port = serial.Serial(
                self._path, self._baud, timeout=0, write_timeout=1.0, exclusive=True
            )
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise SerialPortError(_cause(self._path, error)) from error
        self._file = self._port.fileno()

    def reopen(self, timeout_s: float) -> None:
        """Open the port anew, trying so long; SerialPortError when it cannot be had."""
        self._port.close()
        end = time.monotonic() + timeout_s
        while True:
            try:
                return self._open()
            except SerialPortError:
                left = end - time.monotonic()
                if left <= 0.0:
                    raise
                time.sleep(min(_REOPEN_PERIOD_S, left))

    def read(self, timeout_s: float) -> bytes:
        """All bytes that are there, as soon as there is one; none after `timeout_s`."""
        try:
            if not select.select([self._file], [], [], timeout_s)[0]:
                return b""
            data = os.read(self._file, _CHUNK)
        except BlockingIOError:  # select() may wake for nothing
            return b""
        except (OSError, ValueError) as error:
            raise self._gone() from error
        if not data:  # readable, but at its end: the other side is gone
            raise self._gone()
        return data

    def write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except serial.SerialTimeoutException as error:
            raise SerialPortError(
                f"port {self._path} takes no bytes: check the cable and the board"
            ) from error
        except (OSError, ValueError) as error:
            raise self._gone() from error

    def close(self) -> None:
        self._port.close()

    def _gone(self) -> SerialPortError:
        return SerialPortError(f"port {self._path} is gone: plug the board in and configure again")


def _cause(path: str, error: OSError | ValueError) -> str:
    # pyserial keeps the system's error number, except when the file takes no line settings
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return f"port {path} does not exist: plug the board in, or give another port"
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission for port {path}: add yourself to the group that owns it (dialout)"
    if number in (errno.EBUSY, errno.EAGAIN):
        return f"port {path} is in use by another program: stop that first"
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR) or "configure port" in str(error):
        return f"{path} is no serial port: give the board's port"
    return f"port {path} cannot be opened: {error}"
