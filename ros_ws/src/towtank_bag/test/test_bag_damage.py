# SPDX-License-Identifier: Apache-2.0
"""Damaged bags: what has a checksum is held against it, and only what is damaged is given up."""

import errno
import os
import re
import struct
import zlib

import numpy as np
import pytest
from mcap.opcode import Opcode
from other_bags import PER_CHUNK, overwrite, records, write_bag
from rewritten_bag import rewrite
from towtank_bag import mcap_scan
from towtank_bag.layout import BagError
from towtank_bag.reader import LostStretch, open_bag

CHUNKS = 4
COUNT = PER_CHUNK * CHUNKS


def numbers(opened) -> list[int]:
    """What the messages say; their log times say the same, or a wrong one was read."""
    raw = opened.raw("/text")
    said = [int(message.data) for _, message in opened.messages("/text")]
    assert said == raw.log_time_ns.tolist() == raw.publish_time_ns.tolist()
    return said


def without_chunk(number: int) -> list[int]:
    return [n for n in range(COUNT) if n // PER_CHUNK != number]


def of_kind(bag, opcode):
    return [record for record in records(bag) if record.opcode == opcode]


def test_the_message_index_is_not_believed(bag):
    """Where it was, a zeroed sector made messages of other bytes."""
    for index in of_kind(bag, Opcode.MESSAGE_INDEX):
        overwrite(bag, index.body + 6, bytes(index.length - 6))
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.problem.endswith(
        "bag_0.mcap: it does not agree with its checksum, no message is lost"
    )
    assert opened.lost == []


def test_a_chunk_is_given_up_alone_and_its_place_told(bag):
    chunk = of_kind(bag, Opcode.CHUNK)[1]
    overwrite(bag, chunk.body + 60, b"\xa5" * 8)
    opened = open_bag(bag.parent)
    assert numbers(opened) == without_chunk(1)
    assert opened.lost == [LostStretch(99, 200)]
    assert "1 damaged place is left out, 100 of 400 messages are lost (between" in opened.problem


@pytest.mark.parametrize("byte", range(9))
@pytest.mark.parametrize("bits", [0x01, 0x80, 0xFF])
def test_behind_a_damaged_record_head_the_rest_is_found(bag, byte, bits):
    """Opcode and length of a chunk: where the next record begins is not known then."""
    place = of_kind(bag, Opcode.CHUNK)[1].start + byte
    overwrite(bag, place, bytes([bag.read_bytes()[place] ^ bits]))
    opened = open_bag(bag.parent)
    assert numbers(opened) == without_chunk(1)
    assert "100 of 400 messages are lost" in opened.problem


def test_the_sector_with_the_topics_leaves_all_other_chunks(bag):
    """What the channels mean stands in the first chunk, and in the summary."""
    chunk = of_kind(bag, Opcode.CHUNK)[0]
    overwrite(bag, chunk.start, bytes(64))
    assert numbers(open_bag(bag.parent)) == without_chunk(0)


def test_without_a_word_on_the_topics_their_messages_are_counted_as_lost(bag):
    """Broken off, it has no summary, which would know them too."""
    first, *_, last = of_kind(bag, Opcode.CHUNK)
    overwrite(bag, first.start, bytes(64))
    bag.write_bytes(bag.read_bytes()[: last.end])
    opened = open_bag(bag.parent)
    assert opened.topics == {}
    assert f"what topics {COUNT - PER_CHUNK} of the messages are of is lost" in opened.problem
    assert "broke off" in opened.problem


def test_a_bag_without_its_first_sector_is_one_still(bag):
    overwrite(bag, 0, bytes(64))
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.attachments == {}
    assert not opened.complete


def test_what_a_damaged_place_held_is_named_and_its_messages_are_missed(bag):
    """The rig and the first chunk in one: where the messages were is told too."""
    (attachment,), chunk = of_kind(bag, Opcode.ATTACHMENT), of_kind(bag, Opcode.CHUNK)[0]
    overwrite(bag, attachment.start, bytes(chunk.body + 20 - attachment.start))
    opened = open_bag(bag.parent)
    assert numbers(opened) == without_chunk(0)
    said = "1 damaged place is left out, rig.yaml is damaged, the note 'towtank' is damaged"
    assert f"{said}, 100 of 400 messages are lost (before 0.00 s" in opened.problem
    assert opened.lost == [LostStretch(None, 100)]


def test_damage_at_the_end_loses_no_message(bag):
    """Data end, summary, footer: each record of them, zeroed."""
    whole = bag.read_bytes()
    (data_end,) = of_kind(bag, Opcode.DATA_END)
    for start, length in ((data_end.start, 13), (data_end.end + 40, 64), (len(whole) - 8, 8)):
        bag.write_bytes(whole)
        overwrite(bag, start, bytes(length))
        opened = open_bag(bag.parent)
        assert numbers(opened) == list(range(COUNT))
        assert opened.problem.endswith("no message is lost")


def test_a_power_cut_may_leave_zeros(bag):
    """The length of the file was on the disk before its content was."""
    chunk = of_kind(bag, Opcode.CHUNK)[2]
    overwrite(bag, chunk.start + 100, bytes(len(bag.read_bytes()) - chunk.start - 100))
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(2 * PER_CHUNK))
    assert "broke off" in opened.problem
    assert opened.lost == [LostStretch(2 * PER_CHUNK - 1, None)]


