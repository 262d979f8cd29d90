# SPDX-License-Identifier: Apache-2.0
"""Settings of all tests: the installed simulation core, one hypothesis profile, signals; what need
not be read for a marker."""

import signal
from pathlib import Path

import pytest

# Imported before pytest puts the repository's root on the path, where the folder sim_core would
# stand in for the installed package.
from hypothesis import settings

import sim_core  # noqa: F401

# A loaded machine may be slow: time limits an example in no test.
settings.register_profile("towtank", deadline=None)
settings.load_profile("towtank")

# Under nohup, or behind a shell's &, hang-up and interrupt are ignored, and all would inherit that
# which the tests start and signal. A handler that does nothing is as deaf, and nobody inherits it.
for _number in (signal.SIGHUP, signal.SIGINT):
    if signal.getsignal(_number) == signal.SIG_IGN:
        signal.signal(_number, lambda *_: None)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """With `-m MARKER` alone, leave out the files that never name it: to import all tests takes
    half a minute of processor time, for each worker."""
    marker = config.getoption("markexpr")
    if not marker.isidentifier() or collection_path.suffix != ".py":
        return None
    return f"mark.{marker}" not in collection_path.read_text(encoding="utf-8") or None
