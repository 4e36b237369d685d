"""Plays a recording to a node over CycloneDDS, in step with it: however busy the machine is, nothing is lost in transport.

Streams of samples are best effort: messages beyond the capacity of a node's socket are lost. So a few messages are
sent at a time, and then the node is asked something that it answers behind them, as it takes all that comes one after the other.
"""

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


def in_step(node, recording, domain):
    """Plays it, and yields each time that the node has taken what was sent. The node has `service_mapping:=cyclone`."""
    peer = Peer(domain)
    kinds = {"/stylus/pose": (PoseStamped, pose), "/stylus/wrench": (WrenchStamped, wrench)}
    writers = {topic: peer.writer(topic, kind, BEST_EFFORT) for topic, (kind, _) in kinds.items()}
    # the node hears of writers in the order in which they are made: when it answers, it knows those of the samples
    state = Client(node, domain, "arm_state", TriggerRequest, TriggerResponse, peer)
    state.introduce(0)
    messages = []
    with recording.open("rb") as file:
        for _, channel, _, read in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(list(kinds)):
            kind, convert = kinds[channel.topic]
            stamp = Time(read.header.stamp.sec, read.header.stamp.nanosec)
            made = kind(Header(stamp, read.header.frame_id), convert(read))
            messages.append(((stamp.sec, stamp.nanosec), channel.topic, made))
    # as a sensor sends them, and the node takes them
    messages.sort(key=lambda message: message[0])
    for begin in range(0, len(messages), WINDOW):
        for _, topic, message in messages[begin : begin + WINDOW]:
            writers[topic].write(message)
        state.ask(0)
        yield
    state.ask(0)


def play_in_step(node, recording, domain):
    """Plays all of it."""
    for _ in in_step(node, recording, domain):
        pass
