"""Colours and texture coordinates of a scan are on the refined mesh, as trimesh reads them."""

import igl
import numpy as np
import pytest
import trimesh
from part_of_recording import first_seconds


def colour_of(points):
    """A colour for each place, m or mm, that tells neighbours apart."""
    turned = points @ [[7.1, 3.3, 1.7], [2.9, 8.3, 4.1], [5.3, 1.9, 6.7]]
    return ((np.sin(turned) * 0.5 + 0.5) * 255).round().astype(np.uint8)


def key(points):
    """The same for places of unmoved vertices, whose mm were m in between."""
    return tuple(np.round(points, 9).ravel())


def uv_of(points, chart):
    """The first chart looks along z; the second is the same, in another corner of the image."""
    uv = points[..., :2] / 400 + 0.25
    return uv + np.where(chart, 0.5, 0.0)[..., None]


@pytest.fixture(scope="module")
def demo(demo_folder, tmp_path_factory):
    """Folder of a recording of the first touches, and the scan."""
    folder, scan = tmp_path_factory.mktemp("touched"), trimesh.load(demo_folder / "scan.ply", process=False)
    first_seconds(demo_folder / "touch.mcap", 12, folder / "touch.mcap")
    return folder, np.asarray(scan.vertices), np.asarray(scan.faces)


def refine(touchup, folder, scan, out):
    done = touchup("refine", "--scan", scan, "--bag", folder / "touch.mcap", "--tip-radius-mm", 1.5, "--out", out)
    assert done.returncode == 0, done.stderr
    return done


def closest(vertices, faces, points):
    """Closest points of the surface, and their faces."""
    squared = igl.point_mesh_squared_distance(np.asarray(points, dtype=float), vertices, faces.astype(np.int64))
    return squared[2], squared[1].ravel()


@pytest.mark.parametrize(("name", "alpha"), [("scan.ply", False), ("scan.ply", True), ("scan.obj", False)])
def test_vertices_have_the_colour_of_the_scan(touchup, demo, tmp_path, name, alpha):
    folder, vertices, faces = demo
    colours = colour_of(vertices)
    path, out = tmp_path / name, tmp_path / f"refined.{name[-3:]}"
    if name.endswith("obj"):
        lines = [f"v {x!r} {y!r} {z!r} {r / 255} {g / 255} {b / 255}" for (x, y, z), (r, g, b) in zip(vertices.tolist(), colours)]
        path.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]))
    else:
        extra = np.arange(len(vertices), dtype=np.uint8)[:, None]
        shown = np.hstack([colours, extra]) if alpha else colours
        write_ply(path, vertices, shown, faces)
    refine(touchup, folder, path, out)
    mesh = trimesh.load(out, process=False, maintain_order=True)
    found = np.asarray(mesh.visual.vertex_colors)
    points = np.asarray(mesh.vertices)
    row_of = {key(p): row for row, p in enumerate(vertices)}
    rows = np.array([row_of.get(key(p), -1) for p in points])
    kept = rows >= 0
    assert kept.sum() > 500 and (~kept).sum() > 500
    assert np.array_equal(found[kept, :3], colours[rows[kept]])
    if alpha:
        assert np.array_equal(found[kept, 3], (rows[kept] % 256))
    new = points[~kept][::7]
    _, face = closest(vertices, faces, new)
    corners = faces[face]
    nearest = corners[np.arange(len(new)), np.linalg.norm(vertices[corners] - new[:, None], axis=2).argmin(axis=1)]
    # of two equally near faces the program may take the other one
    assert np.mean((found[~kept, :3][::7] == colours[nearest]).all(axis=1)) > 0.97


