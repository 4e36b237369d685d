"""Poses and wrenches of any type that recordings may have, live: the node takes and records the sent numbers.

CycloneDDS publishes; the node finds the types by itself. The result of a recording does not depend on its writer.
"""

import subprocess
import time
from dataclasses import astuple, replace

import franka_state
import numpy as np
import pytest
from cyclonedds.idl.types import array, float64, sequence
from ros_cyclone import (
    BEST_EFFORT,
    RELIABLE,
    DiagnosticArray,
    Header,
    Peer,
    Pose,
    PoseStamped,
    Quaternion,
    Time,
    Vector3,
    Wrench,
    WrenchStamped,
    message,
)
from ros_domains import domains
from ros_player import STAMPED, pose, recorded, sent_in_step
from ros_process import Node
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation
from test_recordings import POSE, WRENCH, numbers
from test_ros_node import CYCLONE, scene_for


# between two poses of the demo, with jitter
MOST_HELD_NS = 10_000_000


def stamp_ns(read):
    return read.header.stamp.sec * 10**9 + read.header.stamp.nanosec


@message("geometry_msgs/msg/PoseWithCovariance")
class PoseWithCovariance:
    pose: Pose
    covariance: array[float64, 36]


@message("geometry_msgs/msg/PoseWithCovarianceStamped")
class PoseWithCovarianceStamped:
    header: Header
    pose: PoseWithCovariance


@message("geometry_msgs/msg/Twist")
class Twist:
    linear: Vector3
    angular: Vector3


@message("geometry_msgs/msg/TwistWithCovariance")
class TwistWithCovariance:
    twist: Twist
    covariance: array[float64, 36]


@message("nav_msgs/msg/Odometry")
class Odometry:
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@message("geometry_msgs/msg/Transform")
class Transform:
    translation: Vector3
    rotation: Quaternion


@message("geometry_msgs/msg/TransformStamped")
class TransformStamped:
    header: Header
    child_frame_id: str
    transform: Transform


@message("tf2_msgs/msg/TFMessage")
class TFMessage:
    transforms: sequence[TransformStamped]


@message("sensor_msgs/msg/Temperature")
class Temperature:
    header: Header
    temperature: float64
    variance: float64


COVARIANCE = [float(number) for number in range(36)]


@pytest.fixture
def domain():
    return next(domains)


def transform(header, child, read):
    p, q = read.pose.position, read.pose.orientation
    return TransformStamped(header, child, Transform(Vector3(p.x, p.y, p.z), Quaternion(q.x, q.y, q.z, q.w)))


def with_covariance(read):
    return PoseWithCovariance(pose(read), COVARIANCE)


def odometry(header, read):
    twist = TwistWithCovariance(Twist(Vector3(7.0, 8.0, 9.0), Vector3(1.0, 2.0, 3.0)), COVARIANCE)
    return Odometry(header, "tool0", with_covariance(read), twist)


KINDS = {
    "Odometry": (Odometry, odometry),
    "PoseWithCovarianceStamped": (PoseWithCovarianceStamped, lambda h, read: PoseWithCovarianceStamped(h, with_covariance(read))),
    "TransformStamped": (TransformStamped, lambda h, read: transform(h, "tool0", read)),
}


# of the 74 s of the demo: enough for some windows of the player, and a stroke and more
FEW, STROKE = 1_000, 7_500


def row_of(one):
    """Stamp, and all numbers of a PoseStamped or WrenchStamped."""
    made = one.wrench if isinstance(one, WrenchStamped) else one.pose
    return one.header.stamp.sec * 10**9 + one.header.stamp.nanosec, [number for part in astuple(made) for number in part]


def recorded_by(node):
    """PoseStamped and WrenchStamped in the node's recording: of each topic stamps and numbers, and the frame."""
    found, frames = {POSE: [], WRENCH: []}, {}
    parts = sorted((node.session / "recording").glob("*.mcap"))
    with AnyReader(parts, default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, payload in reader.messages():
            stamp, frames[connection.topic], row = numbers(reader.deserialize(payload, connection.msgtype))
            found[connection.topic].append((stamp, row))
    return found, frames


def assert_nothing_is_lost(node, count):
    """At its end a node has taken all but some of `count` messages: one without a partner is no sample."""
    report = node.report()
    assert report["lost"] == report["dropped"] == [0, 0] and report["accepted"] > 0.4 * count, report


@pytest.mark.parametrize("name", KINDS)
def test_a_pose_of_another_type_is_taken_as_the_same_pose(demo_folder, tmp_path, touchup_bin, domain, name):
    kind, make = KINDS[name]
    plain = recorded(demo_folder / "touch.mcap", most=FEW)
    played = recorded(demo_folder / "touch.mcap", {**STAMPED, POSE: (POSE, kind, make)}, most=FEW)
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=CYCLONE) as node:
        for _ in sent_in_step(node, domain, {POSE: kind, WRENCH: WrenchStamped}, played):
            pass
        assert node.end() in (0, 4), node.text()
        assert_nothing_is_lost(node, FEW)
    sent = {POSE: [], WRENCH: []}
    for topic, one in plain:
        sent[topic].append(row_of(one))
    assert recorded_by(node)[0] == sent


