"""`touchup refine --mode paper` against the published rule written out.

Per sample: the face with the closest barycentre (Eq 12), the tip against its plane (Eq 1-3), b* and n* carried over the held sample by an
integrator of SciPy (Eq 6, 7), the corners of the face moved with them, and the one-ring around it after them by Laplacian surface editing
with uniform weights, as a dense linear system (Sec 4.3). It shares nothing with the program: no closed form, no tree, no sparse solver.

The program comes from the environment variable TOUCHUP_BIN, or target/release/touchup.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.integrate import solve_ivp

BIN = os.environ.get("TOUCHUP_BIN", str(Path(__file__).parents[2] / "target/release/touchup"))
# Sec 4, in SI; the paper leaves f_max open
F_MAX, H_MIN, DELTA, ALPHA, BETA = 10.0, 0.5e-3, 5.0, 0.1, 0.1
PERIOD_S = 5e-3
# of the part, which is 40 mm long
TOLERANCE_M = 1e-9 * 40e-3


def uneven_sheet(rng, cells=10, edge_mm=4.0):
    """A sheet with waves, 0.2 mm of noise on each coordinate, in mm as its file has it."""
    x, y = np.meshgrid(np.arange(cells + 1) * edge_mm, np.arange(cells + 1) * edge_mm)
    z = 1.5 * np.sin(x / 7.0) * np.cos(y / 9.0)
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) + rng.normal(0.0, 0.2, ((cells + 1) ** 2, 3))
    at = lambda i, j: j * (cells + 1) + i
    faces = []
    for j in range(cells):
        for i in range(cells):
            faces += [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    return vertices, np.array(faces)


def stroke(rng, vertices, radius_mm):
    """Centre of the ball, mm, and force, N, of each sample: pressing, sliding, lifted off, hovering, through the sheet."""
    count = 240
    t = np.arange(count) / count
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x = low[0] + (0.25 + 0.5 * t) * (high[0] - low[0])
    y = low[1] + (0.5 + 0.2 * np.sin(9.0 * t)) * (high[1] - low[1])
    z = 1.5 * np.sin(x / 7.0) * np.cos(y / 9.0) + 0.8 * np.sin(23.0 * t) - 0.3
    centres = np.column_stack([x, y, z + radius_mm])
    size = np.clip(3.0 * np.sin(11.0 * t) + 1.0, 0.0, None)
    lean = 0.25 * np.column_stack([np.sin(5.0 * t), np.cos(3.0 * t)])
    direction = np.column_stack([lean, np.ones(count)])
    return centres, size[:, None] * direction / np.linalg.norm(direction, axis=1)[:, None]


def record(path, centres_mm, forces_n):
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    point, quaternion = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Quaternion"]
    vector, time = types["geometry_msgs/msg/Vector3"], types["builtin_interfaces/msg/Time"]

    def header(ns):
        stamp = time(sec=int(ns // 10**9), nanosec=int(ns % 10**9))
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id="object")

    with Writer(path, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        names = {"/stylus/pose": "geometry_msgs/msg/PoseStamped", "/stylus/wrench": "geometry_msgs/msg/WrenchStamped"}
        topics = {topic: writer.add_connection(topic, name, typestore=store) for topic, name in names.items()}
        for i, (centre, force) in enumerate(zip(centres_mm / 1e3, forces_n)):
            ns = 1_700_000_000_000_000_000 + i * round(PERIOD_S * 1e9)
            pose = types["geometry_msgs/msg/Pose"](position=point(*centre), orientation=quaternion(0.0, 0.0, 0.0, 1.0))
            wrench = types["geometry_msgs/msg/Wrench"](force=vector(*force), torque=vector(0.0, 0.0, 0.0))
            for topic, message in [
                ("/stylus/pose", types[names["/stylus/pose"]](header=header(ns), pose=pose)),
                ("/stylus/wrench", types[names["/stylus/wrench"]](header=header(ns), wrench=wrench)),
            ]:
                writer.write(topics[topic], ns, store.serialize_cdr(message, names[topic]))


def expected_force(h):
    """Eq 3."""
    return F_MAX / (1.0 + np.exp(np.clip(h / H_MIN + DELTA, -700.0, 700.0)))


def carried(b, n, first_n, p, force):
    """b* and n* after one sample by Eq 6 and 7."""

    def rate(_, y):
        n = y[1:]
        h = (p - b - y[0] * first_n) @ n
        expected = expected_force(h) * n
        return np.concatenate([[ALPHA * ((force - expected) @ n)], BETA * np.cross(np.cross(expected, force), n)])

    solved = solve_ivp(rate, (0.0, PERIOD_S), np.concatenate([[0.0], n]), method="DOP853", rtol=1e-13, atol=1e-16)
    assert solved.success
    end = solved.y[:, -1]
    return b + end[0] * first_n, end[1:] / np.linalg.norm(end[1:])


def turning(n, to):
    """The smallest rotation from one unit vector to another, as a matrix."""
    axis = np.cross(n, to)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + n @ to)


def literal(vertices_m, faces, centres_m, forces_n, radius_m):
    """The mesh after all samples."""
    vertices = vertices_m.copy()
    neighbours = [set() for _ in vertices]
    for a, b, c in faces:
        neighbours[a] |= {b, c}
        neighbours[b] |= {a, c}
        neighbours[c] |= {a, b}
    held, first_n = None, None
    for i, (centre, force) in enumerate(zip(centres_m, forces_n)):
        handle = int(np.argmin(np.linalg.norm(vertices[faces].mean(axis=1) - centre, axis=1)))
        corners = vertices[faces[handle]]
        b = corners.mean(axis=0)
        n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        n /= np.linalg.norm(n)
        if handle != held:
            held, first_n = handle, n
        if i == 0:
            continue
        to_b, to_n = carried(b, n, first_n, centre - radius_m * n, force)
        steps = (corners - b) @ turning(n, to_n).T + to_b - corners
        free = sorted(set().union(*(neighbours[v] for v in faces[handle])) - set(faces[handle]))
        row = {v: k for k, v in enumerate(free)}
        matrix, right = np.zeros((len(free), len(free))), np.zeros((len(free), 3))
        for v in free:
            matrix[row[v], row[v]] = len(neighbours[v])
            for other in neighbours[v]:
                if other in row:
                    matrix[row[v], row[other]] = -1.0
                elif other in faces[handle]:
                    right[row[v]] += steps[list(faces[handle]).index(other)]
        vertices[free] += np.linalg.solve(matrix, right)
        vertices[faces[handle]] += steps
    return vertices


@pytest.mark.parametrize(("radius_mm", "seed"), [(0.0, 1), (1.5, 2), (0.7, 3)])
def test_the_mode_of_the_paper_is_the_published_rule(tmp_path, radius_mm, seed):
    rng = np.random.default_rng(seed)
    vertices, faces = uneven_sheet(rng)
    centres, forces = stroke(rng, vertices, radius_mm)
    scan, out, scene = tmp_path / "scan.ply", tmp_path / "out.ply", tmp_path / "scene.yaml"
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [" ".join(repr(float(x)) for x in v) for v in vertices] + [f"3 {a} {b} {c}" for a, b, c in faces]
    scan.write_text(header + "\n".join(rows) + "\n")
    scene.write_text(f"tip: {{ radius_mm: {radius_mm} }}\nrefine: {{ mode: paper }}\n")
    record(tmp_path / "bag", centres, forces)
    command = [BIN, "refine", "--scan", scan, "--bag", tmp_path / "bag", "--scene", scene, "--out", out]
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    refined = trimesh.load(out, process=False, maintain_order=True)
    assert np.array_equal(refined.faces, faces)
    right = literal(vertices / 1e3, faces, centres / 1e3, forces, radius_mm / 1e3)
    moved = np.linalg.norm(right - vertices / 1e3, axis=1)
    off = np.linalg.norm(np.asarray(refined.vertices) / 1e3 - right, axis=1)
    print(f"moved up to {moved.max() * 1e3:.3f} mm, off by {off.max():.1e} m")
    assert moved.max() > 0.3e-3 and (moved > 1e-6).sum() > 40, "there is something to compare"
    assert off.max() < TOLERANCE_M
