# SPDX-License-Identifier: Apache-2.0
"""Which trials run on this machine, told by a file of each in the user's own folders.

A trial takes a ROS domain of its own, which nobody else could know. While it runs, a file says in
which domain, so that a command from another terminal finds the trial's graph. It is written whole
or not at all and removed at the trial's end; the file of a trial that was killed is known by its
process, which is not there any more, and is passed over and cleared away. A trial whose process was
killed but not its nodes, as under a launch file, still counts: its crank may turn, and the verbs
must reach it.

It is written in every place there is: another terminal may have another environment, and systemd
removes a user's runtime folder at the last logout, while a trial under nohup goes on.

What stands in these files decides whose motor is started or stopped, so a folder or file counts
only if it is the user's own, no link, and nobody else may write in it. No ROS in here, and nothing
that takes long to import: an emergency stop waits for it.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from towtank_node.quick_stop import listens

from towtank_bringup.ros_domain import HIGHEST_DOMAIN

_NAME = re.compile(r"trial-\d+-\d+\.json")
_LARGEST = 65_536  # bytes; a path is the longest that is in it


class RunFileError(RuntimeError):
    """There is no trial to be found, or no place to tell of one; one line: cause and remedy."""


@dataclass(frozen=True)
class RunningTrial:
    """A trial that runs on this machine.

    directory: where it records, absolute. domain: its ROS domain. pid, process_start: of the
    process that leads it; its start in clock ticks since boot, by which a process that was given
    the same number later is told from it. boot: the machine's boot. started: ISO 8601, UTC.
    """

    directory: Path
    domain: int
    pid: int
    process_start: int
    boot: str
    uid: int
    started: str
    on_virtual_tank: bool

    @classmethod
    def of_this_process(cls, directory: Path, domain: int, on_virtual_tank: bool) -> RunningTrial:
        """The trial that this process leads."""
        start = _process_start(os.getpid())
        assert start is not None, "this process runs"
        now = datetime.now(UTC).isoformat(timespec="seconds")
        return cls(
            directory.absolute(),
            domain,
            os.getpid(),
            start,
            _boot(),
            os.geteuid(),
            now,
            on_virtual_tank,
        )

    @property
    def file_name(self) -> str:
        """Another process never has the same one, so that clearing a dead one's hits no other."""
        return f"trial-{self.pid}-{self.process_start}.json"

    def text(self) -> str:
        """The run file's contents."""
        return json.dumps({**asdict(self), "directory": os.fspath(self.directory)}) + "\n"

    @classmethod
    def from_text(cls, text: str | bytes) -> RunningTrial:
        """Read a run file's contents; ValueError if they are none."""
        found = json.loads(text)
        if not isinstance(found, dict):
            raise ValueError("no run file")
        kinds = {
            "directory": str,
            "domain": int,
            "pid": int,
            "process_start": int,
            "boot": str,
            "uid": int,
            "started": str,
            "on_virtual_tank": bool,
        }
        for name, kind in kinds.items():
            if type(found.get(name)) is not kind:
                raise ValueError(f"no run file: {name}")
        directory = Path(found["directory"])
        if not directory.is_absolute() or not 0 <= found["domain"] <= HIGHEST_DOMAIN:
            raise ValueError("no run file")
        return cls(**{**{name: found[name] for name in kinds}, "directory": directory})

    def lives(self) -> bool:
        """Whether the process that leads it is still there, be it hung or halted."""
        return self.boot == _boot() and _process_start(self.pid) == self.process_start

    def is_orphaned(self) -> bool:
        """Whether that process is gone, but a node that drives a crank listens in its domain."""
        return self.boot == _boot() and not self.lives() and listens(self.domain)

    def __str__(self) -> str:
        tank = "virtual tank" if self.on_virtual_tank else "real board"
        return f"{self.directory} ({tank}, ROS domain {self.domain}, since {self.started})"


@contextlib.contextmanager
def announced(directory: Path, domain: int, on_virtual_tank: bool) -> Iterator[RunningTrial]:
    """Around a trial that this process leads: its run file is there meanwhile.

    Raises RunFileError if there is no folder for it.
    """
    trial = RunningTrial.of_this_process(directory, domain, on_virtual_tank)
    with contextlib.ExitStack() as files:
        _write(trial, files)
        yield trial


def running_trials() -> list[RunningTrial]:
    """The user's trials that run on this machine, the oldest first; files of dead ones go."""
    found = {}
    for place in _places():
        with contextlib.suppress(OSError, RunFileError), _opened(place) as folder:
            found.update({trial.file_name: trial for trial in _read(folder)})
    # Of those in one domain, whose nodes are of one of them, the one that is led counts
    led = {trial.domain for trial in found.values() if trial.lives()}
    left = [trial for trial in found.values() if trial.lives() or trial.domain not in led]
    return sorted(left, key=lambda trial: trial.started)


