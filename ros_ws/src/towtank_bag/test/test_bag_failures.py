# SPDX-License-Identifier: Apache-2.0
"""Bags whose recording did not end well, and directories that are no bags."""

import os
import signal
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from text_bag import RIG, TOPIC, text_message, wait_until
from towtank_bag.definitions import DefinitionError, message_definition
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_bag.writer import BagWriter

# Records numbered messages at 1 kHz and says after each how many were handed over and how many
# the writer has flushed.
_WRITE_FOR_EVER = """
import os, sys, time
sys.path.insert(0, {test_folder!r})
from text_bag import RIG, TOPIC, text_message
from towtank_bag.writer import BagWriter
writer = BagWriter(sys.argv[1], [TOPIC], [RIG])
number = 0
while True:
    writer.write([text_message(number, os.urandom(10).hex().encode())])
    number += 1
    print(number, writer.messages, flush=True)
    time.sleep(0.001)
"""


def test_a_killed_writer_leaves_all_that_it_had_flushed(tmp_path):
    directory = tmp_path / "killed"
    program = _WRITE_FOR_EVER.format(test_folder=os.path.dirname(__file__))
    process = subprocess.Popen(
        [sys.executable, "-c", program, str(directory)], stdout=subprocess.PIPE, text=True
    )
    flushes = [(0, 0)]  # (handed over, flushed) at each line that told of another flush
    for line in process.stdout:
        handed_over, flushed = map(int, line.split())
        if flushed > flushes[-1][1]:
            flushes.append((handed_over, flushed))
        if len(flushes) > 4 and handed_over > flushes[-1][0] + 50:
            break
    process.send_signal(signal.SIGKILL)
    process.wait()

    bag = open_bag(directory)
    payloads = bag.raw("/text").payloads
    numbers = bag.raw("/text").log_time_ns
    np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
    assert len(numbers) >= flushed
    # A flush takes all that was handed over up to the flush before (but for the one message
    # between that flush and the line that told of it), so nothing older than one period is lost.
    for (handed_over_before, _), (_, flushed_then) in pairwise(flushes[1:]):
        assert flushed_then >= handed_over_before - 1
    assert len(payloads) == len(numbers)
    assert not bag.complete
    assert "broke off" in bag.problem
    assert recorded_rig(bag).text == "name: any\n"
    assert (directory / "RECORDING").exists()
    assert not (directory / "metadata.yaml").exists()


def write_bag(directory, count: int) -> None:
    with BagWriter(directory, [TOPIC], [RIG]) as writer:
        for start in range(0, count, 100):
            writer.write([text_message(start + i, b"%d" % i) for i in range(100)])
            if start == 0:
                wait_until(lambda: writer.messages == 100)


def test_a_file_cut_anywhere_is_read_up_to_the_cut(tmp_path):
    """Every length of the file gives a prefix of the messages, never an error or a wrong one."""
    directory = tmp_path / "whole"
    write_bag(directory, 300)
    whole = (directory / "whole_0.mcap").read_bytes()
    counts = []
    for number, length in enumerate(range(len(whole), 8, -97)):
        cut = tmp_path / f"cut{number}"
        cut.mkdir()
        (cut / "cut_0.mcap").write_bytes(whole[:length])
        bag = open_bag(cut)
        numbers = bag.raw("/text").log_time_ns
        np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
        assert bag.complete == (length == len(whole))
        counts.append(len(numbers))
    assert counts[0] == 300
    assert counts == sorted(counts, reverse=True)
    assert 100 in counts
    assert counts[-1] == 0


def test_a_damaged_chunk_is_left_out_and_said(tmp_path):
    directory = tmp_path / "damaged"
    write_bag(directory, 300)
    path = directory / "damaged_0.mcap"
    data = bytearray(path.read_bytes())
    zstd_magic = b"\x28\xb5\x2f\xfd"
    last_chunk = data.rindex(zstd_magic)
    data[last_chunk + 40] ^= 0xFF
    path.write_bytes(data)
    bag = open_bag(directory)
    numbers = bag.raw("/text").log_time_ns
    assert len(numbers) < 300
    np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
    assert "1 damaged place is left out" in bag.problem
    assert f"{300 - len(numbers)} of 300 messages are lost" in bag.problem


