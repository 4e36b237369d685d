"""Plays a recording to a node over CycloneDDS, in step with it: however busy the machine is, nothing is lost in transport.

Streams of samples are best effort: messages beyond the capacity of a node's socket are lost. So a few messages are
sent at a time, and then the node is asked something that it answers behind them, as it takes all that comes one after the other.
"""

import itertools

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from ros_cyclone import (
    BEST_EFFORT,
    Header,
    Peer,
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Time,
    TriggerRequest,
    TriggerResponse,
    Vector3,
    Wrench,
    WrenchStamped,
)
from ros_process import Client

# two of these fit into the buffer of a socket on Linux, which holds some 200 such messages: of the last one some may not be taken
# from it when the answer to the question behind it is sent
WINDOW = 64


def vector(kind, read, names="xyz"):
    return kind(*(getattr(read, name) for name in names))


def pose(read):
    return Pose(vector(Point, read.pose.position), vector(Quaternion, read.pose.orientation, "xyzw"))


def wrench(read):
    return Wrench(vector(Vector3, read.wrench.force), vector(Vector3, read.wrench.torque))


STAMPED = {
    "/stylus/pose": ("/stylus/pose", PoseStamped, lambda header, read: PoseStamped(header, pose(read))),
    "/stylus/wrench": ("/stylus/wrench", WrenchStamped, lambda header, read: WrenchStamped(header, wrench(read))),
}


def recorded(recording, streams=STAMPED, most=None):
    """Messages of a recording in order of their stamps, as a sensor sends them: topic and message.

    - `streams`: for each topic of the recording that on which it is played, the type, and what makes one of a header and of what was read.
    - `most`: so many of those that were recorded first; all of them where it is left out.
    """
    messages = []
    with recording.open("rb") as file:
        every = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(list(streams))
        for _, channel, _, read in itertools.islice(every, most):
            topic, _, make = streams[channel.topic]
            stamp = Time(read.header.stamp.sec, read.header.stamp.nanosec)
            messages.append(((stamp.sec, stamp.nanosec), topic, make(Header(stamp, read.header.frame_id), read)))
    messages.sort(key=lambda message: message[0])
    return [(topic, message) for _, topic, message in messages]


def sent_in_step(node, domain, kinds, messages, window=WINDOW):
    """Sends messages, and yields each time that the node has taken what was sent. The node has `service_mapping:=cyclone`.

    - `kinds`: the type of each topic; `messages`: topic and message each, or topic and what makes the message when it is sent.
    - `window`: messages that are sent at a time; fewer where they are larger than a sample.
    """
    peer = Peer(domain)
    writers = {topic: peer.writer(topic, kind, BEST_EFFORT) for topic, kind in kinds.items()}
    # the node hears of writers in the order in which they are made: when it answers, it knows those of the samples
    state = Client(node, domain, "arm_state", TriggerRequest, TriggerResponse, peer)
    state.introduce(0)
    # and has turned to their types
    node.wait_for(lambda: all(writer.get_matched_subscriptions() for writer in writers.values()))
    for begin in range(0, len(messages), window):
        for topic, message in messages[begin : begin + window]:
            writers[topic].write(message() if callable(message) else message)
        state.ask(0)
        yield
    state.ask(0)


def in_step(node, recording, domain, streams=STAMPED):
    """Plays a recording so."""
    kinds = {topic: kind for topic, kind, _ in streams.values()}
    return sent_in_step(node, domain, kinds, recorded(recording, streams))


def play_in_step(node, recording, domain, streams=STAMPED):
    """Plays all of it."""
    for _ in in_step(node, recording, domain, streams):
        pass
