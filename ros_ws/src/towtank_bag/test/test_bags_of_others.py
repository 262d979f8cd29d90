# SPDX-License-Identifier: Apache-2.0
"""Bags that other programs wrote, converted, split, copied or spoilt the folder of."""

import os
import stat

import pytest
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType
from other_bags import PER_CHUNK, overwrite, records
from rewritten_bag import rewrite
from ruamel.yaml import YAML
from test_bag_damage import numbers
from towtank_bag.definitions import message_definition
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig

CHUNKS = 3
COUNT = PER_CHUNK * CHUNKS


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"index_types": IndexType.NONE},
        {"use_statistics": False, "use_summary_offsets": False},
        {"enable_crcs": False},
    ],
    ids=lambda options: ", ".join(f"{k}={v}" for k, v in options.items()),
)
def test_every_form_of_mcap_is_read(original, tmp_path, options):
    opened = open_bag(rewrite(original, tmp_path / "v" / "a.mcap", **options).parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.complete
    assert recorded_rig(opened).text == "name: any\n"
    unchecked = "enable_crcs" in options or "use_chunking" in options
    assert any("no checksums" in note for note in opened.notes) == unchecked


def test_damage_among_messages_outside_of_chunks_is_passed_over(original, tmp_path):
    path = rewrite(original, tmp_path / "v" / "a.mcap", use_chunking=False)
    overwrite(path, path.stat().st_size // 2, bytes(100))
    opened = open_bag(path.parent)
    read = numbers(opened)
    assert 0 not in (COUNT - len(read), len(read) - COUNT // 4)
    assert f"{COUNT - len(read)} of {COUNT} messages are lost" in opened.problem


def test_an_unknown_compression_is_named(original, tmp_path):
    path = rewrite(original, tmp_path / "v" / "a.mcap")
    path.write_bytes(path.read_bytes().replace(b"\x04\0\0\0zstd", b"\x04\0\0\0brot"))
    with pytest.raises(BagError, match=r"compressed with brot.*mcap compress"):
        open_bag(path.parent)


def split(original, folder, files: int):
    per_file = -(-COUNT // files)
    for number in range(files):
        rewrite(
            original,
            folder / f"bag_{number}.mcap",
            attachments=number == 0,
            wanted=lambda n, number=number: n // per_file == number,
        )
    return folder


def list_files(folder, names) -> None:
    with (folder / "metadata.yaml").open("w") as file:
        YAML().dump({"rosbag2_bagfile_information": {"relative_file_paths": names}}, file)


@pytest.mark.parametrize("listed", [False, True])
def test_splits_are_read_in_the_order_of_recording(original, tmp_path, listed):
    """Of their names, _10 comes before _2."""
    folder = split(original, tmp_path / "bag", 12)
    if listed:
        list_files(folder, [f"bag_{number}.mcap" for number in range(12)])
    opened = open_bag(folder)
    assert numbers(opened) == list(range(COUNT))
    assert opened.complete
    assert recorded_rig(opened).text == "name: any\n"


def test_a_split_that_is_missing_is_told(original, tmp_path):
    folder = split(original, tmp_path / "bag", 3)
    list_files(folder, ["bag_0.mcap", "bag_1.mcap", "bag_2.mcap"])
    (folder / "bag_1.mcap").unlink()
    opened = open_bag(folder)
    assert len(numbers(opened)) == 2 * PER_CHUNK
    assert "bag_1.mcap is of the bag by its metadata.yaml and lost" in opened.problem
    assert opened.lost


def test_what_is_not_of_the_bag_is_passed_over(bag):
    (bag.parent / "._bag_0.mcap").write_bytes(b"\0\5\26\7" + bytes(200))
    (bag.parent / "bag_1.mcap").write_bytes(b"")
    (bag.parent / "bag_0 (1).mcap").write_bytes(bag.read_bytes())
    (bag.parent / "folder.mcap").mkdir()
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.complete
    assert sorted(note.split(" ")[0] for note in opened.notes) == [
        "bag_0",
        "bag_1.mcap",
        "folder.mcap",
    ]


def test_a_copy_beside_the_file_counts_once(bag):
    """Where nothing lists the files; one that somebody has split, and in other chunks."""
    (bag.parent / "metadata.yaml").unlink()
    rewrite(bag, bag.parent / "copy.mcap", wanted=lambda n: n < COUNT - 50, chunk_size=1000)
    (bag.parent / "empty.mcap").write_bytes(b"")
    (bag.parent / "notes.mcap").write_text("not one of these\n")
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert f"{COUNT - 50} of its messages are in another file too" in " ".join(opened.notes)
    assert "empty.mcap is empty and was passed over" in opened.notes
    assert "notes.mcap is no MCAP file and was passed over" in opened.notes


def test_two_damaged_copies_complete_one_another(bag):
    """In the order of recording."""
    (bag.parent / "metadata.yaml").unlink()
    copy = bag.parent / "bag_0 (1).mcap"
    copy.write_bytes(bag.read_bytes())
    for file, number in ((bag, 1), (copy, 2)):
        chunk = [record for record in records(file) if record.opcode == Opcode.CHUNK][number]
        overwrite(file, chunk.body + 60, b"\xa5" * 8)
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.problem.count("1 damaged place is left out") == 2


def test_a_damaged_attachment_of_one_copy_does_not_hide_the_others(bag):
    (bag.parent / "metadata.yaml").unlink()
    copy = bag.parent / "bag_0 (1).mcap"
    copy.write_bytes(bag.read_bytes())
    for spoilt, whole in ((bag, copy), (copy, bag)):
        content = whole.read_bytes()
        overwrite(spoilt, content.index(b"name: any"), b"Name")
        opened = open_bag(bag.parent)
        assert opened.attachments["rig.yaml"] == b"name: any\n"
        assert "rig.yaml is damaged" in opened.problem
        spoilt.write_bytes(content)


def test_a_file_that_holds_more_than_is_listed_is_told(bag):
    """One of another recording, under the right name."""
    metadata = bag.parent / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(f"message_count: {COUNT}", "message_count: 7"))
    (note,) = open_bag(bag.parent).notes
    assert note.startswith(f"the files hold {COUNT} messages, 7 by metadata.yaml")


def test_a_list_of_files_that_lists_none_is_told(bag):
    metadata = bag.parent / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("relative_file_paths", "relative_file_paXhs"))
    (note,) = open_bag(bag.parent).notes
    assert note == "metadata.yaml is damaged: it lists no file"


def test_files_of_two_recordings_are_not_mixed(original, tmp_path):
    """The type has changed in between."""
    rewrite(original, tmp_path / "v" / "a.mcap", wanted=lambda n: n < 100)
    path = rewrite(
        original,
        tmp_path / "v" / "b.mcap",
        wanted=lambda n: n >= 100,
        schema=lambda s: (s.encoding, b"string data\nuint8 more\n"),
    )
    with pytest.raises(BagError, match="/text: there are messages of different types"):
        open_bag(path.parent).series("/text", ["data"])


@pytest.mark.parametrize("text", [b"", b"\xff{[:\n", b"{[:\n", b"[1, 2]\n", b"a: 1\n", bytes(99)])
def test_a_damaged_metadata_file_is_done_without(bag, text):
    (bag.parent / "metadata.yaml").write_bytes(text)
    opened = open_bag(bag.parent)
    assert numbers(opened) == list(range(COUNT))
    assert "metadata.yaml is damaged and was not used" in opened.notes


@pytest.mark.parametrize("encoding", ["json", "protobuf"])
@pytest.mark.parametrize("schema", [False, True])
def test_channels_of_other_programs_are_passed_over(original, tmp_path, encoding, schema):
    def extra(writer, channels):
        binary = b"\x0a\xf4\x01\xc3\x28\xff"
        its_schema = writer.register_schema("pkg.Thing", encoding, binary) if schema else 0
        channel = writer.register_channel("/thing", encoding, its_schema, {})
        writer.add_message(channel, 1, binary, 1, 0)

    opened = open_bag(rewrite(original, tmp_path / "v" / "a.mcap", extra=extra).parent)
    assert numbers(opened) == list(range(COUNT))
    assert opened.topics["/thing"].count == 1
    for read in (lambda: opened.series("/thing", ["x"]), lambda: list(opened.messages("/thing"))):
        with pytest.raises(BagError, match=f"v: /thing: its messages are in {encoding}"):
            read()


IDL = f"""{"=" * 80}
IDL: std_msgs/msg/String
module std_msgs {{ module msg {{ struct String {{ string data; }}; }}; }};
"""


@pytest.mark.parametrize(
    "schema",
    [("ros2idl", IDL.encode()), ("ros2idl", b"module {"), ("", b""), ("ros2msg", b"\xff what?")],
    ids=["idl", "spoilt idl", "none", "spoilt msg"],
)
def test_a_definition_that_is_missing_is_that_of_the_installed_type(original, tmp_path, schema):
    """If the hash is the same."""
    opened = open_bag(rewrite(original, tmp_path / "v" / "a.mcap", schema=lambda s: schema).parent)
    assert numbers(opened) == list(range(COUNT))


def test_a_definition_that_is_nowhere_is_told(original, tmp_path):
    path = rewrite(original, tmp_path / "v" / "a.mcap", schema=lambda s: ("", b""))
    type_hash = message_definition("std_msgs/msg/String").type_hash.encode()
    path = rewrite(path, tmp_path / "w" / "a.mcap", compression=CompressionType.NONE)
    path.write_bytes(path.read_bytes().replace(type_hash, b"x" * len(type_hash)))
    path = rewrite(path, tmp_path / "x" / "a.mcap", schema=lambda s: ("", b""))
    with pytest.raises(BagError, match="holds no definition of std_msgs/msg/String"):
        open_bag(path.parent).series("/text", ["data"])


@pytest.mark.parametrize(
    "payload", [b"", b"\0\1", b"\0\1\0\0\xff\xff\xff\xffabc", b"\0\1\0\0\2\0\0\0\xff\0"]
)
def test_a_message_that_is_none_is_told_in_one_line(original, tmp_path, payload):
    def extra(writer, channels):
        writer.add_message(1, COUNT, payload, COUNT, COUNT)

    opened = open_bag(rewrite(original, tmp_path / "v" / "a.mcap", extra=extra).parent)
    for read in (lambda: opened.series("/text", ["data"]), lambda: list(opened.messages("/text"))):
        with pytest.raises(BagError, match="/text: a message does not fit") as caught:
            read()
        assert "\n" not in str(caught.value)


def spoil(kind: str, bag) -> None:
    if kind == "dangling link":
        bag.unlink()
        bag.symlink_to("annexed")
    elif kind == "link to itself":
        bag.unlink()
        bag.symlink_to(bag.name)
    elif kind == "folder":
        bag.unlink()
        bag.mkdir()
    elif kind == "empty":
        bag.write_bytes(b"")
    elif kind == "no file":
        bag.rename(bag.with_suffix(".db3"))
    elif kind == "trial":
        bag.rename(bag.parent / "bag")
    elif kind == "compressed":
        bag.rename(bag.with_suffix(".mcap.zstd"))


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        ("dangling link", "bag_0.mcap: cannot be read: No such file.* fetch what the link names"),
        ("link to itself", "bag_0.mcap: cannot be read: Too many levels of symbolic links"),
        ("folder", "holds no .mcap file, but a folder bag_0.mcap; give that"),
        ("empty", "bag_0.mcap: the file is empty: nothing was recorded, or nothing reached"),
        ("no file", "a bag in SQLite; convert it: rosbags-convert --src"),
        ("trial", "holds no .mcap file, but a trial's bag; give .*/bag/bag$"),
        ("compressed", "files are compressed; expand them: zstd -d"),
    ],
)
def test_what_cannot_be_read_is_told_in_one_line(bag, kind, line):
    spoil(kind, bag)
    with pytest.raises(BagError, match=line) as caught:
        open_bag(bag.parent)
    assert "\n" not in str(caught.value)


@pytest.fixture
def nobody():
    """Another user, who may not read everything."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    yield
    os.seteuid(0)


@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_may_not_be_read_is_told_in_one_line(bag, what, request):
    place = bag if what == "file" else bag.parent
    place.chmod(0)
    for parent in bag.parents[1:]:  # pytest's own folders are for its user alone
        if not parent.stat().st_mode & stat.S_IXOTH:
            parent.chmod(0o711)
    request.getfixturevalue("nobody")
    with pytest.raises(BagError, match=f"{place}: cannot be read: Permission denied"):
        open_bag(bag.parent)
