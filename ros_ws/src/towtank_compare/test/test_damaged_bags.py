# SPDX-License-Identifier: Apache-2.0
"""What is made of the reference bag when it is damaged, or when others have written in it."""

import json
import re
import shutil
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from mcap.reader import make_reader
from mcap.writer import Writer
from rclpy.serialization import serialize_message
from rewritten_bag import rewrite
from std_msgs.msg import Header
from synthetic_trial import LATENCY_NS, LOG, RIG_FILE, START_NS
from towtank_bag.definitions import message_definition
from towtank_bag.layout import BagError
from towtank_bag.mcap_scan import scan_file
from towtank_bag.reader import open_bag
from towtank_compare.compare import CompareError, compare_bag
from towtank_compare.report import write_report
from towtank_compare.trial_log import events, logged_window, overruns, restarts
from towtank_compare.trial_result import trial_result
from towtank_interfaces.msg import TrialEvent
from towtank_node import topics

REFERENCE = Path(__file__).resolve().parents[4] / "bags" / "reference"
START_MS = START_NS // 1_000_000


@pytest.fixture
def bag(tmp_path):
    """The file of a copy of the reference bag."""
    shutil.copytree(REFERENCE, tmp_path / "bag")
    return tmp_path / "bag" / "reference_0.mcap"


def spoil_chunk(file, at_s: float) -> tuple[float, float]:
    """Spoil the chunk of an instant, s after the start. Returns from when to when that was."""
    chunk = chunk_at(file, at_s)
    spoil(file, chunk)
    return tuple((ns - LATENCY_NS - START_NS) * 1e-9 for ns in (chunk.first_ns, chunk.last_ns))


def spoil(file, chunk) -> None:
    data = bytearray(file.read_bytes())
    data[chunk.start + 100] ^= 0xFF
    file.write_bytes(data)


def chunk_at(file, at_s: float):
    log_ns = START_NS + int(at_s * 1e9) + LATENCY_NS
    (chunk,) = (b for b in scan_file(file).blocks if b.first_ns <= log_ns <= b.last_ns)
    return chunk


def test_the_reference_bag_gives_what_its_motion_is():
    """As every later version must read it. Its sensors' noise of 0.2 mm over 79 samples of the log
    leaves 32 µm of the depressor's 55 mm and of the fish's 12 mm (k = 1); four of that."""
    result = compare_bag(REFERENCE)
    assert result["measured"] == pytest.approx(12 / 55, abs=4 * 0.032 * 1.1 / 55)
    assert result["twin"] == pytest.approx(0.198773, abs=1e-6)  # noiseless
    assert result["scans"] == {"scheduled": 81, "received": 80, "lost": 1, "bad": 1}
    assert (result["bag_problem"], result["bag_notes"]) == (None, [])


def test_scans_of_a_damaged_chunk_are_lost_and_told(bag, tmp_path):
    whole = trial_result(REFERENCE)
    (scans,) = (c.id for c in scan_file(bag).channels.values() if c.topic == topics.SCANS.name)
    gone = len(chunk_at(bag, 10.0).offsets[scans])
    assert gone > 1
    spoil_chunk(bag, 10.0)
    result = trial_result(bag.parent)
    assert result["scans"]["scheduled"] == whole["scans"]["scheduled"]
    assert result["scans"]["lost"] == whole["scans"]["lost"] + gone
    assert result["heave_ratio"]["measured"]["value"] == pytest.approx(12 / 55, rel=0.03)
    assert "1 damaged place is left out" in result["bag_problem"]
    write_report(bag.parent, result, tmp_path / "report.html")
    assert result["bag_problem"] in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(("mark", "end"), [("log_start", 0), ("log_stop", 1)])
