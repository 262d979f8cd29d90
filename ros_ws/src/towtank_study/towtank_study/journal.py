# SPDX-License-Identifier: Apache-2.0
"""The journal of a running study: findings on the disk as soon as they are there.

JSON lines. The first one says which study it is; each further one is a finding. A line that a kill
cut short is dropped when the journal is opened again, and its sample evaluated again.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Generic

from towtank_study.errors import StudyError
from towtank_study.planned import Found


class Journal(Generic[Found]):
    """An open journal, held by one process at a time. findings: by sample, all so far."""

    def __init__(self, path: Path, fingerprint: str, finding: type[Found]) -> None:
        """Open a journal of findings of that type, or begin it.

        StudyError if it is another study's or in use.
        """
        self.findings: dict[int, Found] = {}
        self._finding = finding
        self._file = path.open("a+b")
        try:
            self._lock(path)
            self._read(path, fingerprint)
        except BaseException:
            self._file.close()
            raise

    def append(self, findings: Iterable[Found]) -> None:
        """Write findings; when this returns they are on the disk."""
        for finding in findings:
            self.findings[finding.sample] = finding
            self._write(finding.entry())
        self._flush()

    def __enter__(self) -> Journal[Found]:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()

    def _lock(self, path: Path) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise StudyError(
                f"{path.parent}: another process is at this study; wait for it"
            ) from None

    def _read(self, path: Path, fingerprint: str) -> None:
        self._file.seek(0)
        text = self._file.read()
        whole = text[: text.rfind(b"\n") + 1]
        self._file.truncate(len(whole))
        header, *lines = whole.splitlines() or [b""]
        if not header:
            self._write({"fingerprint": fingerprint})
            self._flush()
            return
        if json.loads(header)["fingerprint"] != fingerprint:
            raise StudyError(
                f"{path.parent} holds another study, rig or version of towtank; give a new "
                f"directory with --out"
            )
        for line in lines:
            finding = self._finding.of_entry(json.loads(line))
            self.findings[finding.sample] = finding

    def _write(self, entry: dict[str, object]) -> None:
        # Python's shortest form of a float gives the same float back.
        self._file.write(json.dumps(entry, allow_nan=False).encode() + b"\n")

    def _flush(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())