def test_transforms_of_unlike_rates_give_the_pose_of_their_product(demo_folder, tmp_path, touchup_bin, domain):
    """A link at the rate of the poses, and one at a tenth of it, which moves to and fro by 1 mm; NumPy interpolates it here."""
    messages = recorded(demo_folder / "touch.mcap", most=FEW)
    poses = [row_of(one) for topic, one in messages if topic == POSE]
    stamps = np.array([stamp for stamp, _ in poses])
    frame, begin = next(one.header.frame_id for topic, one in messages if topic == POSE), stamps[0]
    shift = 1e-3 * np.sin((stamps - begin) * 2e-9)
    is_slow = np.arange(len(poses)) % 10 == 0
    published, at = [], 0

    def link(stamp, parent, child, position, turn):
        position, turn = [float(x) for x in position], [float(x) for x in turn]
        header = Header(Time(*divmod(int(stamp), 10**9)), parent)
        published.append(("/tf", TFMessage([TransformStamped(header, child, Transform(Vector3(*position), Quaternion(*turn)))])))

    for topic, one in messages:
        stamp, row = row_of(one)
        if topic == WRENCH:
            # in the axes of the frame of the pose, by default the frame of the tool
            published.append((WRENCH, replace(one, header=Header(one.header.stamp, "tool0"))))
            continue
        back = Rotation.from_quat(row[3:]).apply([0.0, 0.0, shift[at]])
        link(stamp, frame, "arm", row[:3] - back, row[3:])
        if is_slow[at]:
            link(stamp, "arm", "tool0", [0.0, 0.0, shift[at]], [0, 0, 0, 1])
        at += 1
    ros = [*CYCLONE, "-p", f"pose_frame:=tool0 in {frame}"]
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=ros) as node:
        assert any("/tf" in line for line in node.out)
        for _ in sent_in_step(node, domain, {"/tf": TFMessage, WRENCH: WrenchStamped}, published):
            pass
        assert node.end() in (0, 4), node.text()
        report = node.report()
    assert report["lost"] == report["dropped"] == [0, 0], report
    found, frames = recorded_by(node)
    assert frames[POSE] == frame
    # until the last of the slow link
    last = np.flatnonzero(is_slow)[-1]
    assert [stamp for stamp, _ in found[POSE]] == stamps[: last + 1].tolist()
    between = np.interp(stamps - begin, stamps[is_slow] - begin, shift[is_slow])
    for (_, row), (_, sent), error in zip(found[POSE], poses, between - shift, strict=False):
        expected = sent[:3] + Rotation.from_quat(sent[3:]).apply([0.0, 0.0, error])
        assert np.abs(expected - row[:3]).max() < 1e-12 and abs(abs(np.dot(row[3:], sent[3:])) - 1) < 1e-12
    assert found[WRENCH] == [row_of(one) for topic, one in messages if topic == WRENCH]


def test_one_topic_of_a_franka_gives_pose_and_wrench_and_the_mesh_of_its_recording(demo_folder, tmp_path, touchup, touchup_bin, domain):
    """Its state has more than 2 kB, which come in fragments; the force is in the axes of the base, as the pose."""
    store, random = get_typestore(Stores.ROS2_HUMBLE), np.random.default_rng(7)
    franka_state.register(store)
    types = {}
    kind, topic, base = franka_state.cyclone_types(store, types), "/franka_robot_state_broadcaster/robot_state", "cell"

    def made(name, fields):
        return types[name](**{field: value.tolist() if isinstance(value, np.ndarray) else value for field, value in fields.items()})

    state = franka_state.drawn(store, random, made)
    assert len(state.serialize()) > 2000
    held, states, sent = None, [], {POSE: [], WRENCH: []}
    for of, read in recorded(demo_folder / "touch.mcap", most=STROKE):
        if of == POSE:
            held = read
        # an arm knows its pose as it is: in a gap of the tracker it has none
        elif held is not None and stamp_ns(read) - stamp_ns(held) < MOST_HELD_NS:
            turn = Rotation.from_quat([getattr(held.pose.orientation, axis) for axis in "xyzw"])
            force, torque = ([float(x) for x in turn.apply(astuple(part))] for part in (read.wrench.force, read.wrench.torque))
            at, one = Header(read.header.stamp, base), Wrench(Vector3(*force), Vector3(*torque))
            stamped = {"o_t_ee": PoseStamped(at, held.pose), "o_f_ext_hat_k": WrenchStamped(at, one)}
            states.append((topic, replace(state, header=at, **stamped)))
            sent[POSE].append(row_of(stamped["o_t_ee"]))
            sent[WRENCH].append(row_of(stamped["o_f_ext_hat_k"]))
    ros = [*CYCLONE, "-r", f"/stylus/pose:={topic}", "-r", f"/stylus/wrench:={topic}"]
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=ros) as node:
        for _ in sent_in_step(node, domain, {topic: kind}, states, window=8):
            pass
        assert node.end() in (0, 4), node.text()
        assert_nothing_is_lost(node, len(states))
        assert node.report()["contacts"] > 0
    assert recorded_by(node)[0] == sent
    # live the axes of its forces come from the message, of a recording from its first header
    out = tmp_path / "resumed.ply"
    done = touchup("refine", "--resume", node.session, "--out", out)
    assert done.returncode in (0, 4), done.stderr
    assert (node.session / "refined.ply").read_bytes() == out.read_bytes()


