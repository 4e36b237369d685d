"""Copies of recordings with some of their messages."""

import struct

from mcap.reader import make_reader
from mcap.writer import Writer


def ns(stamp):
    return stamp["sec"] * 10**9 + stamp["nanosec"]


def copy_part(recording, out, is_kept):
    """Copies the messages of a recording, a file or a session's folder, that `is_kept` accepts by topic and stamp, ns; returns the number
    of others.
    """
    left_out = 0
    with open(out, "wb") as file:
        writer, channels = Writer(file), {}
        writer.start(profile="ros2")
        for part in sorted(recording.glob("*.mcap")) if recording.is_dir() else [recording]:
            for schema, channel, message in make_reader(part.open("rb")).iter_messages(log_time_order=False):
                # behind the four bytes of the encoding a message begins with its header
                sec, nanosec = struct.unpack_from("<iI", message.data, 4)
                if not is_kept(channel.topic, sec * 10**9 + nanosec):
                    left_out += 1
                    continue
                if channel.topic not in channels:
                    known = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, known)
                times = message.log_time, message.data, message.publish_time, message.sequence
                writer.add_message(channels[channel.topic], *times)
        writer.finish()
    return left_out


def first_seconds(recording, seconds, out):
    """Copies the beginning of a recording; the copy."""
    stamps = []
    copy_part(recording, out, lambda _, stamp_ns: stamps.append(stamp_ns))
    until = min(stamps) + seconds * 10**9
    copy_part(recording, out, lambda _, stamp_ns: stamp_ns < until)
    return out
