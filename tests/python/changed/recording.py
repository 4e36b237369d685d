"""A recording of poses and wrenches (MCAP of ROS 2): read into arrays in mm, N and s, and written as it was."""

import struct
from dataclasses import dataclass, field, replace

import numpy as np
import zstandard
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 1, 2, 3, 4, 5, 6, 15
MESSAGES_OF_CHUNK = 10_000


def message_of(numbers):
    """A record of a message whose payload is a header with a short frame, and numbers: 7 of a pose, 6 of a wrench."""
    head = [("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
    payload = [("cdr", "V4"), ("sec", "<i4"), ("nanosec", "<u4"), ("frame", "V16"), ("values", "<f8", numbers)]
    return np.dtype(head + payload)


@dataclass
class Stream:
    """Messages of one topic, in the order of the file."""

    # as records of the file, and their places in it
    messages: np.ndarray
    number: np.ndarray
    # stamps, s from the first pose on
    time_s: np.ndarray
    # pose: mm and a quaternion x, y, z, w; wrench: N and N m
    values: np.ndarray

    def kept(self, is_kept):
        return Stream(self.messages[is_kept], self.number[is_kept], self.time_s[is_kept], self.values[is_kept])

    def in_order(self):
        """Indices in the order of the stamps."""
        return np.argsort(self.time_s, kind="stable")


@dataclass
class Recording:
    """What the stylus recorded: poses in the frame of the part, and the part's force on it in its own axes."""

    # schemas and channels, as records of the file
    head: bytes
    epoch_ns: int
    pose: Stream
    wrench: Stream
    # of the case: duration_s, middle_mm of the touched surface, meta, rng
    facts: dict = field(default_factory=dict)

    def place_mm(self):
        return self.pose.values[:, :3]

    def turns(self):
        return Rotation.from_quat(self.pose.values[:, 3:])

    def force_n(self):
        return self.wrench.values[:, :3]

    def wrench_time_s(self):
        """Times of the wrenches by the clock of the poses, as the case was made."""
        return self.wrench.time_s - 1e-3 * self.facts["meta"]["wrench_clock_offset_ms"]

    def turns_of_wrenches(self):
        """Orientation of the stylus at the nearest pose of each wrench."""
        order = self.pose.in_order()
        nearest = np.rint(np.interp(self.wrench_time_s(), self.pose.time_s[order], np.arange(len(order))))
        return self.turns()[order[nearest.astype(int)]]

    def force_of_part(self):
        """Force in the axes of the part, N, at each pose."""
        order = self.wrench.in_order()
        times, force = self.wrench_time_s()[order], self.turns_of_wrenches().apply(self.force_n())[order]
        return np.column_stack([np.interp(self.pose.time_s, times, column) for column in force.T])

    def with_poses(self, values):
        return replace(self, pose=replace(self.pose, values=values))

    def with_place(self, place_mm):
        return self.with_poses(np.hstack([place_mm, self.pose.values[:, 3:]]))

    def with_turns(self, turns):
        return self.with_poses(np.hstack([self.place_mm(), turns.as_quat()]))

    def with_force(self, force_n):
        return replace(self, wrench=replace(self.wrench, values=np.hstack([force_n, self.wrench.values[:, 3:]])))


def read(path):
    """A recording of two topics with poses and wrenches."""
    rows, numbers = {7: [], 6: []}, {7: [], 6: []}
    of_schema = {"geometry_msgs/msg/PoseStamped": 7, "geometry_msgs/msg/WrenchStamped": 6}
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        for number, (schema, channel, message) in enumerate(reader.iter_messages(log_time_order=False)):
            body = struct.pack("<HIQQ", channel.id, message.sequence, message.log_time, message.publish_time) + message.data
            rows[of_schema[schema.name]].append(record(MESSAGE, body))
            numbers[of_schema[schema.name]].append(number)
    head = b"".join(
        record(SCHEMA, struct.pack("<H", of.id) + packed(of.name) + packed(of.encoding) + packed(of.data)) for of in summary.schemas.values()
    )
    for of in summary.channels.values():
        metadata = b"".join(packed(key) + packed(value) for key, value in of.metadata.items())
        body = struct.pack("<HH", of.id, of.schema_id) + packed(of.topic) + packed(of.message_encoding) + packed(metadata)
        head += record(CHANNEL, body)
    messages = [np.frombuffer(b"".join(rows[size]), message_of(size)) for size in (7, 6)]
    stamps = [of["sec"].astype(np.int64) * 10**9 + of["nanosec"] for of in messages]
    epoch_ns = int(stamps[0][0])
    units = [[1e3] * 3 + [1] * 4, [1] * 6]
    streams = [
        Stream(of, np.array(number), (stamp - epoch_ns) * 1e-9, of["values"] * unit)
        for of, number, stamp, unit in zip(messages, numbers.values(), stamps, units)
    ]
    return Recording(head, epoch_ns, *streams)


def write(path, recording):
    """Stamps and numbers as they are now, all else as it was read; numbers in single precision, as the cases are."""
    rows = []
    for of, unit in ((recording.pose, [1e-3] * 3 + [1] * 4), (recording.wrench, [1] * 6)):
        messages = of.messages.copy()
        stamp = np.rint(of.time_s * 1e9).astype(np.int64) + recording.epoch_ns
        messages["sec"], messages["nanosec"] = stamp // 10**9, stamp % 10**9
        messages["values"] = (of.values * unit).astype(np.float32)
        raw, size = messages.tobytes(), messages.itemsize
        rows += [raw[at : at + size] for at in range(0, len(raw), size)]
    logged = np.concatenate([of.messages["log"] for of in (recording.pose, recording.wrench)])
    order = np.argsort(np.concatenate([recording.pose.number, recording.wrench.number]))
    with path.open("wb") as file:
        file.write(MAGIC + record(HEADER, packed("ros2") + packed("changed")) + recording.head)
        for first in range(0, len(order), MESSAGES_OF_CHUNK):
            of_chunk = order[first : first + MESSAGES_OF_CHUNK]
            file.write(chunk(b"".join([rows[at] for at in of_chunk]), int(logged[of_chunk].min()), int(logged[of_chunk].max())))
        file.write(record(DATA_END, bytes(4)) + record(FOOTER, bytes(20)) + MAGIC)


def chunk(records, first_ns, last_ns):
    squeezed = zstandard.ZstdCompressor(level=1).compress(records)
    head = struct.pack("<QQQI", first_ns, last_ns, len(records), 0) + packed("zstd")
    return record(CHUNK, head + struct.pack("<Q", len(squeezed)) + squeezed)


def record(op, body):
    return struct.pack("<BQ", op, len(body)) + body


def packed(text):
    text = text.encode() if isinstance(text, str) else text
    return struct.pack("<I", len(text)) + text