# A limit on the file size stands in for a full disk: the kernel refuses the write in the same way.
_FILL_UP = """
import os, resource, sys
sys.path.insert(0, {test_folder!r})
from text_bag import RIG, TOPIC, text_message, wait_until
from towtank_bag.layout import BagError
from towtank_bag.writer import BagWriter
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
writer = BagWriter(sys.argv[1], [TOPIC], [RIG])
number = 0
try:
    while True:
        before = writer.messages
        writer.write([text_message(number + i, os.urandom(50).hex().encode()) for i in range(200)])
        number += 200
        wait_until(lambda: writer.messages == number or writer.error)
        if writer.error is None:
            flushed = before
except BagError as error:
    print(error)
try:
    writer.close()
except BagError as error:
    print(error)
    print(flushed)
"""


def test_a_full_disk_stops_the_writer_with_one_line_and_keeps_the_rest(tmp_path):
    directory = tmp_path / "full"
    program = _FILL_UP.format(test_folder=os.path.dirname(__file__))
    result = subprocess.run(
        [sys.executable, "-c", program, str(directory)], capture_output=True, text=True, timeout=60
    )
    assert result.stderr == ""
    first, second, flushed = result.stdout.splitlines()
    assert first == second
    assert "full_0.mcap: cannot write: File too large" in first
    assert "free space and record again" in first
    bag = open_bag(directory)
    numbers = bag.raw("/text").log_time_ns
    assert len(numbers) >= int(flushed) >= 200
    np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
    assert not bag.complete
    assert (directory / "RECORDING").exists()
    assert not (directory / "metadata.yaml").exists()


def test_a_disk_that_is_full_at_once_is_said(tmp_path):
    program = """
import resource, sys
sys.path.insert(0, {test_folder!r})
from text_bag import RIG, TOPIC
from towtank_bag.layout import BagError
from towtank_bag.writer import BagWriter
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
try:
    BagWriter(sys.argv[1], [TOPIC], [RIG])
except BagError as error:
    print(error)
"""
    program = program.format(test_folder=os.path.dirname(__file__))
    result = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "none")], capture_output=True, text=True
    )
    assert result.stderr == ""
    assert "cannot make the bag: File too large" in result.stdout


def test_an_existing_directory_is_refused_and_left_alone(tmp_path):
    directory = tmp_path / "there"
    directory.mkdir()
    (directory / "data").write_text("precious")
    with pytest.raises(BagError, match="exists already and is not overwritten"):
        BagWriter(directory, [TOPIC])
    assert [path.name for path in directory.iterdir()] == ["data"]


def test_a_full_queue_drops_and_counts(tmp_path):
    with BagWriter(tmp_path / "bag", [TOPIC], queue_messages=10) as writer:
        writer.write([text_message(i, b"x") for i in range(25)])
        assert writer.overflowed == 15
        assert writer.queue_high_water == 10
    assert len(open_bag(tmp_path / "bag").raw("/text").payloads) == 10


def test_writing_after_the_end_is_an_error(tmp_path):
    writer = BagWriter(tmp_path / "bag", [TOPIC])
    writer.close()
    writer.close()
    with pytest.raises(BagError, match="closed"):
        writer.write([text_message(0, b"late")])


def test_rosbags_opens_a_bag_without_messages(tmp_path):
    BagWriter(tmp_path / "bag", [TOPIC]).close()
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.message_count == 0
    assert open_bag(tmp_path / "bag").complete


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "no such bag"), ({}, "holds no .mcap file"), ({"a.mcap": b"text"}, "not an MCAP file")],
)
def test_what_is_no_bag_is_refused_in_one_line(tmp_path, content, message):
    directory = tmp_path / "bag"
    if content is not None:
        directory.mkdir()
        for name, data in content.items():
            (directory / name).write_bytes(data)
    with pytest.raises(BagError, match=message) as caught:
        open_bag(directory)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["no_such_package/msg/Thing", "std_msgs/msg/Thing", "String"])
def test_an_unknown_type_is_named(name):
    with pytest.raises(DefinitionError, match=name):
        message_definition(name)
