# SPDX-License-Identifier: Apache-2.0
"""What is written into a bag comes back, for every message type of the graph."""

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML
from sensor_msgs.msg import FluidPressure, Imu, JointState
from std_msgs.msg import Header, String
from towtank_bag.layout import BagError
from towtank_bag.reader import open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_bag.writer import Attachment, BagWriter, RawMessage
from towtank_interfaces.msg import (
    AdcScan,
    CableState,
    CrankDrive,
    CrankMotion,
    Depth,
    HeaveRatio,
    Inclination,
    TrialEvent,
)
from towtank_node import names, topics
from towtank_node.qos import LATCHED
from towtank_node.topics import Topic

START_NS = 1_750_000_000_123_456_789
PERIOD_NS = 10_000_000


def stamp(index: int) -> Time:
    seconds, nanoseconds = divmod(START_NS + index * PERIOD_NS, 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def header(index: int, frame: str = "fish_pressure") -> Header:
    return Header(stamp=stamp(index), frame_id=frame)


def odometry(index: int) -> Odometry:
    message = Odometry(header=header(index, "tank"), child_frame_id=names.FISH)
    message.pose.pose.position.z = -2.0 - 0.01 * index
    message.pose.pose.orientation.w = 0.5
    message.pose.covariance[35] = float(index)
    message.twist.twist.angular.y = 1e-3 * index
    return message


def cable_state(index: int) -> CableState:
    points = [0.1 * k + index for k in range(5)]
    return CableState(
        header=header(index, "tank"),
        line_names=["primary", "secondary"],
        segment_counts=[2, 1],
        x=points,
        y=points,
        z=points,
        tension=points[:3],
    )


def diagnostics(index: int) -> DiagnosticArray:
    values = [KeyValue(key="overruns", value=str(10**index))]  # its length changes
    return DiagnosticArray(
        header=header(index), status=[DiagnosticStatus(name=names.RECORDER_NODE, values=values)]
    )


MAKERS = {
    topics.SCANS.name: lambda i: AdcScan(
        header=header(i),
        sequence=i,
        board_ticks=20_000 * i,
        configured_mask=63,
        valid_mask=63,
        codes=[i, 2, 3, 4, 5, 0xFFFFFF],
        channel_delay_ns=[-1, 2, 3, 4, 5, i],
        crank_count=-i,
        carriage_count=2 * i,
    ),
    topics.FISH_PRESSURE.name: lambda i: FluidPressure(header=header(i), fluid_pressure=9e3 + i),
    topics.FISH_DEPTH.name: lambda i: Depth(header=header(i), depth=0.1 * i, valid=i % 2 == 0),
    topics.FISH_IMU.name: lambda i: Imu(header=header(i)),
    topics.INCLINATION.name: lambda i: Inclination(header=header(i), pitch=0.1 * i),
    topics.CRANK_MOTION.name: lambda i: CrankMotion(header=header(i), heave=0.1 * i, zeroed=i > 1),
    topics.MEASURED_JOINTS.name: lambda i: JointState(
        header=header(i),
        name=["crank", "carriage"],
        position=[0.1 * i, i],
        velocity=[1.0, 2.0],
        effort=[0.0, 0.0],
    ),
    topics.TWIN_FISH.name: odometry,
    topics.TWIN_CABLES.name: cable_state,
    topics.CRANK_DRIVE.name: lambda i: CrankDrive(header=header(i), crank_rate=0.1 * i),
    topics.MEASURED_RATIO.name: lambda i: HeaveRatio(header=header(i), value=0.2 + i),
    topics.EVENTS.name: lambda i: TrialEvent(header=header(i), event="x" * i),
    topics.RIG.name: lambda i: String(data=f"name: {i}"),
    topics.DIAGNOSTICS.name: diagnostics,
}
COUNT = 12


@pytest.fixture(scope="module")
def bag_directory(tmp_path_factory):
    directory = tmp_path_factory.mktemp("bags") / "trial"
    known = {topic.name: topic for topic in topics.TRIAL}
    recorded = [known[name] for name in MAKERS]
    recorded.append(Topic("/never/published", "std_msgs/msg/String", LATCHED))
    rig = Attachment("rig.yaml", "application/yaml", b"name: nit  # exact\n")
    with BagWriter(directory, recorded, [rig], {"towtank": {"version": "0"}}) as writer:
        for i in range(COUNT):
            writer.write(
                [
                    RawMessage(
                        topic,
                        START_NS + i * PERIOD_NS + topic,
                        START_NS + i * PERIOD_NS,
                        serialize_message(make(i)),
                    )
                    for topic, make in enumerate(MAKERS.values())
                ]
            )
    return directory


def test_every_message_type_of_the_graph_is_tried():
    tried = {topic.type_name for topic in topics.TRIAL if topic.name in MAKERS}
    assert tried == {topic.type_name for topic in topics.TRIAL}


@pytest.mark.parametrize("topic", MAKERS)
def test_every_message_type_comes_back(bag_directory, topic):
    raw = open_bag(bag_directory).raw(topic)
    message_type = type(MAKERS[topic](0))
    read = [deserialize_message(payload, message_type) for payload in raw.payloads]
    assert read == [MAKERS[topic](i) for i in range(COUNT)]
    expected = START_NS + PERIOD_NS * np.arange(COUNT) + list(MAKERS).index(topic)
    np.testing.assert_array_equal(raw.log_time_ns, expected)
    np.testing.assert_array_equal(raw.publish_time_ns, START_NS + PERIOD_NS * np.arange(COUNT))


def test_fields_of_a_topic_are_known(bag_directory):
    bag = open_bag(bag_directory)
    assert bag.has_field(topics.FISH_DEPTH.name, "zero_depth")
    assert not bag.has_field(topics.FISH_DEPTH.name, "spam")
    assert not bag.has_field("/no/such/topic", "zero_depth")


@pytest.mark.parametrize("topic", MAKERS)
def test_rosbags_reads_the_bag_too(bag_directory, topic):
    """An independent reader, with the definitions embedded in the bag."""
    with AnyReader([bag_directory]) as reader:
        (connection,) = [c for c in reader.connections if c.topic == topic]
        read = [
            reader.deserialize(payload, connection.msgtype)
            for _, _, payload in reader.messages([connection])
        ]
    assert len(read) == COUNT
    mine = [message for _, message in open_bag(bag_directory).messages(topic)]
    assert repr(read) == repr(mine)


def test_embedded_hash_is_the_graphs(bag_directory):
    """The hash that rosbags works out from the embedded text is the one that is stored."""
    with AnyReader([bag_directory]) as reader:
        stored = {c.msgtype: c.digest for c in reader.connections}
        for name, digest in stored.items():
            assert reader.typestore.hash_rihs01(name) == digest


def test_metadata_yaml_has_what_rosbag2_asks_for(bag_directory):
    information = YAML(typ="safe").load((bag_directory / "metadata.yaml").read_text())[
        "rosbag2_bagfile_information"
    ]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["trial_0.mcap"]
    assert information["message_count"] == COUNT * len(MAKERS)
    assert information["starting_time"]["nanoseconds_since_epoch"] == START_NS
    assert information["duration"]["nanoseconds"] == PERIOD_NS * (COUNT - 1) + len(MAKERS) - 1
    counts = {
        entry["topic_metadata"]["name"]: entry["message_count"]
        for entry in information["topics_with_message_count"]
    }
    assert counts == {name: COUNT for name in MAKERS} | {"/never/published": 0}
    for entry in information["topics_with_message_count"]:
        (profile,) = entry["topic_metadata"]["offered_qos_profiles"]
        assert len(profile) == 9
        assert entry["topic_metadata"]["type_description_hash"].startswith("RIHS01_")


def test_a_finished_bag_is_complete(bag_directory):
    bag = open_bag(bag_directory)
    assert bag.complete
    assert recorded_rig(bag).text == "name: nit  # exact\n"
    assert bag.metadata["towtank"] == {"version": "0"}
    assert sorted(path.name for path in bag_directory.iterdir()) == [
        "metadata.yaml",
        "trial_0.mcap",
    ]


def test_columns_equal_the_decoded_messages(bag_directory):
    bag = open_bag(bag_directory)
    z = bag.series(topics.TWIN_FISH.name, ["pose.pose.position.z", "pose.covariance"])
    np.testing.assert_array_equal(
        z["pose.pose.position.z"], [odometry(i).pose.pose.position.z for i in range(COUNT)]
    )
    np.testing.assert_array_equal(z["pose.covariance"][:, 35], np.arange(COUNT))
    np.testing.assert_array_equal(z["stamp_ns"], START_NS + PERIOD_NS * np.arange(COUNT))

    joints = bag.series(topics.MEASURED_JOINTS.name, ["name", "position", "velocity"])
    assert joints["name"][3].tolist() == ["crank", "carriage"]
    np.testing.assert_array_equal(joints["position"][:, 1], np.arange(COUNT))

    scans = bag.series(topics.SCANS.name, ["codes", "channel_delay_ns", "crank_count"])
    np.testing.assert_array_equal(scans["codes"][:, 0], np.arange(COUNT))
    assert scans["codes"][0, 5] == 0xFFFFFF
    np.testing.assert_array_equal(scans["channel_delay_ns"][:, 5], np.arange(COUNT))
    np.testing.assert_array_equal(scans["crank_count"], -np.arange(COUNT))

    depth = bag.series(topics.FISH_DEPTH.name, ["valid"])
    np.testing.assert_array_equal(depth["valid"], np.arange(COUNT) % 2 == 0)


def test_bytes_behind_a_message_are_no_part_of_it(tmp_path):
    """Fast CDR leaves some behind a JointState without efforts."""
    message = JointState(header=header(0), name=["crank", "carriage"], position=[1.0, 2.0])
    with BagWriter(tmp_path / "bag", [topics.MEASURED_JOINTS]) as writer:
        writer.write([RawMessage(0, 1, 1, serialize_message(message))])
    bag = open_bag(tmp_path / "bag")
    ((_, read),) = bag.messages(topics.MEASURED_JOINTS.name)
    assert read.position.tolist() == [1.0, 2.0]
    assert len(read.effort) == 0
    assert bag.series(topics.MEASURED_JOINTS.name, ["effort"])["effort"].shape == (1, 0)


def test_messages_of_changing_length_are_read_one_by_one(bag_directory):
    bag = open_bag(bag_directory)
    events = bag.series(topics.EVENTS.name, ["event"])
    assert events["event"].tolist() == ["x" * i for i in range(COUNT)]
    np.testing.assert_array_equal(events["stamp_ns"], START_NS + PERIOD_NS * np.arange(COUNT))
    values = bag.series(topics.DIAGNOSTICS.name, ["status[0].values[0].value"])
    assert values["status[0].values[0].value"].tolist() == [str(10**i) for i in range(COUNT)]


def test_an_unknown_field_is_named(bag_directory):
    bag = open_bag(bag_directory)
    with pytest.raises(
        BagError, match=f"{topics.FISH_DEPTH.name}: .*Depth has no field 'deepness'"
    ):
        bag.series(topics.FISH_DEPTH.name, ["deepness"])
    with pytest.raises(BagError, match=r"TrialEvent has no field 'cause'"):
        bag.series(topics.EVENTS.name, ["cause"])


def test_a_topic_without_messages_gives_empty_series(bag_directory):
    bag = open_bag(bag_directory)
    for topic in ("/never/published", "/not/in/the/bag"):
        series = bag.series(topic, ["data"])
        assert len(series["data"]) == 0
        assert len(series["log_time_ns"]) == 0
