"""Small inputs under the names that the pages use, and prebuilt programs for blocks that build."""

import json
import os
import shutil
import sys

import calibration_recordings
import numpy
import trimesh
from conftest import ROOT
from part_of_recording import copy_part
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation, Slerp

# of the recording to the space of the tracker
PAIRS = "scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm"


GRID = """\
scan: scan.ply
scene: scene.yaml
recordings: [monday.mcap, tuesday.mcap]
keys: {contact.on_n: [0.3, 0.4]}
"""


def make_inputs(touchup, folder):
    """The part: a ring with a hole of 8 mm through 5 mm, with the outputs of a scanner, a stylus and a calibration."""
    part = trimesh.creation.annulus(r_min=4.0, r_max=11.0, height=5.0, sections=96)
    for name in ("part.stl", "truth.stl", "part.ply"):
        part.export(folder / name)
    done(touchup("simulate", "--truth", folder / "part.stl", "--out", folder / "made", "--seed", 3))
    for name in ("scan.ply", "touch.mcap"):
        shutil.move(folder / "made" / name, folder / name)
    shutil.rmtree(folder / "made")
    (folder / "my_recording").mkdir()
    shutil.copy(folder / "touch.mcap", folder / "my_recording")
    samples = list(samples_of(folder / "touch.mcap"))
    write_table(folder / "robot_data.csv", samples)
    tip = ["--tip-radius-mm", 1.5]
    refined = ["--out", folder / "refined.ply", "--touches-out", folder / "touches.csv", "--features-out", folder / "features.json"]
    done(touchup("refine", "--scan", folder / "scan.ply", "--bag", folder / "touch.mcap", *tip, *refined))
    done(touchup("init", folder / "cell.yaml", *tip))
    plate = (ROOT / "examples/plate_nominal.csv").read_text(encoding="utf-8").splitlines()
    rows = [line for line in plate if line.startswith(("name,", "through-hole diameter"))]
    (folder / "bore.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    write_arm(folder / "arm.urdf")
    # a sweep
    for name in ("monday.mcap", "tuesday.mcap"):
        begin = samples[len(samples) // 2][0]
        copy_part(folder / "touch.mcap", folder / name, lambda _, ns: begin <= ns < begin + 5 * 10**9)
    (folder / "scene.yaml").write_text("tip: {radius_mm: 1.5}\n", encoding="utf-8")
    (folder / "grid.yaml").write_text(GRID, encoding="utf-8")
    return samples


def write_arm(path):
    """An arm of six joints that turn about z, y, y, x, y, x, each 0.2 m from the one before."""
    links = ["base_link", *(f"link_{i}" for i in range(1, 6)), "tool0"]
    parts = [f'<link name="{link}"/>' for link in links]
    for i, axis in enumerate(["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]):
        limit = '<limit lower="-3" upper="3" velocity="1" effort="100"/>'
        ends = f'<parent link="{links[i]}"/><child link="{links[i + 1]}"/><origin xyz="0 0 0.2"/><axis xyz="{axis}"/>'
        parts.append(f'<joint name="joint_{i + 1}" type="revolute">{ends}{limit}</joint>')
    path.write_text("\n".join(['<robot name="arm">', *parts, "</robot>"]) + "\n", encoding="utf-8")


def make_calibrations(folder, samples):
    """The recordings of docs/calibration.md, and the same touches as a tracker and a sensor have them before any calibration."""
    made = calibration_recordings
    made.write_file(folder / "swing.mcap", made.swing())
    made.write_file(folder / "still.mcap", made.still())
    in_space = made.SPACE_TURN.apply(made.POINTS_MM) + made.SPACE_MM
    rows = [",".join(map(str, pair)) for pair in numpy.hstack([made.POINTS_MM, in_space])]
    (folder / "pairs.csv").write_text("\n".join([PAIRS, *rows]) + "\n", encoding="utf-8")
    rng = numpy.random.default_rng(4)

    def tracked():
        for ns, place_mm, turn, force, _ in samples:
            place = made.SPACE_TURN.apply(place_mm - turn.apply(made.OFFSET_MM)) + made.SPACE_MM
            carried, torque = made.loaded(made.SPACE_TURN * turn, rng)
            yield ns, place, made.SPACE_TURN * turn, force + carried, torque

    made.write_bag(folder / "my_recording", tracked())


def samples_of(recording):
    """At every fourth wrench: ns, place, mm, turn, and force and torque in the axes of the tip."""
    poses, wrenches = [], []
    with AnyReader([recording], default_typestore=calibration_recordings.store) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            if connection.topic == "/stylus/pose":
                at, to = message.pose.position, message.pose.orientation
                poses.append([ns, at.x, at.y, at.z, to.x, to.y, to.z, to.w])
            elif connection.topic == "/stylus/wrench":
                wrenches.append([ns, *([of.x, of.y, of.z] for of in (message.wrench.force, message.wrench.torque))])
    poses = numpy.array(sorted(poses))
    # a fourth of them is enough here
    wrenches = [of for of in sorted(wrenches) if poses[0, 0] <= of[0] <= poses[-1, 0]][::4]
    stamps = numpy.array([ns for ns, _, _ in wrenches])
    places = 1e3 * numpy.stack([numpy.interp(stamps, poses[:, 0], poses[:, axis]) for axis in (1, 2, 3)], axis=1)
    turns = Slerp(poses[:, 0], Rotation.from_quat(poses[:, 4:]))(stamps)
    for (ns, force, torque), place, turn in zip(wrenches, places, turns, strict=True):
        yield ns, place, turn, numpy.array(force), numpy.array(torque)


def write_table(path, samples):
    rows = ["t_s,x_mm,y_mm,z_mm,fx_n,fy_n,fz_n"]
    for ns, place, turn, force, _ in samples:
        rows.append(",".join(f"{number:.6f}" for number in [ns * 1e-9, *place, *turn.apply(force)]))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def make_programs(folder, touchup_bin, features):
    """The built `touchup`, and a `cargo run` of the programs built beside it, for the PATH of a block.

    A demo is the same each time, so it runs once and blocks copy it. Exit code 4, done with losses, is as good as 0 here.
    """
    folder.mkdir()
    known = {"program": str(touchup_bin), "made": str(folder / "demos"), "features": features}
    for name in ("touchup", "cargo"):
        path = folder / name
        path.write_text(f"#!{sys.executable}\n" + PROGRAM.replace("KNOWN", json.dumps(known)), encoding="utf-8")
        path.chmod(0o755)


PROGRAM = '''
import os, shutil, subprocess, sys
known = KNOWN
program, arguments = known["program"], sys.argv[1:]
if os.path.basename(sys.argv[0]) == "cargo":
    if arguments[:1] != ["run"] or "--" not in arguments:
        sys.exit("only cargo run is run here: mark the block")
    end = arguments.index("--")
    own, arguments = arguments[1:end], arguments[end + 1 :]
    while own:
        word = own.pop(0)
        if word == "--example":
            program = os.path.join(os.path.dirname(program), "examples", own.pop(0))
        elif word == "--features":
            unknown = set(own.pop(0).split(",")) - set(known["features"])
            if unknown:
                sys.exit(f"Cargo.toml has no feature {unknown}")
        elif word != "--release":
            sys.exit(f"of cargo run {word} is not known here")
made = os.path.join(known["made"], "_".join(arguments))
if arguments[:1] == ["demo"] and os.path.isdir(made):
    shutil.copytree(made, "out", dirs_exist_ok=True)
    sys.exit(0)
code = subprocess.run([program, *arguments]).returncode
if arguments[:1] == ["demo"] and code == 0:
    shutil.copytree("out", made)
sys.exit(0 if code == 4 else code)
'''


def path_with(folder):
    return f"{folder}{os.pathsep}{os.environ['PATH']}"


def done(ended):
    assert ended.returncode in (0, 4), ended.stderr