def write_ply(path, vertices, colours, faces):
    names = ["red", "green", "blue", "alpha"][: colours.shape[1]]
    with open(path, "w") as out:
        out.write(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n")
        out.write("".join(f"property double {c}\n" for c in "xyz") + "".join(f"property uchar {c}\n" for c in names))
        out.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        for p, c in zip(vertices.tolist(), colours):
            out.write(" ".join(map(repr, p)) + " " + " ".join(map(str, c)) + "\n")
        out.writelines(f"3 {a} {b} {c}\n" for a, b, c in faces)


def write_textured(path, vertices, faces, uv):
    """Each corner of each face with its own texture coordinates."""
    if path.suffix == ".obj":
        lines = ["mtllib scan.mtl"] + [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += [f"vt {u!r} {v!r}" for u, v in uv.reshape(-1, 2).tolist()] + ["usemtl painted"]
        corners = [[f"{v + 1}/{3 * at + k + 1}" for k, v in enumerate(face)] for at, face in enumerate(faces)]
        lines += ["f " + " ".join(face) for face in corners]
        path.with_suffix(".mtl").write_text("newmtl painted\nmap_Kd board.png\n")
        path.write_text("\n".join(lines) + "\n")
        return
    with open(path, "w") as out:
        out.write(f"ply\nformat ascii 1.0\ncomment TextureFile board.png\nelement vertex {len(vertices)}\n")
        out.write("".join(f"property double {c}\n" for c in "xyz"))
        out.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\n")
        out.write("property list uchar float texcoord\nend_header\n")
        out.writelines(" ".join(map(repr, p)) + "\n" for p in vertices.tolist())
        for face, corners in zip(faces.tolist(), uv.reshape(-1, 6).tolist()):
            out.write("3 " + " ".join(map(str, face)) + " 6 " + " ".join(map(repr, corners)) + "\n")


def read_textured(path):
    """Corners, and their texture coordinates, of each face: F x 3 x 3 and F x 3 x 2; and the names of the images."""
    if path.suffix == ".obj":
        lines = [line.split() for line in path.read_text().splitlines()]
        at = lambda word: np.array([line[1:] for line in lines if line[0] == word], dtype=float)
        numbers = np.array([[w.split("/") for w in line[1:]] for line in lines if line[0] == "f"], dtype=int) - 1
        materials = path.with_suffix(".mtl").read_text().splitlines()
        images = [line.split(" ", 1)[1] for line in materials if line.startswith("map_Kd")]
        return at("v")[numbers[..., 0]], at("vt")[numbers[..., 1]], images
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    count = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    kinds = {"double": "<f8", "float": "<f4", "uchar": "u1", "uint": "<u4"}
    row = [(words[2], kinds[words[1]]) for words in map(str.split, lines) if words[0] == "property" and words[1] != "list"]
    row = [entry for entry in row if entry[0] != "texnumber"]
    vertices = np.frombuffer(body, row, count["vertex"])
    face = [("n", "u1"), ("corners", "<u4", 3), ("m", "u1"), ("uv", "<f4", (3, 2)), ("image", "<u4")]
    faces = np.frombuffer(body[vertices.nbytes :], face, count["face"])
    assert (faces["n"] == 3).all() and (faces["m"] == 6).all() and (faces["image"] == 0).all()
    points = np.stack([vertices[c] for c in "xyz"], axis=1)
    images = [line.split(" ", 2)[2] for line in lines if line.startswith("comment TextureFile")]
    return points[faces["corners"]], faces["uv"].astype(float), images


@pytest.mark.parametrize("name", ["scan.ply", "scan.obj"])
def test_faces_show_the_same_place_of_the_image(touchup, demo, tmp_path, name):
    folder, vertices, faces = demo
    chart = vertices[faces].mean(axis=1)[:, 0] > 0
    uv = uv_of(vertices[faces], chart[:, None]).astype(np.float32).astype(float)
    write_textured(tmp_path / name, vertices, faces, uv)
    (tmp_path / "elsewhere").mkdir()
    out = [tmp_path / f"refined.{name[-3:]}", tmp_path / "elsewhere" / f"refined.{name[-3:]}"]
    for path in out:
        refine(touchup, folder, tmp_path / name, path)
    corners, found, images = read_textured(out[0])
    assert images == ["board.png"]
    assert read_textured(out[1])[2] == [str(tmp_path / "board.png")]
    turned = [(np.roll(t, k, axis=0), np.roll(u, k, axis=0)) for t, u in zip(vertices[faces], uv) for k in range(3)]
    uv_at = {key(t): u for t, u in turned}
    keys = [key(t) for t in corners]
    same = [(of, uv_at[name]) for of, name in zip(found, keys) if name in uv_at]
    new = np.array([name not in uv_at for name in keys])
    assert len(same) > 500 and new.sum() > 500
    # the program has single precision, as PLY files have
    assert all(np.array_equal(a.astype(np.float32), b.astype(np.float32)) for a, b in same)
    # a new face is in one chart, at the nearest place of the scan
    middle, _ = closest(vertices, faces, corners[new].mean(axis=1))
    of_middle = found[new].mean(axis=1)
    in_second = of_middle[:, 0] > 0.5
    off = np.abs(of_middle - uv_of(middle, in_second)).max(axis=1) * 400
    assert np.percentile(off, 95) < 0.5, "mm on the part"
    spread = np.ptp(found[new], axis=1).max(axis=1) * 400
    assert spread.max() < 10, "no face reaches over the seam"