def test_a_damaged_attachment_is_not_given_out(bag):
    (attachment,) = of_kind(bag, Opcode.ATTACHMENT)
    overwrite(bag, attachment.end - 8, b"?")
    opened = open_bag(bag.parent)
    assert opened.attachments == {}
    assert "rig.yaml is damaged, no message is lost" in opened.problem


def test_a_bit_outside_of_all_checksums_but_one_is_noticed(tmp_path):
    """The recorder's metadata have none of their own."""
    bag = write_bag(tmp_path / "bag", 1, version="0.1.0")
    start = bag.read_bytes().index(b"0.1.0")
    overwrite(bag, start, b"9")
    opened = open_bag(bag.parent)
    assert opened.metadata["towtank"]["version"] == "9.1.0"
    assert "does not agree with its checksum" in opened.problem


def test_a_checksum_that_was_zeroed_is_not_one_that_is_missing(bag):
    chunk = of_kind(bag, Opcode.CHUNK)[1]
    overwrite(bag, chunk.body + 24, bytes(4))
    opened = open_bag(bag.parent)
    assert numbers(opened) == without_chunk(1)
    assert "1 damaged place is left out" in opened.problem


def test_a_claim_of_much_memory_is_not_tried(bag):
    chunk = of_kind(bag, Opcode.CHUNK)[1]
    overwrite(bag, chunk.body + 16, struct.pack("<Q", 1 << 50))
    assert numbers(open_bag(bag.parent)) == without_chunk(1)


def test_the_chunks_that_are_not_kept_in_memory_are_read_again(bag, monkeypatch):
    monkeypatch.setattr(mcap_scan, "KEPT_BYTES", 3000)
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    overwrite(bag, of_kind(bag, Opcode.CHUNK)[-1].body + 60, b"\xa5" * 8)
    with pytest.raises(BagError, match="was changed while it was read"):
        opened.raw("/text")


def test_damage_is_noticed_without_checksums_of_chunks_where_the_file_has_one(bag, tmp_path):
    other = rewrite(bag, tmp_path / "other" / "a.mcap", enable_crcs=False, enable_data_crcs=True)
    assert open_bag(other.parent).complete
    start = zlib.crc32(b"")  # nought: the first byte of the magic stays what it is
    overwrite(other, other.read_bytes().index(b"other", start), b"O")
    assert "does not agree with its checksum" in open_bag(other.parent).problem


def test_what_the_disk_cannot_give_is_given_up_alone(bag, monkeypatch):
    """A bad sector is no zeros: reading it fails."""
    chunk = of_kind(bag, Opcode.CHUNK)[1]
    bad, pread = (chunk.body + 60) // 512 * 512, os.pread

    def failing(descriptor, length, start):
        if start < bad + 512 and start + length > bad:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return pread(descriptor, length, start)

    monkeypatch.setattr(os, "pread", failing)
    opened = open_bag(bag.parent)
    assert set(numbers(opened)) >= set(range(2 * PER_CHUNK, COUNT))
    assert "damaged place is left out" in opened.problem
    assert len(numbers(opened)) == COUNT - int(re.search(r"(\d+) of 400", opened.problem)[1])


def test_a_disk_that_fails_otherwise_is_told_in_one_line(bag, monkeypatch):
    def failing(descriptor, length, start):
        raise OSError(errno.ESTALE, os.strerror(errno.ESTALE))

    monkeypatch.setattr(os, "pread", failing)
    with pytest.raises(BagError, match=r"bag_0.mcap: cannot be read: Stale file handle") as caught:
        open_bag(bag.parent)
    assert "\n" not in str(caught.value)


def test_every_cut_and_every_zeroed_sector_gives_a_part_of_the_messages(bag):
    """And says so, for each place of the file."""
    whole = bag.read_bytes()
    everything = np.arange(COUNT)
    for start in range(0, len(whole), 200):
        for damaged in (whole[:start], whole[:start] + bytes(64) + whole[start + 64 :]):
            bag.write_bytes(damaged)
            try:
                opened = open_bag(bag.parent)
            except BagError as error:
                assert "\n" not in str(error)
                continue
            assert np.isin(numbers(opened), everything).all()
            assert opened.problem
            assert numbers(opened) == sorted(set(numbers(opened)))
