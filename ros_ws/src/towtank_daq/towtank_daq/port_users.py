# SPDX-License-Identifier: Apache-2.0
"""Which other processes have a serial port open, as far as /proc tells this user.

What others' processes have open is for root only to see: to anybody else, nobody is found there.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

_PTY_MAJORS = range(136, 144)  # of pseudo terminals, 256 minors each (devices.txt of Linux)
_PTYS_OF_A_MAJOR = 256


def port_users(port: Path) -> list[str]:
    """Names and ids of other processes that have the port open, such as 'screen (pid 812)'.

    Who serves the other end of a pseudo terminal is none of them. No error: empty if nothing is
    known.
    """
    try:
        device = os.stat(port).st_rdev
    except OSError:
        return []
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and int(process.name) != os.getpid():
            with contextlib.suppress(OSError):  # it has ended, or is somebody else's
                if _has_open(process, device):
                    name = (process / "comm").read_text(errors="replace").strip()
                    found.append(f"{name} (pid {process.name})")
    return found


def _has_open(process: Path, device: int) -> bool:
    has_port = False
    for file, target in _open_devices(process):
        if target.endswith("ptmx"):
            if _serves(process, file, device):
                return False
        elif not has_port:
            with contextlib.suppress(OSError):
                status = (process / "fd" / file).stat()
                has_port = stat.S_ISCHR(status.st_mode) and status.st_rdev == device
    return has_port


def _open_devices(process: Path) -> Iterator[tuple[str, str]]:
    for file in os.listdir(process / "fd"):
        with contextlib.suppress(OSError):
            target = os.readlink(process / "fd" / file)
            if target.startswith("/dev/"):
                yield file, target


def _serves(process: Path, file: str, device: int) -> bool:
    """Whether a file is the controlling end of that pseudo terminal."""
    major = os.major(device)
    if major not in _PTY_MAJORS:
        return False
    number = (major - _PTY_MAJORS.start) * _PTYS_OF_A_MAJOR + os.minor(device)
    for line in (process / "fdinfo" / file).read_text().splitlines():
        if line.startswith("tty-index:"):
            return int(line.split()[1]) == number
    return False
