"""`touchup node` as a process on a network: its files and the view of others, after any fault of theirs."""

import contextlib
import itertools
import json
import math
import os
import random
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy
import pytest
import trimesh
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from mesh_follower import Follower
from part_of_recording import first_seconds
from ros_cyclone import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    DiagnosticArray,
    HapticMismatch,
    Header,
    Log,
    Marker,
    MeshPatch,
    Peer,
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    ResyncMeshRequest,
    ResyncMeshResponse,
    SaveMeshRequest,
    SaveMeshResponse,
    Time,
    TriggerRequest,
    TriggerResponse,
    Vector3,
    Wrench,
    WrenchStamped,
)
from ros_domains import domains
from ros_player import in_step
from ros_process import Client, Node
from scipy.spatial import KDTree


@pytest.fixture
def domain():
    return next(domains)


def scene_for(demo_folder, folder):
    """A scene that names the scan of the demo, as config/demo.yaml does."""
    parts = ["sync", "clock", "contact", "sliding", "carve", "guard", "patch", "uncertainty", "refine"]
    named = f"tip:\n  radius_mm: 1.5\nscan:\n  file: {demo_folder / 'scan.ply'}\n  unit: mm\n"
    scene = folder / "scene.yaml"
    scene.write_text("".join(f"{part}:\n" for part in parts) + named)
    return scene


def stamps(recording, topic):
    """Stamps of the headers of a recording, ns; of a folder all files in the order of their names, also without their ends."""
    found, decoders = [], {}
    for path in sorted(recording.glob("*.mcap")) if recording.is_dir() else [recording]:
        with path.open("rb") as file, contextlib.suppress(EndOfFile):
            schemas, channels = {}, {}
            for record in StreamReader(file).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message) and channels[record.channel_id].topic == topic:
                    schema = schemas[channels[record.channel_id].schema_id]
                    if schema.name not in decoders:
                        decoders[schema.name] = DecoderFactory().decoder_for("cdr", schema)
                    stamp = decoders[schema.name](record.data).header.stamp
                    found.append(stamp.sec * 10**9 + stamp.nanosec)
    return found


CYCLONE = ["-p", "service_mapping:=cyclone"]
# a follower that waits for the whole state asks again after eleven of these
TICK_S = 0.1
# after a full disk the test asks again
ASKS_AGAIN_S = 1.0


def in_order(triangles):
    """Triangles in an order independent of numbering: places as float32 in m, each from its least corner on."""
    turned = numpy.asarray(triangles, numpy.float32).reshape(-1, 3, 3)
    first = numpy.array([min(range(3), key=lambda k: tuple(corners[k])) for corners in turned.tolist()])
    turned = turned[numpy.arange(len(turned))[:, None], (first[:, None] + numpy.arange(3)) % 3].reshape(-1, 9)
    return turned[numpy.lexsort(turned.T)].tobytes()


def triangles_of(follower):
    """Those that a follower has, m."""
    places = {vertex: place[:3] for vertex, place in follower.vertices.items()}
    return [[places[corner] for corner in corners] for corners in follower.faces.values()]


@dataclass
class Played:
    """Files of a node that received the demo, and the observations of others at rest."""

    folder: Path
    code: int
    # of `~/save_mesh`, and the file that it wrote
    answer: SaveMeshResponse
    saved: trimesh.Trimesh
    lost: int
    # of a follower: its triangles at the saving of the mesh, and its vertices after the arrival of their variances
    followed: bytes
    known: dict
    # and its triangles after `~/reset`
    begun_again: bytes
    # of a viewer that came when nothing moved any more
    tiles: bytes


@pytest.fixture(scope="module")
def played(demo_folder, begun, tmp_path_factory, touchup_bin):
    """Plays the beginning of the demo to a node while a follower loses one of ten changes; at rest it saves and observes the mesh, then
    comes a reset.
    """
    folder, domain, pick = tmp_path_factory.mktemp("played"), next(domains), random.Random(5)
    with Node(touchup_bin, folder, "--scene", scene_for(demo_folder, folder), domain=domain, ros=CYCLONE) as node:
        save = Client(node, domain, "save_mesh", SaveMeshRequest, SaveMeshResponse)
        resync = Client(node, domain, "resync_mesh", ResyncMeshRequest, ResyncMeshResponse)
        reset = Client(node, domain, "reset", TriggerRequest, TriggerResponse)
        changes = Peer(domain).reader("/mesh_patch", MeshPatch, RELIABLE)
        follower, lost, ticked = Follower(lambda: resync.ask("", 0)), 0, time.monotonic()

        def follow(loss=0.0):
            nonlocal lost, ticked
            for patch in changes.take(1000):
                if pick.random() < loss:
                    lost += 1
                else:
                    follower.take(patch)
            if time.monotonic() - ticked > TICK_S:
                follower.tick()
                ticked = time.monotonic()

        assert not save.introduce("../nowhere.ply", False, False, False).success
        resync.introduce("", 0)
        for _ in in_step(node, begun, domain):
            follow(0.1)
        answers = []

        def is_saved():
            follow()
            answers.append(save.ask(f"try{len(answers)}.ply", False, False, False))
            return answers[-1].mesh_version == follower.version != 0 and not follower.is_waiting

        node.wait_for(is_saved)
        saved, followed = trimesh.load(answers[-1].path, process=False), in_order(triangles_of(follower))

        def is_known():
            follow()
            touched = [place for place in follower.vertices.values() if place[4] == 1]
            return len(touched) > 1000 and all(math.isfinite(place[3]) for place in touched)

        # at rest all touched vertices get their variance
        node.wait_for(is_known)
        known = dict(follower.vertices)
        reader, tiles = Peer(domain).reader("/mesh", Marker, LATCHED), {}

        def seen():
            return [(point.x, point.y, point.z) for tile in tiles.values() for point in tile.points]

        def are_all_seen():
            tiles.update((tile.id, tile) for tile in reader.take(100))
            return len(seen()) == 3 * len(saved.faces)

        node.wait_for(are_all_seen, every_s=0.1)
        # more than once if nobody hears the answer: an untouched session begins again too
        assert reset.introduce(0).success

        def begins_again():
            follow()
            return follower.session != node.session.name and not follower.is_waiting

        node.wait_for(begins_again)
        code = node.end()
    begun_again = in_order(triangles_of(follower))
    return Played(node.session, code, answers[-1], saved, lost, followed, known, begun_again, in_order(seen()))


