"""A scan much finer than the tip, made here of an engraved part: its detail stays in agreement with touch, and its lids go.

The part is a solid of manifold3d, the scan a height field of NumPy with the part's holes and slot closed over, a wide bump, and noise; only
the touches are touchup's. Distances are libigl's. The picture in docs/dense.png:

    target/python/bin/python tests/python/test_dense.py out
    target/python/bin/python tests/python/render.py docs/dense.png out/scan.ply out/refined.ply out/truth.ply
"""

import subprocess
import sys
from pathlib import Path

import igl
import numpy as np
import trimesh
from manifold3d import Manifold

from test_appearance import write_ply

# mm
SIZE = np.array([60.0, 40.0, 8.0])
HOLES = [(-20.0, -10.0, 3.5), (0.0, -11.0, 2.6), (20.0, -10.0, 4.0)]
LINES, DEPTH, WIDTH = [4.0 + 1.5 * at for at in range(7)], 0.15, 0.5
EDGE, NOISE = 0.15, 0.003


def part():
    """A plate with its top at z = 0, three holes, and lines engraved along x."""
    solid = Manifold.cube(SIZE.tolist()).translate([-SIZE[0] / 2, -SIZE[1] / 2, -SIZE[2]])
    for x, y, radius in HOLES:
        solid -= Manifold.cylinder(30, radius, radius, 128).translate([x, y, -20])
    for y in LINES:
        solid -= Manifold.cube([40, WIDTH, 1]).translate([-20, y, -DEPTH])
    mesh = solid.to_mesh()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)


def engraved(x, y):
    """Depth of the lines, with flanks of a fifth of a mm as a scanner sees them."""
    from_line = np.min([abs(y - (line + WIDTH / 2)) for line in LINES], axis=0)
    inside = np.minimum(WIDTH / 2 - from_line, 20 - abs(x))
    return -DEPTH * np.clip(inside / 0.2 + 0.5, 0, 1)


def bump(x, y):
    """The scan lies up to 0.12 mm too high."""
    return 0.12 * np.exp(-(((x - 5) / 25) ** 2) - ((y - 5) / 20) ** 2)


def scan():
    """The top, and walls down to z = -5, as an open sheet, and beside it some of the table; colours as printed."""
    half = SIZE[:2] / 2
    count = np.round(SIZE[:2] / EDGE).astype(int)
    x, y = np.meshgrid(np.linspace(-half[0], half[0], count[0] + 1), np.linspace(-half[1], half[1], count[1] + 1), indexing="ij")
    top = np.stack([x, y, engraved(x, y) + bump(x, y)], axis=-1)
    number = np.arange(x.size).reshape(x.shape)
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    depths = np.arange(0.4, 5.1, 0.4)
    wall = np.concatenate([top.reshape(-1, 3)[rim] - [0, 0, depth] for depth in depths])
    rings = np.vstack([rim, x.size + np.arange(len(wall)).reshape(len(depths), -1)])
    quads = [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)]
    quads += [np.stack([low, np.roll(low, -1), np.roll(high, -1), high], axis=-1) for high, low in zip(rings, rings[1:])]
    points = np.concatenate([top.reshape(-1, 3), wall])
    x, y = np.meshgrid(np.arange(45, 60, 0.3), np.arange(-10, 10, 0.3), indexing="ij")
    number = len(points) + np.arange(x.size).reshape(x.shape)
    quads += [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)]
    points = np.concatenate([points, np.stack([x, y, np.full(x.shape, -SIZE[2])], axis=-1).reshape(-1, 3)])
    quads = np.concatenate(quads)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points = points + np.random.default_rng(3).normal(0, NOISE, points.shape)
    printed = (np.hypot(points[:, 0] - 22, points[:, 1] - 12) < 4) | (abs(points[:, 1] + 18) < 0.6)
    return points, faces, np.where(printed[:, None], [40, 90, 170], [205, 205, 200]).astype(np.uint8)


def touched_and_refined(touchup, folder):
    """Truth, scan and refined mesh as files in `folder`."""
    part().export(folder / "part.stl")
    done = touchup("simulate", "--truth", folder / "part.stl", "--out", folder, "--seed", 4)
    assert done.returncode == 0, done.stderr
    points, faces, colours = scan()
    write_ply(folder / "scan.ply", points, colours, faces)
    refined = ["--out", folder / "refined.ply", "--features-out", folder / "features.json", "--json"]
    done = touchup("refine", "--scan", folder / "scan.ply", "--bag", folder / "touch.mcap", "--tip-radius-mm", 1.5, *refined)
    assert done.returncode == 0, done.stderr
    return done


def off(mesh, points):
    """Distances of points to a mesh, mm."""
    vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    return np.sqrt(igl.point_mesh_squared_distance(np.asarray(points, dtype=float), vertices, faces)[0])


def test_detail_stays_where_it_agrees_with_touch_and_holes_open(touchup, tmp_path):
    touched_and_refined(touchup, tmp_path)
    points, faces, _ = scan()
    before = trimesh.Trimesh(points, faces, process=False)
    after = trimesh.load(tmp_path / "refined.ply", process=False)
    truth = trimesh.load(tmp_path / "truth.ply", process=True)
    # the engraved field, by a ball's radius inside
    on_truth, _ = trimesh.sample.sample_surface(truth, 400_000, seed=1)
    is_engraved = (abs(on_truth[:, 0]) < 18) & (on_truth[:, 1] > 4) & (on_truth[:, 1] < 13.5) & (on_truth[:, 2] > -1)
    there = on_truth[is_engraved]
    [was, now] = [np.percentile(off(mesh, there), [50, 95]) for mesh in (before, after)]
    print(f"engraved field: {len(there)} points, median and p95 {was.round(4)} mm before, {now.round(4)} mm after")
    assert len(there) > 3000
    assert now[0] < was[0] / 4 and now[1] < was[1] / 2
    # the floor of the lines is there: the ball, which cannot reach it, would have left it half a sagitta deep
    height = floor_height(after)
    print(f"floor of the lines at {height:.4f} mm")
    assert abs(height + DEPTH) < 0.02
    # no face of the refined mesh obstructs a pin in a hole; below the plate, at the turn of the ball, the test says nothing
    middle = np.asarray(after.triangles_center)
    for x, y, radius in HOLES:
        is_in_the_way = (np.hypot(middle[:, 0] - x, middle[:, 1] - y) < 0.8 * radius) & (middle[:, 2] > -7)
        assert not is_in_the_way.any(), (x, y)
    # untouched vertices are as scanned, to the last bit that a file in mm keeps
    support = np.asarray(after.metadata["_ply_raw"]["vertex"]["data"]["support"]).ravel()
    untouched = np.round(np.asarray(after.vertices)[support == 0], 9)
    table = np.round(points[points[:, 0] > 40], 9)
    assert set(map(tuple, table)) <= set(map(tuple, untouched)) and off(before, untouched).max() < 1e-6


def floor_height(mesh):
    """Median height in the middle of the lines, mm."""
    vertices = np.asarray(mesh.vertices)
    is_floor = np.zeros(len(vertices), dtype=bool)
    for line in LINES:
        is_floor |= (abs(vertices[:, 0]) < 15) & (abs(vertices[:, 1] - line - WIDTH / 2) < 0.08)
    return np.median(vertices[is_floor & (vertices[:, 2] > -1), 2])


def main(folder):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    program = Path(__file__).resolve().parents[2] / "target/release/touchup"

    def touchup(*arguments):
        return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)

    print(touched_and_refined(touchup, folder).stderr)


if __name__ == "__main__":
    main(sys.argv[1])
