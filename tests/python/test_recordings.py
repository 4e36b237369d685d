"""Independent readers open the recordings of touchup, and agree on their content.

TOUCHUP_BIN names the touchup program; `touchup demo --out DIR` makes the recording.
"""

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

POSE, WRENCH = "/stylus/pose", "/stylus/wrench"
TYPES = {POSE: "geometry_msgs/msg/PoseStamped", WRENCH: "geometry_msgs/msg/WrenchStamped"}


def numbers(message):
    """Stamp, frame and all numbers of a pose or wrench."""
    stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    if hasattr(message, "pose"):
        position, orientation = message.pose.position, message.pose.orientation
        values = [position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w]
    else:
        force, torque = message.wrench.force, message.wrench.torque
        values = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    return stamp_ns, message.header.frame_id, values


@pytest.fixture(scope="module")
def recording(demo_folder):
    return demo_folder / "touch.mcap"


@pytest.fixture(scope="module")
def by_rosbags(recording):
    found = {POSE: [], WRENCH: []}
    with AnyReader([recording], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == TYPES
        for connection, log_ns, payload in reader.messages():
            found[connection.topic].append((log_ns, *numbers(reader.deserialize(payload, connection.msgtype))))
    return found


def test_two_independent_readers_agree_on_every_value(recording, by_rosbags):
    found = {POSE: [], WRENCH: []}
    with recording.open("rb") as file:
        for _, channel, raw, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            found[channel.topic].append((raw.log_time, *numbers(message)))
    assert len(found[POSE]) > 1000 and len(found[WRENCH]) > 1000
    assert found == by_rosbags


def test_stamps_rise_and_are_the_log_times(by_rosbags):
    for messages in by_rosbags.values():
        stamps = [stamp_ns for _, stamp_ns, _, _ in messages]
        assert stamps == sorted(set(stamps))
        assert stamps == [log_ns for log_ns, _, _, _ in messages]


def test_each_topic_has_one_frame_and_poses_have_unit_quaternions(by_rosbags):
    for messages in by_rosbags.values():
        frames = {frame for _, _, frame, _ in messages}
        assert len(frames) == 1 and "" not in frames
    for _, _, _, values in by_rosbags[POSE]:
        assert abs(sum(q * q for q in values[3:]) - 1) < 1e-12


def test_container_is_what_rosbag2_writes(recording, by_rosbags):
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert sum(1 for _ in reader.iter_messages()) == sum(map(len, by_rosbags.values()))
    counts = {c.topic: summary.statistics.channel_message_counts[i] for i, c in summary.channels.items()}
    assert counts == {topic: len(messages) for topic, messages in by_rosbags.items()}
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    for channel in summary.channels.values():
        assert channel.message_encoding == "cdr"
        assert "offered_qos_profiles" in channel.metadata
        schema = summary.schemas[channel.schema_id]
        assert (schema.name, schema.encoding) == (TYPES[channel.topic], "ros2msg")


def test_schema_text_defines_the_types_of_ros(recording):
    """Each part of the text parses to the fields that rosbags knows for Humble."""
    humble = get_typestore(Stores.ROS2_HUMBLE)
    with recording.open("rb") as file:
        schemas = list(make_reader(file).get_summary().schemas.values())
    assert sorted(schema.name for schema in schemas) == sorted(TYPES.values())
    for schema in schemas:
        first, *parts = schema.data.decode().split("=" * 80 + "\n")
        named = [(schema.name, first)]
        for part in parts:
            head, text = part.split("\n", 1)
            package, name = head.removeprefix("MSG: ").split("/")
            named.append((f"{package}/msg/{name}", text))
        for name, text in named:
            assert get_types_from_msg(text, name)[name][1] == humble.fielddefs[name][1], name
