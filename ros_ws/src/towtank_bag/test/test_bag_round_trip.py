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
from towtank_bag.qos_profile import OfferedQos
from towtank_bag.reader import open_bag
from towtank_bag.writer import Attachment, BagWriter, RawMessage, Topic
from towtank_interfaces.msg import (
    AdcScan,
    CableState,
    CrankMotion,
    Depth,
    HeaveRatio,
    Inclination,
    TrialEvent,
)

START_NS = 1_750_000_000_123_456_789
PERIOD_NS = 10_000_000
SENSOR = OfferedQos("best_effort", "volatile", 50)
LATCHED = OfferedQos("reliable", "transient_local", 100)


def stamp(index: int) -> Time:
    seconds, nanoseconds = divmod(START_NS + index * PERIOD_NS, 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def header(index: int, frame: str = "fish_pressure") -> Header:
    return Header(stamp=stamp(index), frame_id=frame)


def odometry(index: int) -> Odometry:
    message = Odometry(header=header(index, "tank"), child_frame_id="fish")
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
        header=header(index), status=[DiagnosticStatus(name="/recorder", values=values)]
    )


MAKERS = {
    "/measured/adc_scan": lambda i: AdcScan(
        header=header(i),
        sequence=i,
        board_ticks=20_000 * i,
        valid_mask=63,
        codes=[i, 2, 3, 4, 5, 0xFFFFFF],
        channel_delay_ns=[-1, 2, 3, 4, 5, i],
        crank_count=-i,
        carriage_count=2 * i,
    ),
    "/measured/fish/pressure": lambda i: FluidPressure(header=header(i), fluid_pressure=9e3 + i),
    "/measured/fish/depth": lambda i: Depth(header=header(i), depth=0.1 * i, valid=i % 2 == 0),
    "/measured/fish/imu": lambda i: Imu(header=header(i)),
    "/measured/fish/inclination": lambda i: Inclination(header=header(i), pitch=0.1 * i),
    "/measured/crank_motion": lambda i: CrankMotion(header=header(i), heave=0.1 * i, zeroed=i > 1),
    "/measured/joint_states": lambda i: JointState(
        header=header(i),
        name=["crank", "carriage"],
        position=[0.1 * i, i],
        velocity=[1.0, 2.0],
        effort=[0.0, 0.0],
    ),
    "/twin/fish/odometry": odometry,
    "/twin/cable_state": cable_state,
    "/measured/heave_ratio": lambda i: HeaveRatio(header=header(i), value=0.2 + i),
    "/trial/events": lambda i: TrialEvent(header=header(i), event="x" * i),
    "/rig": lambda i: String(data=f"name: {i}"),
    "/diagnostics": diagnostics,
}
COUNT = 12


def type_name(message) -> str:
    return f"{type(message).__module__.split('.')[0]}/msg/{type(message).__name__}"


@pytest.fixture(scope="module")
def bag_directory(tmp_path_factory):
    directory = tmp_path_factory.mktemp("bags") / "trial"
    topics = [Topic(name, type_name(make(0)), SENSOR) for name, make in MAKERS.items()]
    topics.append(Topic("/never/published", "std_msgs/msg/String", LATCHED))
    rig = Attachment("rig.yaml", "application/yaml", b"name: nit  # exact\n")
    with BagWriter(directory, topics, [rig], {"towtank": {"version": "0"}}) as writer:
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
    assert bag.has_field("/measured/fish/depth", "zero_depth")
    assert not bag.has_field("/measured/fish/depth", "spam")
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
    assert bag.rig_text == "name: nit  # exact\n"
    assert bag.metadata["towtank"] == {"version": "0"}
    assert sorted(path.name for path in bag_directory.iterdir()) == [
        "metadata.yaml",
        "trial_0.mcap",
    ]


def test_columns_equal_the_decoded_messages(bag_directory):
    bag = open_bag(bag_directory)
    z = bag.series("/twin/fish/odometry", ["pose.pose.position.z", "pose.covariance"])
    np.testing.assert_array_equal(
        z["pose.pose.position.z"], [odometry(i).pose.pose.position.z for i in range(COUNT)]
    )
    np.testing.assert_array_equal(z["pose.covariance"][:, 35], np.arange(COUNT))
    np.testing.assert_array_equal(z["stamp_ns"], START_NS + PERIOD_NS * np.arange(COUNT))

    joints = bag.series("/measured/joint_states", ["name", "position", "velocity"])
    assert joints["name"][3].tolist() == ["crank", "carriage"]
    np.testing.assert_array_equal(joints["position"][:, 1], np.arange(COUNT))

    scans = bag.series("/measured/adc_scan", ["codes", "channel_delay_ns", "crank_count"])
    np.testing.assert_array_equal(scans["codes"][:, 0], np.arange(COUNT))
    assert scans["codes"][0, 5] == 0xFFFFFF
    np.testing.assert_array_equal(scans["channel_delay_ns"][:, 5], np.arange(COUNT))
    np.testing.assert_array_equal(scans["crank_count"], -np.arange(COUNT))

    depth = bag.series("/measured/fish/depth", ["valid"])
    np.testing.assert_array_equal(depth["valid"], np.arange(COUNT) % 2 == 0)


def test_bytes_behind_a_message_are_no_part_of_it(tmp_path):
    """Fast CDR leaves some behind a JointState without efforts."""
    message = JointState(header=header(0), name=["crank", "carriage"], position=[1.0, 2.0])
    with BagWriter(tmp_path / "bag", [Topic("/joints", type_name(message), SENSOR)]) as writer:
        writer.write([RawMessage(0, 1, 1, serialize_message(message))])
    bag = open_bag(tmp_path / "bag")
    ((_, read),) = bag.messages("/joints")
    assert read.position.tolist() == [1.0, 2.0]
    assert len(read.effort) == 0
    assert bag.series("/joints", ["effort"])["effort"].shape == (1, 0)


def test_messages_of_changing_length_are_read_one_by_one(bag_directory):
    bag = open_bag(bag_directory)
    events = bag.series("/trial/events", ["event"])
    assert events["event"].tolist() == ["x" * i for i in range(COUNT)]
    np.testing.assert_array_equal(events["stamp_ns"], START_NS + PERIOD_NS * np.arange(COUNT))
    values = bag.series("/diagnostics", ["status[0].values[0].value"])
    assert values["status[0].values[0].value"].tolist() == [str(10**i) for i in range(COUNT)]


def test_an_unknown_field_is_named(bag_directory):
    bag = open_bag(bag_directory)
    with pytest.raises(BagError, match=r"/measured/fish/depth: .*Depth has no field 'deepness'"):
        bag.series("/measured/fish/depth", ["deepness"])
    with pytest.raises(BagError, match=r"TrialEvent has no field 'cause'"):
        bag.series("/trial/events", ["cause"])


def test_a_topic_without_messages_gives_empty_series(bag_directory):
    bag = open_bag(bag_directory)
    for topic in ("/never/published", "/not/in/the/bag"):
        series = bag.series(topic, ["data"])
        assert len(series["data"]) == 0
        assert len(series["log_time_ns"]) == 0
