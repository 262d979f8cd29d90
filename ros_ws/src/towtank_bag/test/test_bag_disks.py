# SPDX-License-Identifier: Apache-2.0
"""Disks that lose their power, fail or stall, and directories that are moved under a recording."""

import errno
import fcntl
import os
import shutil
import struct
import subprocess
import time
from itertools import pairwise

import numpy as np
import pytest
from text_bag import RIG, TOPIC, text_message, wait_until
from towtank_bag import recorder, writer
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_bag.writer import BagWriter


def numbers_of(directory) -> np.ndarray:
    """The numbered messages that a bag holds, checked to begin at 0 and to have no gap."""
    numbers = open_bag(directory).raw("/text").log_time_ns
    np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
    return numbers


def record(bag: BagWriter, start: int, count: int, wait: bool = True) -> int:
    """Hand `count` messages over, wait until they are on the disk; returns the next number."""
    bag.write([text_message(start + i, os.urandom(20).hex().encode()) for i in range(count)])
    if wait:
        wait_until(lambda: bag.messages == start + count or bag.error)
    return start + count


@pytest.fixture
def fail(monkeypatch):
    """Makes the writer's calls to the kernel fail, by name, with an error number."""

    def fail(error_number: int, *names: str) -> None:
        for name in names:

            def failing(*_, **__):
                raise OSError(error_number, os.strerror(error_number))

            monkeypatch.setattr(writer.os, name, failing)

    return fail


def test_what_is_handed_over_is_on_the_disk_within_a_second(tmp_path, monkeypatch):
    """After a power cut only what was forced to the disk is there. At each forcing that holds all
    messages that were handed over before the one before it ended; with the recorder's period that
    is half a second, and half a second is left for the disk to take it."""
    assert writer.FLUSH_PERIOD_S + recorder.POLL_PERIOD_S <= 0.5
    handed_over, forced = 0, []  # forced: (handed over so far, length of the file) at each forcing
    file = tmp_path / "bag" / "bag_0.mcap"
    sync = os.fdatasync

    def noting_sync(descriptor: int) -> None:
        length = file.stat().st_size
        sync(descriptor)
        forced.append((handed_over, length))

    monkeypatch.setattr(writer.os, "fdatasync", noting_sync)
    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    while len(forced) < 5:
        bag.write([text_message(handed_over, os.urandom(20).hex().encode())])
        handed_over += 1
        time.sleep(0.001)
    whole = file.read_bytes()
    for (before, _), (_, length) in pairwise(forced):
        cut = tmp_path / f"cut{length}"
        cut.mkdir()
        (cut / "bag_0.mcap").write_bytes(whole[:length])
        assert len(numbers_of(cut)) >= before
        assert recorded_rig(open_bag(cut)).text == "name: any\n"
    bag.close()


def test_a_power_cut_leaves_what_the_writer_says_is_on_the_disk(tmp_path):
    """A real file system that is shut down without writing anything back."""
    image, mount = tmp_path / "disk", tmp_path / "stick"
    mount.mkdir()
    with image.open("wb") as file:
        file.truncate(32 << 20)
    made = shutil.which("mkfs.ext4", path=f"{os.environ['PATH']}:/sbin:/usr/sbin") or ""
    if not made or subprocess.run([made, "-qF", image], check=False).returncode:
        pytest.skip("no ext4 file system can be made")
    if subprocess.run(["mount", "-o", "loop", image, mount], check=False).returncode:
        pytest.skip("it takes a user who may mount")
    try:
        bag = BagWriter(mount / "trial" / "bag", [TOPIC], [RIG])
        count = record(bag, 0, 1000)
        count = record(bag, count, 1000)
        safe = bag.messages
        descriptor = os.open(mount, os.O_RDONLY)
        # EXT4_IOC_SHUTDOWN, without flushing the journal
        fcntl.ioctl(descriptor, 0x8004587D, struct.pack("I", 2))
        os.close(descriptor)
        record(bag, count, 1000)
        with pytest.raises(BagError, match=r"Input/output error; .* look at the disk"):
            bag.close()
    finally:
        subprocess.run(["umount", mount], check=True)
    subprocess.run(["mount", "-o", "loop", image, mount], check=True)  # and repair it
    try:
        assert len(numbers_of(mount / "trial" / "bag")) >= safe == 2000
        assert not open_bag(mount / "trial" / "bag").complete
    finally:
        subprocess.run(["umount", mount], check=True)