def test_a_played_recording_gives_the_files_of_refine(played, begun, touchup, tmp_path):
    """Over the network no message is lost or comes twice: the node's result equals that of one thread on a file."""
    report = json.loads((played.folder / "report.json").read_text())
    assert played.code == 0
    assert report["lost"] == report["dropped"] == [0, 0] and report["unrecorded"] == 0
    files = {"--out": "refined.ply", "--features-out": "features.json", "--touches-out": "touches.csv"}
    out = [word for flag, name in files.items() for word in (flag, tmp_path / name)]
    done = touchup("refine", "--scene", played.folder.parents[1] / "scene.yaml", "--bag", begun, *out)
    assert done.returncode == 0, done.stderr
    assert '"boss"' in (tmp_path / "features.json").read_text()
    for name in files.values():
        assert (played.folder / name).read_bytes() == (tmp_path / name).read_bytes(), name
    for topic in ["/stylus/pose", "/stylus/wrench"]:
        assert stamps(played.folder / "recording", topic) == sorted(stamps(begun, topic))


def test_a_follower_that_loses_messages_has_what_is_saved(played):
    assert played.lost > 5
    answer, saved = played.answer, played.saved
    assert (answer.vertex_count, answer.face_count) == (len(saved.vertices), len(saved.faces)) == (len(played.known), len(saved.faces))
    assert played.followed == in_order(saved.triangles * 1e-3)
    # the variance of touched vertices is the square of the file's value
    touched = numpy.array([place for place in played.known.values() if place[4] == 1])
    sigmas = saved.metadata["_ply_raw"]["vertex"]["data"]["sigma_mm"].ravel()
    far, at = KDTree(saved.vertices).query(touched[:, :3] * 1e3)
    assert far.max() < 1e-3 and numpy.abs(numpy.sqrt(touched[:, 3]) * 1e3 / sigmas[at] - 1).max() < 1e-3


def test_a_follower_begins_again_with_another_session(played, demo_folder):
    assert played.begun_again == in_order(trimesh.load(demo_folder / "scan.ply", process=False).triangles * 1e-3)


def test_who_comes_late_sees_what_is_saved(played):
    assert played.tiles == in_order(played.saved.triangles * 1e-3)


def test_a_killed_node_leaves_all_that_was_on_the_disk(demo_folder, tmp_path, touchup, touchup_bin, domain):
    """In the midst of a stroke, by kill -9. A test that moves the clock checks the delay to the disk."""
    recording = demo_folder / "touch.mcap"
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=CYCLONE) as node:
        reader = Peer(domain).reader("/mismatch", HapticMismatch, BEST_EFFORT)
        heard = []
        for _ in in_step(node, recording, domain):
            heard.extend(reader.take(1000))
            touching = [message.contact_case != 0 for message in heard[-200:]]
            if len(heard) > 4000 and all(touching):
                on_disk = stamps(node.session / "recording", "/stylus/wrench")
                if len(on_disk) > 1000:
                    break
        node.process.send_signal(signal.SIGKILL)
        node.wait()
    taken = stamps(node.session / "recording", "/stylus/wrench")
    assert taken[: len(on_disk)] == on_disk
    # everything played up to there
    assert taken == sorted(stamps(recording, "/stylus/wrench"))[: len(taken)]
    done = touchup("refine", "--resume", node.session, "--json")
    assert done.returncode in (0, 4), done.stderr
    assert json.loads(done.stdout)["samples"] == len(taken)


