"""`touchup node` and `touchup replay` as two processes: the same result as `touchup refine`, whatever happens to them."""

import contextlib
import itertools
import json
import os
import random
import signal
import subprocess
import time

import numpy
import pytest
import trimesh
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from part_of_recording import copy_part
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
    UndoRequest,
    UndoResponse,
    Vector3,
    Wrench,
    WrenchStamped,
)
from ros_domains import domains
from ros_player import in_step, play_in_step
from ros_process import Client, Node, Process
from scipy.spatial import KDTree
from test_ros_follower import Follower


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
# a disk that refused is asked again
ASKS_AGAIN_S = 1.0


def test_a_played_recording_gives_the_files_of_refine(demo_folder, tmp_path, touchup_bin, domain):
    recording = demo_folder / "touch.mcap"
    with Node(touchup_bin, tmp_path, "--scene", scene_for(demo_folder, tmp_path), domain=domain, ros=CYCLONE) as node:
        play_in_step(node, recording, domain)
        assert node.end() == 0, node.text()
        report = node.report()
    assert report["lost"] == report["dropped"] == [0, 0] and report["unrecorded"] == 0
    for name in ["refined.ply", "features.json", "touches.csv"]:
        assert (node.session / name).read_bytes() == (demo_folder / name).read_bytes(), name
    assert stamps(node.session / "recording", "/stylus/pose") == sorted(stamps(recording, "/stylus/pose"))


def test_a_killed_node_leaves_all_that_was_on_the_disk(demo_folder, tmp_path, touchup, touchup_bin, domain):
    """In the midst of a stroke, by kill -9. How soon it is on the disk is tested where a test moves the clock."""
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
    resumed, again = tmp_path / "resumed.ply", tmp_path / "again.ply"
    done = touchup("refine", "--resume", node.session, "--out", resumed)
    assert done.returncode in (0, 4), done.stderr
    whole = ["--scan", demo_folder / "scan.ply", "--bag", node.session / "recording", "--scene", node.session / "scene.yaml"]
    done = touchup("refine", *whole, "--out", again)
    assert done.returncode in (0, 4), done.stderr
    assert resumed.read_bytes() == again.read_bytes()
    # and it is all that was played up to there
    assert taken == sorted(stamps(recording, "/stylus/wrench"))[: len(taken)]


def test_a_stroke_is_taken_back_while_it_runs(demo_folder, tmp_path, touchup, touchup_bin, domain):
    scene = scene_for(demo_folder, tmp_path)
    with Node(touchup_bin, tmp_path, "--scene", scene, domain=domain, ros=CYCLONE) as node:
        undo = Client(node, domain, "undo", UndoRequest, UndoResponse)
        # nothing was touched yet
        assert not undo.introduce(1).success
        play_in_step(node, demo_folder / "touch.mcap", domain)
        undone = undo.ask(1)
        assert undone.success, undone.message
        assert node.end(signal.SIGTERM) in (0, 4), node.text()
    done = touchup("refine", "--resume", node.session, "--out", tmp_path / "resumed.ply")
    assert done.returncode in (0, 4), done.stderr
    refined = (node.session / "refined.ply").read_bytes()
    assert refined == (tmp_path / "resumed.ply").read_bytes() != (demo_folder / "refined.ply").read_bytes()


def test_who_comes_late_sees_what_is_saved(demo_folder, tmp_path, touchup_bin, domain):
    scene = scene_for(demo_folder, tmp_path)
    with Node(touchup_bin, tmp_path, "--scene", scene, domain=domain, ros=CYCLONE) as node:
        save = Client(node, domain, "save_mesh", SaveMeshRequest, SaveMeshResponse)
        assert not save.introduce("../nowhere.ply", False, False).success
        play_in_step(node, demo_folder / "touch.mcap", domain)
        reader = Peer(domain).reader("/mesh", Marker, LATCHED)
        answer = save.ask("now.ply", False, False)
        assert answer.success, answer.message
        saved = trimesh.load(answer.path, process=False)
        assert (len(saved.vertices), len(saved.faces)) == (answer.vertex_count, answer.face_count)
        kept, tiles = KDTree(saved.vertices), {}

        def is_what_was_saved():
            came = reader.take(100)
            tiles.update((tile.id, tile) for tile in came)
            corners = numpy.array([(point.x, point.y, point.z) for tile in tiles.values() for point in tile.points]) * 1e3
            if not came or abs(len(corners) / 3 - len(saved.faces)) >= 0.01 * len(saved.faces):
                return False
            # live, the skin is made bit by bit, saved all at once
            shares = [(one.query(other)[0] < 0.01).mean() for one, other in [(KDTree(corners), saved.vertices), (kept, corners)]]
            return min(shares) > 0.95

        node.wait_for(is_what_was_saved)
        assert node.end() in (0, 4), node.text()


