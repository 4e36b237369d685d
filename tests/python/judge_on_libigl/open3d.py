"""The open3d queries of the judge on libigl: a wheel of 10 MB in place of 450.

The quick checks put this folder before the judge's libraries; with TOUCHUP_FULL the judge has open3d itself, and test_judge.py compares the
two. Coordinates have single precision as in open3d, distances have double.
"""

from types import SimpleNamespace

import igl
import numpy as np


class Tensor(np.ndarray):
    """An array that returns itself."""

    def __new__(cls, values):
        return np.asarray(values).view(cls)

    def numpy(self):
        return self.view(np.ndarray)


class RaycastingScene:
    """Closest points, rays and signed distances of one mesh."""

    def add_triangles(self, vertices, faces):
        self.vertices = np.ascontiguousarray(vertices.numpy(), np.float64)
        self.faces = np.ascontiguousarray(faces.numpy(), np.int64)
        self.tree = igl.AABB()
        self.tree.init(self.vertices, self.faces)

    def compute_closest_points(self, points):
        _, faces, closest = self.tree.squared_distance(self.vertices, self.faces, np.float64(points.numpy()))
        return {"points": Tensor(closest), "primitive_ids": Tensor(faces)}

    def cast_rays(self, rays):
        rays = np.float64(rays.numpy())
        starts, directions = np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:])
        faces, far, _ = self.tree.intersect_ray_first(self.vertices, self.faces, starts, directions)
        return {"t_hit": Tensor(np.where(faces < 0, np.inf, far))}

    def compute_signed_distance(self, points):
        kind = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
        return Tensor(igl.signed_distance(np.float64(points.numpy()), self.vertices, self.faces, kind)[0])


core = SimpleNamespace(Tensor=Tensor)
t = SimpleNamespace(geometry=SimpleNamespace(RaycastingScene=RaycastingScene))
