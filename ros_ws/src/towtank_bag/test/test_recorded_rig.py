# SPDX-License-Identifier: Apache-2.0
"""The rig in a bag is believed only if something shows that it is the one of the recording."""

import hashlib

import pytest
from mcap.opcode import Opcode
from other_bags import overwrite, records
from rewritten_bag import rewrite
from text_bag import text_message
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_bag.writer import Attachment, BagWriter
from towtank_node.topics import RIG

TEXT = b"name: tow\nx: 0.22\n"
SPOILT = "the attached rig.yaml is damaged: the rig is that of /rig"


def write(directory, attached: bytes | None = TEXT, published: bytes | None = TEXT, noted=TEXT):
    """A bag with up to three witnesses; the first message is on another topic."""
    attachments = [] if attached is None else [Attachment("rig.yaml", "", attached)]
    metadata = {} if noted is None else {"rig_sha256": hashlib.sha256(noted).hexdigest()}
    with BagWriter(directory, [RIG], attachments, {"towtank": metadata}) as writer:
        if published is not None:
            writer.write([text_message(0, published)])
    return directory / f"{directory.name}_0.mcap"


def test_of_three_that_agree_each_may_be_missing(tmp_path):
    for number, missing in enumerate(
        [{}, {"attached": None}, {"published": None}, {"noted": None}]
    ):
        bag = write(tmp_path / f"bag{number}", **missing)
        found = recorded_rig(open_bag(bag.parent))
        assert (found.text.encode(), found.note) == (TEXT, None)


def test_a_damaged_attachment_is_replaced_by_the_topics_copy(tmp_path):
    for noted in (TEXT, None):
        bag = write(tmp_path / f"noted {noted is not None}", noted=noted)
        overwrite(bag, bag.read_bytes().index(b"0.22") + 2, b"3")
        opened = open_bag(bag.parent)
        found = recorded_rig(opened)
        assert (found.text.encode(), found.note) == (TEXT, SPOILT)
        assert "rig.yaml is damaged" in opened.problem


def test_an_attachment_that_was_changed_with_its_checksum_is_none_of_the_recording(tmp_path):
    bag = write(tmp_path / "bag", attached=TEXT.replace(b"0.22", b"0.32"))
    found = recorded_rig(open_bag(bag.parent))
    assert (found.text.encode(), found.note) == (TEXT, SPOILT)


def test_two_copies_outvote_a_damaged_hash(tmp_path):
    bag = write(tmp_path / "bag", noted=b"another")
    found = recorded_rig(open_bag(bag.parent))
    assert found.text.encode() == TEXT
    assert "note of the rig's hash is damaged" in found.note


def test_a_zeroed_checksum_is_not_one_that_is_missing(tmp_path):
    """The messages have theirs, so a sector of zeros has taken the attachment's."""
    bag = write(tmp_path / "bag", noted=None)
    (attachment,) = (r for r in records(bag) if r.opcode == Opcode.ATTACHMENT)
    overwrite(bag, attachment.end - 12, b"9" + bytes(11))
    opened = open_bag(bag.parent)
    assert opened.attachments == {}
    assert recorded_rig(opened).note == SPOILT


@pytest.mark.parametrize(
    "witnesses",
    [
        {"attached": TEXT + b"#", "published": None},
        {"attached": None, "published": TEXT + b"#"},
        {"attached": TEXT + b"#", "published": TEXT + b"##"},
    ],
)
def test_where_none_agrees_none_is_believed(tmp_path, witnesses):
    bag = open_bag(write(tmp_path / "bag", **witnesses).parent)
    with pytest.raises(BagError, match=r"damaged or not the one .* --rig FILE"):
        _ = recorded_rig(bag).text


def test_a_bag_without_any_rig_asks_for_one(tmp_path):
    bag = open_bag(write(tmp_path / "bag", attached=None, published=None).parent)
    with pytest.raises(BagError, match=r"holds no rig file; give it with --rig FILE"):
        _ = recorded_rig(bag).text


def test_a_rig_that_nothing_vouches_for_is_marked(tmp_path):
    """Of a program that writes no checksums."""
    bag = write(tmp_path / "bag", noted=None, published=b"name: tow\n")
    path = rewrite(bag, tmp_path / "v" / "a.mcap", enable_crcs=False, wanted=lambda number: False)
    (attachment,) = (r for r in records(path) if r.opcode == Opcode.ATTACHMENT)
    overwrite(path, attachment.end - 4, bytes(4))
    found = recorded_rig(open_bag(path.parent))
    assert found.text.encode() == TEXT
    assert found.note == "nothing shows whether the attached rig.yaml is undamaged"