def test_what_has_no_stamp_counts_when_it_comes(demo_folder, tmp_path, touchup_bin, domain):
    """PoseWithCovarianceStamped as now, Wrench without a header."""
    sent = {POSE: [], WRENCH: []}

    def sending(topic, one):
        def make():
            stamp = time.time_ns()
            sent[topic].append((stamp, row_of(one)[1]))
            if topic == WRENCH:
                return one.wrench
            return PoseWithCovarianceStamped(Header(Time(*divmod(stamp, 10**9)), "cell"), PoseWithCovariance(one.pose, COVARIANCE))

        return make

    messages = [(topic, sending(topic, one)) for topic, one in recorded(demo_folder / "touch.mcap", most=FEW)]
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=CYCLONE) as node:
        for _ in sent_in_step(node, domain, {POSE: PoseWithCovarianceStamped, WRENCH: Wrench}, messages):
            pass
        assert node.end() in (0, 4), node.text()
        assert_nothing_is_lost(node, FEW)
    # only the node knows the arrival of a wrench: after its sending, and in that order
    found, frames = recorded_by(node)
    came = [stamp for stamp, _ in found[WRENCH]]
    assert came == sorted(came) and all(0 <= stamp - at < 10**9 for stamp, (at, _) in zip(came, sent[WRENCH], strict=True))
    assert found[POSE] == sent[POSE] and [row for _, row in found[WRENCH]] == [row for _, row in sent[WRENCH]]
    # in the axes of its sensor, as that of a recording is that has no header beside a pose with one
    assert frames[WRENCH] == "stylus"


def test_a_type_that_cannot_be_read_is_one_clear_error_until_one_comes_that_can(demo_folder, tmp_path, touchup_bin, domain):
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=CYCLONE) as node:
        peer, said = Peer(domain), []
        diagnostics = peer.reader("/diagnostics", DiagnosticArray, RELIABLE)
        wrong = peer.writer("/stylus/wrench", Temperature, BEST_EFFORT)

        def says(*words):
            said.extend((one.status[0].level, one.status[0].message) for one in diagnostics.take(10))
            return any(level == 2 and all(word in text for word in words) for level, text in said)

        names = ["/stylus/wrench", "somebody publishes sensor_msgs/msg/Temperature, not geometry_msgs/msg/WrenchStamped", "FrankaRobotState"]
        node.wait_for(lambda: says("cannot read what is published", *names))
        node.wait_for(lambda: all(any(name in line for line in node.err) for name in names))
        # the node hears a publisher of readable messages all the same
        right = Peer(domain).writer("/stylus/wrench", Wrench, BEST_EFFORT)
        node.wait_for(right.get_matched_subscriptions)
        said.clear()
        right.write(Wrench(Vector3(1.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0)))

        def is_quiet():
            said.extend((one.status[0].level, one.status[0].message) for one in diagnostics.take(10))
            return said and "cannot read" not in said[-1][1]

        node.wait_for(is_quiet)
        assert wrong is not None
        assert node.end() in (0, 4), node.text()


def test_a_parameter_names_a_type_that_gives_a_pose(tmp_path, touchup_bin):
    for value, words in [
        ("sensor_msgs/msg/Imu", ["pose_type is sensor_msgs/msg/Imu, not geometry_msgs/msg/PoseStamped", "Odometry"]),
        ("tf2_msgs/msg/TFMessage", ["pose_type is tf2_msgs/msg/TFMessage", "pose_frame"]),
    ]:
        done = subprocess.run(
            [str(touchup_bin), "node", "--ros-args", "-p", f"pose_type:={value}"], capture_output=True, text=True, timeout=60, cwd=tmp_path
        )
        assert done.returncode == 2 and all(word in done.stderr for word in words), done.stderr