@pytest.mark.parametrize(
    "calls",
    [("write",), ("write", "ftruncate"), ("fdatasync",), ("fdatasync", "ftruncate", "close")],
)
def test_a_disk_that_fails_stops_the_writer_at_once(tmp_path, fail, calls):
    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    count = record(bag, 0, 100)
    fail(errno.EIO, *calls)
    record(bag, count, 100)  # ends, for the writer does not wait for its close
    told = str(bag.error)
    assert told.startswith(f"{tmp_path}/bag/bag_0.mcap: cannot write: Input/output error; ")
    assert "look at the disk" in told
    assert "\n" not in told
    with pytest.raises(BagError) as caught:
        bag.close()
    assert str(caught.value) == told
    assert len(numbers_of(tmp_path / "bag")) >= 100
    assert not open_bag(tmp_path / "bag").complete
    assert (tmp_path / "bag" / "RECORDING").exists()


@pytest.mark.parametrize("calls", [("fsync",), ("replace",), ("unlink",), ("close",)])
def test_a_disk_that_fails_at_the_end_leaves_the_bag_marked(tmp_path, fail, calls):
    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    record(bag, 0, 100)
    fail(errno.EIO, *calls)
    with pytest.raises(BagError, match="cannot write: Input/output error"):
        bag.close()
    assert len(numbers_of(tmp_path / "bag")) == 100


def test_a_fault_of_the_writer_itself_is_told_at_once(tmp_path, monkeypatch):
    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    monkeypatch.setattr("threading.excepthook", lambda arguments: None)
    monkeypatch.setattr(bag, "_add", lambda message: 1 / 0)
    record(bag, 0, 1)
    assert "ZeroDivisionError" in str(bag.error)
    with pytest.raises(BagError, match="stays marked incomplete: report it"):
        bag.close()


def test_a_disk_that_stalls_loses_nothing(tmp_path, monkeypatch):
    """It takes nothing until more has been handed over than a second of a whole trial's messages
    thirty times over."""
    written, handed_over = os.write, []

    def stalling_write(descriptor: int, data: bytes) -> int:
        wait_until(lambda: handed_over)
        return written(descriptor, data)

    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    monkeypatch.setattr(writer.os, "write", stalling_write)
    count = 0
    for _ in range(30):
        count = record(bag, count, 1400, wait=False)
    handed_over.append(True)
    bag.close()
    assert bag.overflowed == 0
    assert len(numbers_of(tmp_path / "bag")) == count


@pytest.mark.parametrize("moved", ["bag", "trial"])
def test_a_bag_that_is_renamed_is_closed_where_it_is(tmp_path, moved):
    """By itself, or with the trial's directory; something else may be put in its place."""
    bag = BagWriter(tmp_path / "trial" / "bag", [TOPIC], [RIG])
    count = record(bag, 0, 100)
    old, new = {
        "bag": (tmp_path / "trial" / "bag", tmp_path / "elsewhere"),
        "trial": (tmp_path / "trial", tmp_path / "renamed"),
    }[moved]
    old.rename(new)
    old.mkdir()
    count = record(bag, count, 100)
    bag.close()
    place = new if moved == "bag" else new / "bag"
    assert bag.directory == place
    assert len(numbers_of(place)) == 200
    assert open_bag(place).complete
    assert not list(old.iterdir())


@pytest.mark.parametrize("what", ["directory", "file"])
def test_a_bag_that_is_removed_ends_the_recording_at_once(tmp_path, what):
    bag = BagWriter(tmp_path / "bag", [TOPIC], [RIG])
    count = record(bag, 0, 100)
    if what == "directory":
        shutil.rmtree(tmp_path / "bag")
    else:
        (tmp_path / "bag" / "bag_0.mcap").unlink()
    record(bag, count, 100)
    told = str(bag.error)
    assert told.startswith(f"{tmp_path}/bag/bag_0.mcap: cannot write: somebody has removed it; ")
    assert "leave the directory alone" in told
    with pytest.raises(BagError):
        bag.close()


def test_names_of_new_parents_are_forced_to_the_disk_too(tmp_path, monkeypatch):
    forced = set()
    sync = os.fsync

    def noting_sync(descriptor: int) -> None:
        forced.add(os.readlink(f"/proc/self/fd/{descriptor}"))
        sync(descriptor)

    monkeypatch.setattr(writer.os, "fsync", noting_sync)
    BagWriter(tmp_path / "new" / "trial" / "bag", [TOPIC]).close()
    for folder in ("", "/new", "/new/trial", "/new/trial/bag"):
        assert f"{tmp_path}{folder}" in forced
