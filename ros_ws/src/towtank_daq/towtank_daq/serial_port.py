# SPDX-License-Identifier: Apache-2.0
"""A serial port as the driver's transport.

Two locks keep others out: TIOCEXCL, by which the kernel refuses every further open() but root's,
and an advisory one, which a second of these drivers heeds also where it is root's. Against root's
programs (ModemManager is one) only looking helps: the settings are compared with those made.

HUPCL is off while the port is open, and stays off: DTR stays up when this program ends, however it
ends, and the next one that opens the port does not reset the board by it. Where a reset is wanted,
DTR goes down and up on purpose.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import struct
import termios
import time
from pathlib import Path

import serial

from towtank_daq.port_users import port_users

_CHUNK = 4096
_REOPEN_PERIOD_S = 0.2
_DTR_LOW_S = 0.1  # far longer than the 1 ms of the capacitor at an Arduino's reset
# struct termios2 of <asm-generic/termbits.h>: 4 flags, line discipline, 19 characters, 2 speeds
_SETTINGS = struct.Struct("=4IB19s2I")
_TCGETS2 = 0x802C542A
_TCSETS2 = 0x402C542B
_TIOCGEXCL = 0x80045440
_CONTROL_FLAGS, _OUTPUT_SPEED = 2, 7  # places in it


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
            self._file = self._port.fileno()
            fcntl.ioctl(self._file, termios.TIOCEXCL)
            self._hang_up_on_close(False)
            self._settings = self._read_settings()
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise SerialPortError(_cause(self._path, error)) from error
        self._looked_around = False

    def reopen(self, timeout_s: float, reset: bool) -> None:
        """Open the port anew, trying so long; SerialPortError when it cannot be had.

        reset: lower DTR before, which stays down while the port is closed, and goes up with it.
        """
        if reset:
            self._lower_dtr()
        self.close()
        if reset:
            time.sleep(_DTR_LOW_S)
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
        """Give the port back, and leave DTR as it is."""
        if self._port.is_open:
            with contextlib.suppress(OSError):  # it is gone
                fcntl.ioctl(self._file, termios.TIOCNXCL)
        self._file = -1  # first: the number may be another file's as soon as the port is closed
        self._port.close()

    def look_after(self) -> str:
        """Make the port's settings anew if another program has changed them: what it was, or ''.

        Also tells once of a program that had the port open before; no lock throws that out.
        """
        try:
            found = self._read_settings()
            if found == self._settings:
                return self._look_around()
            fcntl.ioctl(self._file, _TCSETS2, self._settings)
            fcntl.ioctl(self._file, termios.TIOCEXCL)
        except (OSError, ValueError) as error:
            raise self._gone() from error
        speed, wanted = (_SETTINGS.unpack(s)[_OUTPUT_SPEED] for s in (found, self._settings))
        how = f"{speed} baud" if speed != wanted else "its line discipline"
        who = self.suspects()
        return (
            f"another program has changed the settings of port {self._path} ({how}); they are as "
            "they should be again: "
            + (f"stop {who}" if who else "mask ModemManager, and close whatever monitors the port")
        )

    def _look_around(self) -> str:
        if self._looked_around:
            return ""
        self._looked_around = True
        who = self.suspects()
        return who and f"{who} has port {self._path} open as well, and may take bytes: stop it"

    def suspects(self) -> str:
        """Other processes that have the port open, as far as this user may see them."""
        return " and ".join(port_users(Path(self._path)))

    @property
    def is_exclusive(self) -> bool:
        """Whether the kernel refuses the port to all but root."""
        return fcntl.ioctl(self._file, _TIOCGEXCL, bytes(4)) != bytes(4)

    def _read_settings(self) -> bytes:
        return fcntl.ioctl(self._file, _TCGETS2, bytes(_SETTINGS.size))

    def _hang_up_on_close(self, on: bool) -> None:
        settings = list(_SETTINGS.unpack(self._read_settings()))
        settings[_CONTROL_FLAGS] &= ~termios.HUPCL
        settings[_CONTROL_FLAGS] |= on * termios.HUPCL
        fcntl.ioctl(self._file, _TCSETS2, _SETTINGS.pack(*settings))

    def _lower_dtr(self) -> None:
        with contextlib.suppress(OSError, ValueError):  # it is gone, or has no DTR
            self._hang_up_on_close(True)
            self._port.dtr = False

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
        users = " and ".join(port_users(Path(path))) or "another program"
        return f"port {path} is in use by {users}: stop that first"
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR) or "configure port" in str(error):
        return f"{path} is no serial port: give the board's port"
    return f"port {path} cannot be opened: {error}"
