"""Plays a recording to a node over CycloneDDS, in step with it: on a machine of any load, no message is lost in transport.

Streams of samples are best effort: the network drops messages beyond the capacity of a node's socket. So the player sends a few messages at
a time, and then asks the node something that it answers behind them, since it takes arrivals one after the other.
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

# two of these fit into the buffer of a socket on Linux, which holds some 200 such messages: the node may not have taken some of the last
# one from it when it sends the answer to the question behind it
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

    - `streams`: for each topic of the recording the played topic, the type, and a function of a header and the recorded message that makes
      one.
    - `most`: number of messages from the beginning of the recording; all of them without it.
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
    """Sends messages, and yields each time that the node has taken the sent ones. The node has `service_mapping:=cyclone`.

    - `kinds`: the type of each topic; `messages`: topic and message each, or topic and a function that makes the message at its sending.
    - `window`: number of messages at a time; fewer for those larger than a sample.
    """
    peer = Peer(domain)
    writers = {topic: peer.writer(topic, kind, BEST_EFFORT) for topic, kind in kinds.items()}
    # the node hears of writers in the order of their creation: when it answers, it knows those of the samples
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
