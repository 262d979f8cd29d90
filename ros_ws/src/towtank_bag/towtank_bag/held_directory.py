# SPDX-License-Identifier: Apache-2.0
"""A directory that is held open: it stays the same one when somebody renames it."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path


class HeldDirectory:
    """An existing directory, and files in it. Methods raise OSError as the disk does."""

    def __init__(self, path: Path) -> None:
        self._given = path
        self._descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)

    @property
    def path(self) -> Path:
        """Where it is now; where it was found once nobody can tell."""
        try:
            path = Path(os.readlink(f"/proc/self/fd/{self._descriptor}"))
            here = path.stat()
        except OSError:
            return self._given
        try:
            return self._given if os.path.samestat(here, self._given.stat()) else path
        except OSError:
            return path

    @property
    def removed(self) -> bool:
        """Whether somebody has removed it."""
        return os.fstat(self._descriptor).st_nlink == 0

    def has(self, name: str) -> bool:
        """Whether it has an entry of this name."""
        try:
            os.stat(name, dir_fd=self._descriptor)
        except FileNotFoundError:
            return False
        return True

    def open(self, name: str, flags: int) -> int:
        """A descriptor of a file in it."""
        return os.open(name, flags, 0o644, dir_fd=self._descriptor)

    def write(self, name: str, text: str) -> None:
        """Write a file, which is there whole or not at all, also after a power cut."""
        draft = f"{name}.tmp"
        with open(draft, "w", encoding="utf-8", opener=self.open) as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        self.rename(draft, name)

    def rename(self, old: str, new: str) -> None:
        """Rename a file for good."""
        os.replace(old, new, src_dir_fd=self._descriptor, dst_dir_fd=self._descriptor)
        self.sync()

    def remove(self, name: str) -> None:
        """Remove a file for good."""
        os.unlink(name, dir_fd=self._descriptor)
        self.sync()

    def sync_file(self, name: str) -> None:
        """Force what is in a file to the disk."""
        descriptor = self.open(name, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def sync(self) -> None:
        """Force its entries to the disk."""
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Let it go. `path` stays what it was at last."""
        self._given = self.path
        descriptor, self._descriptor = self._descriptor, -1
        with contextlib.suppress(OSError):
            os.close(descriptor)


def make_directory(path: Path) -> HeldDirectory:
    """Make a new directory with its parents, in a way that a power cut leaves them there."""
    present = next(parent for parent in path.absolute().parents if parent.is_dir())
    path.mkdir(parents=True)
    for parent in path.absolute().parents:
        _sync_directory(parent)
        if parent == present:
            break
    return HeldDirectory(path)


def _sync_directory(directory: Path) -> None:
    """Force a directory's entries to the disk, where it may be read and its file system can."""
    try:
        descriptor = os.open(directory, os.O_RDONLY)
    except PermissionError:
        return
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(descriptor)