def test_a_lost_mark_of_the_log_narrows_the_window_to_what_is_surely_in_it(bag, mark, end):
    gone = spoil_chunk(bag, LOG[end])
    result = compare_bag(bag.parent)
    window = [t - START_NS * 1e-9 for t in result["window"]]
    assert window[1 - end] == pytest.approx(LOG[1 - end], abs=2e-3)
    if mark == "log_start":
        assert gone[1] < window[0] < gone[1] + 0.3  # the next scan is a fifth of a second later
    else:
        assert gone[0] - 0.3 < window[1] < gone[0]
    assert any(note.startswith(f"{mark} is lost: the window") for note in result["bag_notes"])
    assert result["measured"] == pytest.approx(12 / 55, rel=0.03)


def split(bag, at_s: float, names: tuple[str, ...]):
    """Two files of a bag instead of one, parted at an instant, and what lists them; returns
    them."""
    files = [bag.parent / name for name in names]
    border_ns = START_NS + int(at_s * 1e9)
    with bag.open("rb") as source:
        late = [m.log_time >= border_ns for _, _, m in make_reader(source).iter_messages()]
    for second, path in enumerate(files):
        rewrite(bag, path, wanted=lambda n, second=second: late[n] == second, chunk_size=64_000)
    bag.unlink()
    listed = "".join(f"    - {name}\n" for name in names)
    (bag.parent / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information:\n  relative_file_paths:\n{listed}"
    )
    return files


def test_a_lost_mark_may_have_stood_at_the_beginning_of_a_file(bag):
    """The window must not go on to where the carriage brakes."""
    _, second = split(bag, LOG[1] - 0.5, ("a.mcap", "b.mcap"))
    first_chunk, *rest = scan_file(second).blocks
    assert rest
    assert first_chunk.last_ns > START_NS + LOG[1] * 1e9 + LATENCY_NS
    spoil(second, first_chunk)
    result = compare_bag(bag.parent)
    end = result["window"][1] - START_NS * 1e-9
    assert LOG[1] - 1.0 < end <= LOG[1] - 0.5
    assert any(note.startswith("log_stop is lost: the window") for note in result["bag_notes"])


def test_a_file_that_is_gone_may_have_held_the_mark(bag):
    """Nothing tells when what it held was."""
    _, second = split(bag, LOG[1] - 0.5, ("a.mcap", "b.mcap"))
    second.unlink()
    result = compare_bag(bag.parent)
    assert "b.mcap is of the bag by its metadata.yaml and lost" in result["bag_problem"]
    assert any(note.startswith("log_stop is lost, and") for note in result["bag_notes"])


def test_where_both_marks_are_lost_a_window_is_asked_for(bag):
    for instant in LOG:
        spoil_chunk(bag, instant)
    with pytest.raises(BagError, match=r"no log_start .* give a window within") as caught:
        compare_bag(bag.parent)
    assert "2 damaged places are left out" in str(caught.value)
    begin, end = map(float, re.search(r"within ([\d.]+) to ([\d.]+)", str(caught.value)).groups())
    compared = compare_bag(bag.parent, (begin + 3, end - 3))
    assert compared["measured"] == pytest.approx(12 / 55, rel=0.03)


def test_a_cut_before_the_log_is_no_trial_that_ended_there(bag):
    data = bag.read_bytes()
    blocks = scan_file(bag).blocks
    bag.write_bytes(data[: blocks[1].start + blocks[1].length])
    with pytest.raises(BagError, match=r"recording broke off.* no log_start .* give a window"):
        compare_bag(bag.parent)


def test_a_recording_that_broke_off_is_compared_and_told(bag):
    bag.write_bytes(bag.read_bytes()[: chunk_at(bag, 12.0).start])
    result = compare_bag(bag.parent)
    assert result["measured"] == pytest.approx(12 / 55, rel=0.03)
    assert "broke off" in result["bag_problem"]
    assert result["bag_notes"] == []


def test_a_damaged_rig_is_never_used(bag):
    """Both copies: the attachment, and that of the topic, which stands in the first chunk."""
    whole = compare_bag(REFERENCE)
    data = bag.read_bytes()
    spoilt = data.replace(b"{value: 0.22 m", b"{value: 0.32 m", 1)
    assert spoilt != data
    bag.write_bytes(spoilt)
    result = compare_bag(bag.parent)
    assert result["twin"] == whole["twin"]
    assert "rig.yaml is damaged, no message is lost" in result["bag_problem"]
    assert result["bag_notes"] == ["the attached rig.yaml is damaged: the rig is that of /rig"]
    spoil(bag, scan_file(bag).blocks[0])
    with pytest.raises(BagError, match="give that with --rig FILE"):
        compare_bag(bag.parent)
    assert compare_bag(bag.parent, rig_file=RIG_FILE)["twin"] is not None


