"""python render.py OUT.png MESH...    draws meshes side by side, seen from above at a slant; back faces are red.

Needs open3d only (no display): it casts rays. It makes the picture in the README:

    cargo run --release -- demo --out out
    target/python/bin/python tests/python/render.py docs/demo.png out/scan.ply out/refined.ply out/truth.ply
"""
import sys

import numpy as np
import open3d as o3d

WIDTH, HEIGHT = 480, 330
TOWARDS_EYE = np.array([0.45, -0.75, 1.2])
LIGHT = np.array([0.3, 0.5, 0.8])


def axes():
    towards = TOWARDS_EYE / np.linalg.norm(TOWARDS_EYE)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return towards, right, np.cross(towards, right)


def picture(mesh, centre, radius):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    towards, right, up = axes()
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    scale = 2.05 * radius / WIDTH
    starts = (centre + 3 * radius * towards + ((x - WIDTH / 2) * scale)[..., None] * right
              - ((y - HEIGHT / 2) * scale)[..., None] * up)
    rays = np.concatenate([starts, np.broadcast_to(-towards, starts.shape)], -1).astype(np.float32)
    hits = scene.cast_rays(o3d.core.Tensor(rays))
    normals, hit = hits["primitive_normals"].numpy(), np.isfinite(hits["t_hit"].numpy())
    facing = normals @ towards
    shade = 0.25 + 0.75 * np.clip(facing, 0, 1) * (0.5 + 0.5 * normals @ (LIGHT / np.linalg.norm(LIGHT)))
    image = np.ones((HEIGHT, WIDTH, 3))
    image[hit] = np.clip(shade[hit], 0, 1)[:, None] * [0.75, 0.8, 0.9]
    image[hit & (facing < 0)] = [0.8, 0.3, 0.3]
    return (255 * image).astype(np.uint8)


def main(out, paths):
    meshes = [o3d.io.read_triangle_mesh(path) for path in paths]
    points = np.asarray(meshes[0].vertices)
    centre, radius = (points.min(0) + points.max(0)) / 2, np.linalg.norm(np.ptp(points, axis=0)) / 2
    row = np.concatenate([picture(mesh, centre, radius) for mesh in meshes], axis=1)
    o3d.io.write_image(out, o3d.geometry.Image(np.ascontiguousarray(row)))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
