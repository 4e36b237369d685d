"""python -m machined.sheet OUT.png FOLDER... [--columns N]: parts side by side, each as scanned, as refined, and with the features found.

The folders are those of `python -m machined`. Red faces show their backs; holes are blue, notches violet, slots orange, pockets yellow,
bosses green, cylinders grey. A depth buffer in numpy draws them: it needs no display.
"""

import argparse
import json
import struct
import zlib
from pathlib import Path

import numpy as np
import trimesh

SIZE = 180
MARGIN = 8
TOWARDS_EYE = np.array([0.45, -0.75, 1.0])
LIGHT = np.array([0.3, 0.5, 0.8])
FRONT, BACK = np.array([0.80, 0.84, 0.90]), np.array([0.80, 0.30, 0.30])
COLOURS = {
    "hole": [0.0, 0.2, 0.9],
    "notch": [0.6, 0.0, 0.8],
    "slot": [0.95, 0.45, 0.0],
    "pocket": [0.8, 0.7, 0.0],
    "boss": [0.0, 0.55, 0.1],
    "cylinder": [0.4, 0.4, 0.4],
}


class Camera:
    """A parallel projection that shows all of some points."""

    def __init__(self, points):
        towards = TOWARDS_EYE / np.linalg.norm(TOWARDS_EYE)
        right = np.cross([0.0, 0.0, 1.0], towards)
        right /= np.linalg.norm(right)
        self.axes = np.array([right, np.cross(towards, right), towards])
        seen = points @ self.axes.T
        self.low, extent = seen.min(0)[:2], np.ptp(seen[:, :2], axis=0)
        self.scale = (SIZE - 2 * MARGIN) / extent.max()
        self.shift = MARGIN + (SIZE - 2 * MARGIN - extent * self.scale) / 2

    def pixels(self, points):
        """Column, row from below, and height towards the eye."""
        seen = points @ self.axes.T
        return np.column_stack([(seen[:, :2] - self.low) * self.scale + self.shift, seen[:, 2]])


def drawn(mesh, camera):
    """A picture and its depth buffer, the lowest row first."""
    image, depth = np.ones((SIZE, SIZE, 3)), np.full((SIZE, SIZE), -np.inf)
    corners = camera.pixels(np.asarray(mesh.vertices))[mesh.faces]
    facing = mesh.face_normals @ camera.axes[2]
    shade = 0.35 + 0.65 * np.abs(mesh.face_normals @ (LIGHT / np.linalg.norm(LIGHT)) * 0.4 + facing * 0.6)
    colours = np.where(facing[:, None] > 0, FRONT, BACK) * np.clip(shade, 0, 1)[:, None]
    low = np.clip(np.floor(corners[:, :, :2].min(1)).astype(int), 0, SIZE)
    high = np.clip(np.ceil(corners[:, :, :2].max(1)).astype(int) + 1, 0, SIZE)
    for (a, b, c), (x0, y0), (x1, y1), colour in zip(corners, low, high, colours):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < 1e-9 or x0 >= x1 or y0 >= y1:
            continue
        x, y = np.meshgrid(np.arange(x0, x1), np.arange(y0, y1))
        v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        height = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
        is_in = (v >= 0) & (w >= 0) & (v + w <= 1) & (height > depth[y0:y1, x0:x1])
        depth[y0:y1, x0:x1][is_in] = height[is_in]
        image[y0:y1, x0:x1][is_in] = colour
    return image


def outline(feature):
    """The outline of a feature at its opening or foot, as points in mm; none of an edge or plane."""
    if feature["kind"] not in COLOURS:
        return np.empty((0, 3))
    axis = np.array(feature["axis"])
    along = np.array(feature.get("direction", np.linalg.svd(axis[None])[2][1]))
    along -= axis * (along @ axis)
    along /= np.linalg.norm(along)
    aside = np.cross(axis, along)
    turn = np.linspace(0, 2 * np.pi, 400)
    width = feature.get("width_mm", feature.get("diameter_mm", 0.0))
    straight = max(feature.get("length_mm", width) - width, 0.0) if "width_mm" in feature else 0.0
    x = np.cos(turn) * width / 2 + np.sign(np.cos(turn)) * straight / 2
    return np.array(feature["center_mm"]) + np.outer(x, along) + np.outer(np.sin(turn) * width / 2, aside)


def with_features(image, features, camera):
    image = image.copy()
    for feature in features:
        points = outline(feature)
        if not len(points):
            continue
        line = camera.pixels(points)[:, :2]
        # dense enough to leave no gap
        steps = np.linspace(0, 1, 20)[:, None, None]
        line = ((1 - steps) * line[:-1] + steps * line[1:]).reshape(-1, 2).round().astype(int)
        for dx, dy in [(0, 0), (1, 0), (0, 1)]:
            x, y = np.clip(line + [dx, dy], 0, SIZE - 1).T
            image[y, x] = COLOURS[feature["kind"]]
    return image


def cell(folder):
    """Scan, refined mesh, and the features on it."""
    scan, refined = (trimesh.load(folder / name, process=False) for name in ("scan.ply", "refined.ply"))
    camera = Camera(np.concatenate([scan.vertices, refined.vertices]))
    image = drawn(refined, camera)
    features = json.loads((folder / "features.json").read_text())["features"]
    row = np.concatenate([drawn(scan, camera), image, with_features(image, features, camera)], axis=1)
    row[:, -1] = 0.7
    row[0] = 0.7
    return row[::-1]


def write_png(path, image):
    """An image of values from 0 to 1, the top row first."""
    data = (255 * np.clip(image, 0, 1)).round().astype(np.uint8)
    rows = b"".join(b"\0" + row.tobytes() for row in data)

    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", data.shape[1], data.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--columns", type=int, default=2)
    arguments = parser.parse_args()
    cells = []
    for folder in arguments.folders:
        cells.append(cell(folder))
        print(f"{len(cells)} of {len(arguments.folders)}: {folder.name}", flush=True)
    empty = np.ones_like(cells[0])
    cells += [empty] * (-len(cells) % arguments.columns)
    rows = [np.concatenate(cells[at : at + arguments.columns], axis=1) for at in range(0, len(cells), arguments.columns)]
    write_png(arguments.out, np.concatenate(rows))


if __name__ == "__main__":
    main()