def test_another_rig_is_marked(tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text(RIG_FILE.read_text() + "\n# changed\n")
    notes = compare_bag(REFERENCE, rig_file=other)["bag_notes"]
    assert notes == [f"the rig is that of {other}, and not shown to be the one of the recording"]


def with_messages(bag, *extra) -> None:
    """Write the bag anew as another program does, with more (topic, message) at its end."""

    def add(writer: Writer, channels: dict[str, int]) -> None:
        for topic, message in extra:
            if topic not in channels:
                name = f"{type(message).__module__.split('.')[0]}/msg/{type(message).__name__}"
                text = message_definition(name).text.encode()
                schema = writer.register_schema(name, "ros2msg", text)
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = serialize_message(message)
            writer.add_message(channels[topic], 2**60, data, 2**60, 2**31)

    rewrite(REFERENCE / "reference_0.mcap", bag, extra=add)
    (bag.parent / "metadata.yaml").unlink()


def note(name: str, detail: str) -> tuple[str, TrialEvent]:
    header = Header(stamp=Time(sec=START_NS // 10**9 + 12))
    return topics.EVENTS.name, TrialEvent(header=header, event=name, detail=detail)


def test_notes_that_people_keep_in_a_bag_are_kept(bag):
    texts = ["changed the ballast, see notebook p. 12", "[1, 2]", "[" * 100_000, '"text"', ""]
    with_messages(
        bag,
        *(note("note", text) for text in texts),
        note("restarted", "by hand"),
        note("restarted", '{"node": 7}'),
        note("resources", "plenty"),
        note("resources", '{"cpu_cores": NaN}'),
    )
    opened = open_bag(bag.parent)
    found = [event.detail for event in events(opened) if event.name == "note"]
    assert found == [{"text": text} for text in texts[:4]] + [{}]
    assert restarts(opened) == {}
    result = trial_result(bag.parent)
    assert result["cpu_cores"] == 0.9
    assert result["heave_ratio"] == trial_result(REFERENCE)["heave_ratio"]
    json.dumps(result, allow_nan=False)


def test_of_two_logs_the_last_is_evaluated_and_told(bag):
    """Files of two trials in one folder, say."""
    with_messages(bag, note("log_start", ""))
    result = compare_bag(bag.parent)
    assert [t - START_NS * 1e-9 for t in result["window"]] == pytest.approx([12, 18], abs=2e-3)
    assert "the bag holds 2 logs: the last is evaluated" in " ".join(result["bag_notes"])


def test_diagnostics_of_others_may_say_what_they_like(bag):
    texts = ("n/a", "-1", "1e9", "²", "", "9" * 5000)
    values = [KeyValue(key="overruns", value=text) for text in texts]
    with_messages(
        bag,
        (
            topics.DIAGNOSTICS.name,
            DiagnosticArray(status=[DiagnosticStatus(name="camera", values=values)]),
        ),
    )
    assert overruns(open_bag(bag.parent)) == overruns(open_bag(REFERENCE))


@pytest.mark.parametrize(
    "window",
    [
        (float("nan"), float("nan")),
        (float("inf"), float("inf")),
        (0, float("inf")),
        (-1, 5),
        (0, 1e300),
        (1, 1e18),
    ],
)
def test_a_window_that_is_none_is_told_in_one_line(window):
    with pytest.raises(CompareError, match="give two instants in s since the epoch"):
        compare_bag(REFERENCE, window)


def test_the_window_of_a_whole_bag_is_its_log():
    window = logged_window(open_bag(REFERENCE))
    assert window.t0_ms - START_MS == 2_000
    assert window.t1_ms - START_MS == 18_000
    assert window.note is None
