"""A structured-light scan: depth images from a few views, fused into a truncated signed distance field, smoothed, and contoured; mm.

A pixel needs sight of the camera and of the projector, so deep holes give none; small gaps in an image are filled from their rims, which
closes holes; pixels at depth steps mix both depths.
"""

import igl
import numpy as np
import trimesh
from scipy.ndimage import binary_opening, gaussian_filter, maximum_filter, minimum_filter

from .strokes import AXES

PIXEL_MM = 0.7
BASELINE_RAD = np.radians(20)
# no return beyond this incidence
GRAZING_COSINE = 0.2
# gaps up to this width are filled, mm
FILLED_MM = 4.0
TRUNCATION_VOXELS = 3.0


class View:
    """An orthographic depth image along −axis."""

    def __init__(self, surface, axis, noise, rng):
        mesh, self.axis = surface.mesh, axis
        self.x = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        self.x /= np.linalg.norm(self.x)
        self.y = np.cross(axis, self.x)
        flat = mesh.vertices @ np.array([self.x, self.y]).T
        self.low = flat.min(axis=0) - 2 * PIXEL_MM
        size = np.ceil((flat.max(axis=0) - self.low) / PIXEL_MM).astype(int) + 3
        u, v = np.meshgrid(*(low + PIXEL_MM * np.arange(n) for low, n in zip(self.low, size)), indexing="ij")
        self.top = (mesh.vertices @ axis).max() + 50.0
        origins = u.reshape(-1, 1) * self.x + v.reshape(-1, 1) * self.y + self.top * axis
        self.height = self._measured(surface, origins, noise, rng).reshape(size)

    def _measured(self, surface, origins, noise, rng):
        hit, depth = surface.first_hits(origins, -self.axis)
        cosine = surface.mesh.face_normals[np.maximum(hit, 0)] @ self.axis
        points = origins - depth[:, None] * self.axis + 1e-3 * self.axis
        to_projector = np.cos(BASELINE_RAD) * self.axis + np.sin(BASELINE_RAD) * self.x
        is_lit = surface.first_hits(points, to_projector)[0] < 0
        is_seen = (hit >= 0) & is_lit & (cosine > GRAZING_COSINE)
        # more noise where the surface turns away
        error = rng.normal(size=len(depth)) * noise / np.maximum(cosine, GRAZING_COSINE)
        return np.where(is_seen, self.top - depth + error, np.nan)

    def finished(self, noise, rng):
        """Mixed pixels, noise that neighbours share, and filled gaps."""
        known = np.isfinite(self.height)
        low = np.where(known, self.height, np.inf)
        high = np.where(known, self.height, -np.inf)
        near, far = maximum_filter(high, 2), minimum_filter(low, 2)
        is_step = known & (near - far > 1.5) & (rng.random(known.shape) < 0.5)
        share = rng.random(known.shape)
        with np.errstate(invalid="ignore"):
            mixed = near * share + far * (1 - share)
        self.height = np.where(is_step, mixed, self.height)
        shared = gaussian_filter(rng.normal(size=known.shape), 4)
        self.height = self.height + shared * (0.7 * noise / shared.std())
        # gaps that an opening of the filled width removes are narrower than it
        width = int(FILLED_MM / PIXEL_MM)
        is_narrow = ~known & ~binary_opening(~known, np.ones((width, width)))
        weight = gaussian_filter(known.astype(float), width / 2)
        filled = gaussian_filter(np.where(known, self.height, 0.0), width / 2) / np.maximum(weight, 1e-6)
        self.height = np.where(is_narrow & (weight > 0.3), filled, self.height)
        return self

    def distances(self, points):
        """Height of points above the image, mm; nan without a pixel."""
        at = np.rint((points @ np.array([self.x, self.y]).T - self.low) / PIXEL_MM).astype(int)
        is_in = ((at >= 0) & (at < self.height.shape)).all(axis=1)
        at = np.where(is_in[:, None], at, 0)
        return np.where(is_in, points @ self.axis - self.height[at[:, 0], at[:, 1]], np.nan)


def scanned(surface, sides, noise, voxel, rng):
    """The mesh that a scanner makes of the part, open where no view saw it."""
    axes = [AXES[side] + rng.normal(0, 0.12, 3) for side in sides] + [AXES[side] + rng.normal(0, 0.4, 3) for side in sides]
    views = [View(surface, axis / np.linalg.norm(axis), noise, rng).finished(noise, rng) for axis in axes]
    reach = TRUNCATION_VOXELS * voxel
    low, high = surface.mesh.bounds + np.array([[-1.0], [1.0]]) * (reach + 2 * voxel)
    size = np.ceil((high - low) / voxel).astype(int) + 1
    places = low + voxel * np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), axis=-1).reshape(-1, 3)
    total, weight = np.zeros(len(places)), np.zeros(len(places))
    for view in views:
        distance = view.distances(places)
        # a gap in the image tells nothing, air and skin do
        is_known = np.isfinite(distance) & (distance > -reach)
        total += np.where(is_known, np.clip(distance, -reach, reach), 0.0)
        weight += is_known
    value = np.where(weight > 0, total / np.maximum(weight, 1), reach)
    is_known = (weight > 0).reshape(size)
    smooth = gaussian_filter(np.where(is_known, value.reshape(size), 0.0), 0.8) / np.maximum(gaussian_filter(is_known.astype(float), 0.8), 1e-6)
    return contoured(np.where(is_known, smooth, -reach), is_known, low, voxel)


def contoured(value, is_known, low, voxel):
    """The zero contour where the field is known."""
    size = value.shape
    # libigl runs along x first
    places = low + voxel * np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), axis=-1)
    flat = np.ascontiguousarray(places.transpose(2, 1, 0, 3).reshape(-1, 3))
    vertices, faces, _ = igl.marching_cubes(np.ascontiguousarray(value.transpose(2, 1, 0).ravel()), flat, *size, 0.0)
    made = trimesh.Trimesh(vertices, faces, process=True)
    cell = np.floor((made.vertices - low) / voxel).astype(int)
    is_seen = np.ones(len(made.vertices), bool)
    for corner in np.ndindex(2, 2, 2):
        is_seen &= is_known[tuple(np.minimum(cell + corner, np.array(size) - 1).T)]
    made.update_faces(is_seen[made.faces].all(axis=1))
    pieces = trimesh.graph.connected_components(made.face_adjacency, min_len=1, nodes=np.arange(len(made.faces)))
    made.update_faces(np.concatenate([piece for piece in pieces if len(piece) > 60]))
    made.update_faces(made.nondegenerate_faces(height=1e-4 * voxel))
    made.remove_unreferenced_vertices()
    return made