def in_order(vertices, faces):
    """A mesh as it is however its vertices and faces are numbered: places as float32 in m, faces by their places."""
    places = {vertex: tuple(float(numpy.float32(x)) for x in place[:3]) for vertex, place in vertices}
    turned = []
    for corners in faces:
        at = [places[int(corner)] for corner in corners]
        turned.append(min(tuple(at[k:] + at[:k]) for k in range(3)))
    return numpy.array(sorted(turned), numpy.float32).tobytes()


def test_a_follower_that_loses_messages_has_the_bytes_that_are_saved(demo_folder, tmp_path, touchup_bin, domain):
    scene, pick = scene_for(demo_folder, tmp_path), random.Random(5)
    with Node(touchup_bin, tmp_path, "--scene", scene, domain=domain, ros=CYCLONE) as node:
        save = Client(node, domain, "save_mesh", SaveMeshRequest, SaveMeshResponse)
        resync = Client(node, domain, "resync_mesh", ResyncMeshRequest, ResyncMeshResponse)
        reader = Peer(domain).reader("/mesh_patch", MeshPatch, RELIABLE)
        follower = Follower(lambda: resync.ask("", 0))
        save.introduce("../nowhere.ply", False, False)
        resync.introduce("", 0)
        play_in_step(node, demo_folder / "touch.mcap", domain)
        lost, versions = 0, []

        def follows(loss):
            nonlocal lost
            for patch in reader.take(1000):
                if pick.random() < loss:
                    lost += 1
                else:
                    follower.take(patch)
            follower.tick()
            return not follower.is_waiting

        node.wait_for(lambda: follows(0.1) or lost > 5)

        def is_saved():
            follows(0.0)
            answer = save.ask(f"try{len(versions)}.ply", False, False)
            versions.append(answer.mesh_version)
            return answer.mesh_version == follower.version != 0 and answer

        answer = []
        node.wait_for(lambda: answer.append(is_saved()) or answer[-1])
        assert lost > 0
        assert (answer[-1].vertex_count, answer[-1].face_count) == (len(follower.vertices), len(follower.faces))
        saved = trimesh.load(answer[-1].path, process=False)
        of_file = in_order(enumerate(numpy.asarray(saved.vertices) * 1e-3), saved.faces)
        assert of_file == in_order(follower.vertices.items(), follower.faces.values())
        # at rest all that was touched gets its variance: the square of what the file has
        touched, variances = [], []

        def is_known():
            follows(0.0)
            places = follower.vertices.values()
            touched[:] = [place[:3] for place in places if place[4] == 1]
            variances[:] = [place[3] for place in places if place[4] == 1]
            return len(touched) > 1000 and numpy.isfinite(variances).all()

        node.wait_for(is_known)
        sigmas = saved.metadata["_ply_raw"]["vertex"]["data"]["sigma_mm"].ravel()
        far, at = KDTree(saved.vertices).query(numpy.array(touched) * 1e3)
        assert far.max() < 1e-3 and numpy.abs(numpy.sqrt(variances) * 1e3 / sigmas[at] - 1).max() < 1e-3
        assert in_order(follower.vertices.items(), follower.faces.values()) == of_file
        assert node.end() in (0, 4), node.text()


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
                header = Header(Time(1_700_000_000, at * 1_000_000), "")
                wrenches.write(WrenchStamped(header, Wrench(Vector3(0, 0, 1), Vector3(0, 0, 0))))
                poses.write(PoseStamped(header, Pose(Point(0, 0, 0), Quaternion(0, 0, 0, 1))))
            said.extend(log for log in logs.take(100) if "frame_id" in log.msg)
            shown.extend(status for array in states.take(100) for status in array.status if "frame_id" in status.message)
            return said and shown

        node.wait_for(is_said)
        assert (said[0].name, said[0].level) == ("cell_b.touchup", 30)
        assert (shown[0].name, shown[0].level) == ("cell_b/touchup: session", 1)
        assert "/cell_b/touchup" in shown[0].hardware_id
        assert node.end() in (0, 3, 4), node.text()
        assert "ROS_STATIC_PEERS=192.0.2.7 is not heeded" in node.text()


def first_seconds(recording, seconds, out):
    """A copy of the beginning of a recording."""
    until = min(stamps(recording, "/stylus/pose")) + seconds * 10**9
    copy_part(recording, out, lambda _, stamp_ns: stamp_ns < until)
    return out


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
            # twice what the disk holds
            for _ in itertools.islice(steps, 300):
                pass
            node.wait_for(lambda: "does not record, make room on the disk" in node.text())
            # not a byte is left, only names: it tries to begin a file, and cannot
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