def test_samples_that_are_not_used_are_a_warning_on_diagnostics_and_rosout(demo_folder, tmp_path, touchup_bin, domain):
    scene = scene_for(demo_folder, tmp_path)
    ros = ["-r", "__ns:=/cell_b", *CYCLONE]
    options = {"domain": domain, "ros": ros, "environment": {"ROS_STATIC_PEERS": "192.0.2.7"}}
    with Node(touchup_bin, tmp_path, "--scene", scene, **options) as node:
        peer = Peer(domain)
        logs, states = peer.reader("/rosout", Log, RELIABLE), peer.reader("/diagnostics", DiagnosticArray, RELIABLE)
        wrenches = peer.writer("/cell_b/stylus/wrench", WrenchStamped, BEST_EFFORT)
        poses = peer.writer("/cell_b/stylus/pose", PoseStamped, BEST_EFFORT)
        said, shown, number = [], [], itertools.count(1)

        def is_said():
            for at in itertools.islice(number, 10):
                header = Header(Time(1_700_000_000 + at // 1000, at % 1000 * 1_000_000), "")
                wrenches.write(WrenchStamped(header, Wrench(Vector3(0, 0, 1), Vector3(0, 0, 0))))
                poses.write(PoseStamped(header, Pose(Point(0, 0, 0), Quaternion(0, 0, 0, 1))))
            said.extend(log for log in logs.take(100) if "frame_id" in log.msg)
            shown.extend(status for array in states.take(100) for status in array.status if "frame_id" in status.message)
            return said and shown

        # a late subscriber does not receive a line of the log again
        node.wait_for(lambda: logs.get_matched_publications() and states.take(1))
        node.wait_for(is_said)
        assert (said[0].name, said[0].level) == ("cell_b.touchup", 30)
        assert (shown[0].name, shown[0].level) == ("cell_b/touchup: session", 1)
        assert "/cell_b/touchup" in shown[0].hardware_id
        assert node.end() in (0, 3, 4), node.text()
        assert "ROS_STATIC_PEERS=192.0.2.7 is not heeded" in node.text()


@pytest.mark.full
def test_a_full_disk_is_reported_and_the_recording_resumes_when_there_is_room(demo_folder, tmp_path, touchup, touchup_bin, domain):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "none", disk], capture_output=True).returncode != 0:
        pytest.skip("needs root, for a disk of its own that is full")
    try:
        scene = scene_for(demo_folder, tmp_path)
        with Node(touchup_bin, disk, "--scene", scene, domain=domain, ros=CYCLONE) as node:
            recording = first_seconds(demo_folder / "touch.mcap", 20, tmp_path / "part.mcap")
            steps = in_step(node, recording, domain)
            # twice the capacity of the disk
            for _ in itertools.islice(steps, 300):
                pass
            node.wait_for(lambda: "does not record, make room on the disk" in node.text())
            # no byte is free, only names: it tries to begin a file, and cannot
            with contextlib.suppress(OSError), (disk / "other").open("wb", buffering=0) as other:
                while True:
                    other.write(bytes(4096))
            for _ in itertools.islice(steps, 100):
                time.sleep(ASKS_AGAIN_S / 50)
            subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
            for _ in steps:
                # the rest comes when it records again
                if not any(file.stat().st_size > 310_000 for file in (node.session / "recording").iterdir()):
                    time.sleep(0.02)
            code = node.end()
        assert code == 1 and "are not in the session's recording" in node.err[-1], node.text()
        report = json.loads((node.session / "report.json").read_text())
        taken = stamps(node.session / "recording", "/stylus/wrench") + stamps(node.session / "recording", "/stylus/pose")
        played = [stamp for topic in ["wrench", "pose"] for stamp in stamps(recording, f"/stylus/{topic}")]
        assert sum(report["lost"]) == report["dropped"][0] == 0
        assert report["unrecorded"] > 0 and len(taken) + report["unrecorded"] == len(played)
        assert max(taken) == max(played)
        done = touchup("refine", "--resume", node.session, "--out", tmp_path / "resumed.ply")
        assert done.returncode in (0, 4), done.stderr
    finally:
        subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["node"], 2, ["the radius of the ball is not known"]),
        (["node", "--tip-radius-mm", "1.5"], 2, ["no scan", "-p scan:=FILE"]),
        (["node", "--scene", "nowhere.yaml"], 3, ["nowhere.yaml"]),
        (["node", "--ros-args", "-p", "scan:=nowhere.ply", "-p", "tip_radius_mm:=1.5"], 3, ["nowhere.ply"]),
        (["node", "--ros-args", "-p", "view_rate_hz:=1000"], 2, ["view_rate_hz", "0.1 to 100"]),
        (["node", "--ros-args", "--remap", "x"], 2, ["FROM:=TO"]),
        (["replay", "nowhere.mcap"], 3, ["nowhere.mcap"]),
        (["replay", "nowhere.mcap", "--speed", "0"], 2, ["0.01 to 100"]),
        (["step", "--ros-args", "-p", "a:=b"], 2, ["--ros-args", "node"]),
    ],
)
def test_bad_input_is_reported(arguments, code, words, touchup, tmp_path):
    done = touchup(*arguments, cwd=tmp_path, env={**os.environ, "ROS_DOMAIN_ID": str(next(domains))})
    assert done.returncode == code, done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert not (tmp_path / "sessions").exists()