def choose_trial(
    trials: Sequence[RunningTrial], directory: Path | None = None, domain: int | None = None
) -> RunningTrial:
    """The one that is meant: by its directory or its domain if given, else the only one.

    Raises RunFileError that lists them where that leaves none, or more than one.
    """
    left = list(trials)
    wanted = "no trial of yours runs on this machine: start one with `towtank trial`"
    if directory is not None:
        meant = os.path.realpath(directory)  # unlike Path.resolve, it raises for no loop of links
        left = [trial for trial in left if os.path.realpath(trial.directory) == meant]
        wanted = f"no trial runs in {directory}"
    elif domain is not None:
        left = [trial for trial in left if trial.domain == domain]
        wanted = f"no trial runs in ROS domain {domain}"
    if len(left) == 1:
        return left[0]
    if left:
        raise RunFileError(f"{len(left)} trials run: say which with --trial DIR: {listed(left)}")
    raise RunFileError(wanted + (f"; these do: {listed(trials)}" if trials else ""))


def listed(trials: Sequence[RunningTrial]) -> str:
    """Some trials in one line."""
    return "; ".join(map(str, trials))


# ------------------------------------------------------------------------------------ the folder
def _places() -> list[Path]:
    """Where run files are written and looked for: what every terminal of the user has, and what
    its environment names."""
    places = []
    for folder in (f"/run/user/{os.geteuid()}", os.environ.get("XDG_RUNTIME_DIR", "")):
        # The freedesktop.org base directory specification: absolute, and the user's own
        if os.path.isabs(folder) and _is_own(folder):
            places.append(Path(folder) / "towtank")
    for folder in ("/tmp", os.environ.get("TMPDIR", "")):
        if os.path.isabs(folder):
            places.append(Path(folder) / f"towtank-{os.geteuid()}")
    return list(dict.fromkeys(places))


def _is_own(folder: str) -> bool:
    try:
        return os.stat(folder).st_uid == os.geteuid()
    except OSError:
        return False


@contextlib.contextmanager
def _opened(place: Path) -> Iterator[int]:
    """The folder's descriptor, for what is done in it: no other can then be put in its place."""
    folder = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        status = os.fstat(folder)
        if status.st_uid != os.geteuid():
            raise RunFileError(f"{place} belongs to another user")
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            raise RunFileError(f"{place} can be written by others")
        yield folder
    finally:
        os.close(folder)


def _write(trial: RunningTrial, files: contextlib.ExitStack) -> None:
    """Write the run file in all places that take it, to be removed when `files` is closed."""
    written, refused = 0, []
    for place in _places():
        try:
            with contextlib.suppress(FileExistsError):
                place.mkdir(mode=0o700)
            with _opened(place) as folder:
                _write_atomically(folder, trial)
                files.callback(_remove, os.dup(folder), trial.file_name)
                written += 1
        except OSError as error:
            refused.append(f"{place}: {error.strerror}")
        except RunFileError as error:
            refused.append(str(error))
    if written:
        return
    raise RunFileError(
        "no folder to tell in of this trial, without which `towtank crank emergency-stop` could "
        f"not reach it ({'; '.join(refused)}): set XDG_RUNTIME_DIR to a folder of your own"
    )


def _remove(folder: int, name: str) -> None:
    with contextlib.suppress(OSError):
        os.unlink(name, dir_fd=folder)
    os.close(folder)


def _write_atomically(folder: int, trial: RunningTrial) -> None:
    unfinished = f".{trial.file_name}"
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
        with open(os.open(unfinished, flags, 0o600, dir_fd=folder), "w") as file:
            file.write(trial.text())
        os.rename(unfinished, trial.file_name, src_dir_fd=folder, dst_dir_fd=folder)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(unfinished, dir_fd=folder)
        raise


def _read(folder: int) -> Iterator[RunningTrial]:
    """The trials of a folder's files that live, be it their nodes; those of dead ones go."""
    for name in os.listdir(folder):
        if not _NAME.fullmatch(name):
            continue
        with contextlib.suppress(OSError, ValueError):
            trial = RunningTrial.from_text(_contents(folder, name))
            if trial.file_name != name or trial.uid != os.geteuid():
                continue
            if trial.lives() or trial.is_orphaned():
                yield trial
            else:
                os.unlink(name, dir_fd=folder)


def _contents(folder: int, name: str) -> bytes:
    """What is in a file of the user's own; ValueError if it is another's, or no file."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with open(os.open(name, flags, dir_fd=folder), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid():
            raise ValueError(f"{name} is not this user's")
        return file.read(_LARGEST)


# ------------------------------------------------------------------------------------ the process
def _process_start(pid: int) -> int | None:
    """When a process was started, in clock ticks since boot; None if it is not there (proc(5))."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(errors="replace")
    except OSError:
        return None
    state, *numbers = text.rpartition(")")[2].split()  # its name may hold blanks and brackets
    return None if state in "ZX" else int(numbers[18])


def _boot() -> str:
    """The machine's boot: clock ticks and process numbers are of one of them."""
    return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
