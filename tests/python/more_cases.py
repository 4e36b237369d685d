"""python tests/python/more_cases.py TOUCHUP OUT: the judged cases in other frames, and other parts, as a table on stdout.

Turned and shifted recordings show the influence of a part's place in the lattice; `touchup simulate` scans and touches the other parts,
which show tuning on the judged ones. It takes ten minutes.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import trimesh
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
sys.path.insert(0, str(SHARED / "judge"))
import judge  # noqa: E402
from common import closest, load_mesh, scene_of  # noqa: E402

RADIUS_MM, STIFFNESS_N_PER_MM = 1.5, 20.0
KNOWN = ["--mesh-unit", "mm", "--tip-radius-mm", str(RADIUS_MM), "--stiffness-n-per-mm", str(STIFFNESS_N_PER_MM)]
AXIS = np.array([1, 2, 3]) / 14**0.5
# name: turn about AXIS in degrees, shift in mm
FRAMES = {"turned": (33, [3.3, 1.7, -2.1]), "shifted": (0, [0.31, 0.17, 0.23]), "elsewhere": (0, [-0.11, 0.44, 0.52])}
# delay of the simulated wrench, s; largest distance of a touching ball from the surface, mm; its least force, N
LATE_S, TOUCHING_MM, PRESSED_N = 1.8e-3, 0.2, 0.6


def other_frame(case, out, degrees, shift):
    """The case with everything turned and shifted."""
    turn, shift = Rotation.from_rotvec(np.radians(degrees) * AXIS), np.array(shift)
    out.mkdir(parents=True, exist_ok=True)
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = turn.as_matrix(), shift
    for name in ["truth.ply", "scan.ply"]:
        mesh = trimesh.load(case / name, process=False)
        mesh.apply_transform(place)
        mesh.export(out / name)
    oracle = dict(np.load(case / "oracle.npz"))
    for key in ["contacts", "centres"]:
        oracle[key] = (turn.apply(oracle[key]) + shift).astype(np.float32)
    oracle["R"] = turn.as_matrix() @ oracle["R"]
    np.savez(out / "oracle.npz", **oracle)
    features = json.loads((case / "truth_features.json").read_text())
    for feature in features["features"]:
        for key in {"center_mm", "axis", "direction", "points_mm"} & feature.keys():
            moved = turn.apply(np.array(feature[key], float)) + (shift if key.endswith("_mm") else 0)
            feature[key] = moved.tolist()
    (out / "truth_features.json").write_text(json.dumps(features))
    with open(case / "touch.mcap", "rb") as old, open(out / "touch.mcap", "wb") as new:
        writer, channels = Writer(new), {}
        writer.start(profile="ros2")
        for schema, channel, message in make_reader(old).iter_messages(log_time_order=False):
            if channel.topic not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                encoding, metadata = channel.message_encoding, dict(channel.metadata)
                channels[channel.topic] = writer.register_channel(channel.topic, encoding, known, metadata)
            data = message.data
            if channel.topic.endswith("pose"):
                # the last seven doubles of a PoseStamped: position and orientation; wrenches are in the stylus' own frame
                pose = np.frombuffer(data[-56:], "<f8").copy()
                pose[:3] = turn.apply(pose[:3]) + shift * 1e-3
                pose[3:] = (turn * Rotation.from_quat(pose[3:])).as_quat()
                data = data[:-56] + pose.tobytes()
            times = message.log_time, data, message.publish_time, message.sequence
            writer.add_message(channels[channel.topic], *times)
        writer.finish()


def parts():
    """Names and closed meshes in mm, from parts that played no role in development."""

    def load(name, unit_mm):
        mesh = trimesh.load(SHARED / "data/parts/permissive" / name, force="mesh")
        mesh.merge_vertices()
        mesh = max(mesh.split(), key=lambda body: body.volume)
        mesh.apply_scale(unit_mm)
        return mesh

    def turned(mesh, degrees):
        mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), [1, 0, 0]))
        mesh.apply_translation(-mesh.bounds[0])
        return mesh

    def cropped(mesh, low, high):
        box = trimesh.creation.box(bounds=[low, high])
        return trimesh.boolean.intersection([mesh, box], engine="manifold")

    def topmost(mesh, height):
        low, high = mesh.bounds
        return cropped(mesh, [*(low[:2] - 1), high[2] - height], high + 1)

    def centred(mesh):
        mesh.apply_translation(-mesh.bounds.mean(0))
        return mesh

    yield "bearing riser", load("trimesh_idler_riser.STL", 25.4)
    yield "wedge bracket", topmost(turned(load("crs_ee2.stl", 1000), 90), 30)
    yield "wedge bracket, standing", topmost(load("crs_ee2.stl", 1000), 30)
    yield "octagonal pockets", cropped(load("trimesh_octagonal_pocket.stl", 1000), [60, 40, -1], [130, 110, 30])
    yield "fandisk", topmost(load("trimesh_fandisk.obj", 35), 35)
    block = turned(load("trimesh_featuretype.STL", 25.4), 180)
    yield "featuretype from behind", cropped(block, [10, 0, 10], [75, 63.5, 60])
    plate = centred(load("trimesh_counter.unitsmm.STL", 1))
    yield "flange with bolt holes", cropped(plate, [-35, 95, -50], [35, 160, 50])
    plate = centred(load("godel_Tool_Mounting_Plate.STL", 1000))
    yield "tool mounting plate", cropped(plate, [-40, -40, -50], [30, 30, 50])
    yield "flange from behind", turned(load("crs_ee3.stl", 1000), -90)


def simulated(touchup, part, out):
    """Scan, recording, and the truly touched places of the ball, as far as its recording shows."""
    out.mkdir(parents=True, exist_ok=True)
    part.apply_translation(-part.bounds[0])
    part.export(out / "part.stl")
    files = ["--truth", out / "part.stl", "--mesh-unit", "mm", "--out", out]
    subprocess.run([touchup, "simulate", *files], check=True, stdout=subprocess.DEVNULL)
    poses, forces = [], []
    with open(out / "touch.mcap", "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
            if channel.topic.endswith("pose"):
                p, q = message.pose.position, message.pose.orientation
                poses.append([stamp, p.x, p.y, p.z, q.x, q.y, q.z, q.w])
            elif channel.topic.endswith("wrench"):
                f = message.wrench.force
                forces.append([stamp, f.x, f.y, f.z])
    poses, forces = (np.array(rows)[np.argsort([row[0] for row in rows])] for rows in [poses, forces])

    def smooth(columns, count):
        return np.stack([np.convolve(column, np.ones(count) / count, "same") for column in columns.T], 1)

    inner = slice(5, -5)
    position, stamps = smooth(poses[:, 1:4] * 1e3, 7)[inner], poses[inner, 0]
    smoothed = smooth(forces[:, 1:], 9)
    force = np.stack([np.interp(stamps + LATE_S, forces[:, 0], column) for column in smoothed.T], 1)
    force = Rotation.from_quat(poses[inner, 4:]).apply(force)
    centres = position + force / STIFFNESS_N_PER_MM
    truth = load_mesh(str(out / "truth.ply"))
    feet, _ = closest(scene_of(truth.vertices, truth.faces), centres)
    is_near = abs(np.linalg.norm(feet - centres, axis=1) - RADIUS_MM) < TOUCHING_MM
    contacts = feet[is_near & (np.linalg.norm(force, axis=1) > PRESSED_N)]

    def voxel_set(points):
        _, first = np.unique(np.round(points / 0.1).astype(int), axis=0, return_index=True)
        return points[np.sort(first)].astype(np.float32)

    np.savez(out / "oracle.npz", contacts=voxel_set(contacts), centres=voxel_set(centres), r=RADIUS_MM, R=np.eye(3))
    (out / "truth_features.json").write_text('{"features": []}')


def row(touchup, name, case):
    files = ["--scan", case / "scan.ply", "--bag", case / "touch.mcap", "--out", case / "refined.ply"]
    subprocess.run([touchup, "refine", *files, *KNOWN], check=True, stdout=subprocess.DEVNULL)
    scan, refined = (judge.judge(str(case), str(case / file)) for file in ["scan.ply", "refined.ply"])
    means = " / ".join(f"{refined['touched'][side]['mean']:.3f}" for side in ["truth_to_mesh", "mesh_to_truth"])
    missing, health = refined["missing"], refined["health"]
    rims = f"{missing['open_rim_mm']:.0f} ({missing['scan_open_rim_mm']:.0f})"
    flipped = f"{health['flipped_faces']} ({scan['health']['flipped_faces']})"
    crossing = health["self_intersecting_faces"]
    print(f"| {name} | {means} | {missing['lost_share'] * 100:.2f} | {rims} | {flipped} | {crossing} |", flush=True)


def main(touchup, out):
    print("| | t2m / m2t | lost % | open rims (scan's own), mm | flipped (scan's own) | intersecting |")
    print("|---|---|---|---|---|---|")
    for case in ["plate", "flange", "featuretype"]:
        for name, (degrees, shift) in FRAMES.items():
            folder = out / f"{case}_{name}"
            other_frame(SHARED / "data/cases" / case, folder, degrees, shift)
            row(touchup, f"{case}, {name}", folder)
    for name, part in parts():
        folder = out / name.replace(" ", "_").replace(",", "")
        simulated(touchup, part, folder)
        row(touchup, name, folder)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]))
