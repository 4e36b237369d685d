"""Contact of a ball on a compliant shaft with a triangle mesh: N, mm, s; rows are simultaneous, independent balls.

The normal force balances Hertz contact, F = k δ^1.5, against the shaft in series, F = K ε, with δ + ε the depth of the undeflected ball.
Friction is a LuGre bristle (Canudas de Wit 1995) with a Stribeck curve: ż = u − σ |u| z / g(u), friction σ z.
"""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

# two faces belong to one smooth surface up to this angle
SMOOTH_RAD = np.radians(20)
# contacts of one ball nearer to each other than this are one, mm
SAME_MM = 0.05
# distance from a contact at which it must still be the nearest point of the whole mesh, mm
NEAR_MM = 0.02
CONTACTS = 3
BRISTLE_STEPS = 6


def hertz(radius_mm, modulus_n_per_mm2):
    """k of F = k δ^1.5 for a ball on a plane: 4/3 E* √R."""
    return 4 / 3 * modulus_n_per_mm2 * np.sqrt(radius_mm)


def series_force(depth_mm, hertz_k, stiffness):
    """Force with (F/k)^⅔ + F/K = depth; 0 without depth."""
    depth = np.maximum(depth_mm, 0.0)
    # Newton on u = F^⅓ comes down from the smaller of the two upper bounds
    u = np.minimum(np.cbrt(stiffness * depth), np.sqrt(depth) * np.cbrt(hertz_k))
    a, b = hertz_k ** (-2 / 3), 1 / stiffness
    for _ in range(12):
        slope = 2 * a * u + 3 * b * u**2
        u = np.where(slope > 0, u - (a * u**2 + b * u**3 - depth) / np.where(slope > 0, slope, 1), 0.0)
    return u**3


class Surface:
    """A mesh with the exact distance to its triangles, as a whole and by smooth patches."""

    def __init__(self, mesh):
        self.mesh = mesh
        self.vertices, self.faces = np.ascontiguousarray(mesh.vertices, float), np.ascontiguousarray(mesh.faces, np.int64)
        self.tree = tree_of(self.vertices, self.faces)
        self.patch_of = smooth_patches(mesh)
        self.patches = []
        for patch in range(self.patch_of.max() + 1):
            faces = self.faces[self.patch_of == patch]
            corners = self.vertices[faces].reshape(-1, 3)
            self.patches.append((faces, tree_of(self.vertices, faces), corners.min(axis=0), corners.max(axis=0)))

    def nearest(self, points):
        """Distances, nearest points, and their faces."""
        squares, faces, nearest = self.tree.squared_distance(self.vertices, self.faces, np.ascontiguousarray(points))
        return np.sqrt(squares), nearest, faces

    def first_hits(self, origins, directions):
        """Face (−1: none) and distance of the first hit of each ray."""
        directions = np.ascontiguousarray(np.broadcast_to(directions, origins.shape))
        faces, distances, _ = self.tree.intersect_ray_first(self.vertices, self.faces, np.ascontiguousarray(origins), directions)
        return np.asarray(faces), np.asarray(distances)

    def contacts(self, centres, radius):
        """Up to CONTACTS places at which each ball is below its radius from the mesh: distances (inf: none) and nearest points."""
        distances = np.full((len(centres), CONTACTS), np.inf)
        points = np.zeros((len(centres), CONTACTS, 3))
        distance, nearest, _ = self.nearest(centres)
        touching = np.flatnonzero(distance < radius)
        if not len(touching):
            return distances, points
        distances[touching, 0], points[touching, 0] = distance[touching], nearest[touching]
        for faces, tree, low, high in self.patches:
            at = touching[((centres[touching] > low - radius) & (centres[touching] < high + radius)).all(axis=1)]
            if len(at):
                squares, _, found = tree.squared_distance(self.vertices, faces, np.ascontiguousarray(centres[at]))
                self._note(centres, at, np.sqrt(squares), found, radius, distances, points)
        return distances, points

    def _note(self, centres, at, distance, found, radius, distances, points):
        """Adds the contacts of one patch that are local minima of the distance to the whole mesh and not yet known."""
        is_new = (distance < radius) & (np.linalg.norm(points[at] - found[:, None], axis=2) > SAME_MM).all(axis=1)
        at, distance, found = at[is_new], distance[is_new], found[is_new]
        if not len(at):
            return
        out = (centres[at] - found) / distance[:, None]
        is_minimum = self.nearest(found + NEAR_MM * out)[0] > NEAR_MM * (1 - 1e-4)
        at, distance, found = at[is_minimum], distance[is_minimum], found[is_minimum]
        slot = np.isinf(distances[at]).argmax(axis=1)
        has_room = np.isinf(distances[at, slot])
        distances[at[has_room], slot[has_room]], points[at[has_room], slot[has_room]] = distance[has_room], found[has_room]


def tree_of(vertices, faces):
    tree = igl.AABB()
    tree.init(vertices, np.ascontiguousarray(faces))
    return tree


def smooth_patches(mesh):
    """For each face the number of its smooth patch."""
    pairs = mesh.face_adjacency[mesh.face_adjacency_angles < SMOOTH_RAD]
    count = len(mesh.faces)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


@dataclass
class Stylus:
    """A ball on an isotropic shaft."""

    radius: float
    # of the shaft at the ball, N/mm, and its loss, N·s/mm
    stiffness: float
    loss: float
    hertz_k: float
    # friction at rest and in motion, and the speed between them, mm/s
    static: float
    kinetic: float
    stribeck: float
    # of the bristle, N/mm
    bristle: float

    def normal_forces(self, centres, distances, points):
        """Forces at each contact along its normal, which share one shaft, and the normals."""
        is_on = np.isfinite(distances)
        off = centres[:, None] - points
        normals = np.where(is_on[..., None], off / np.where(is_on, distances, 1.0)[..., None], 0.0)
        depth = np.where(is_on, self.radius - distances, 0.0)
        forces = np.zeros_like(depth)
        between = np.einsum("nik,njk->nij", normals, normals)
        for _ in range(3 if is_on[:, 1].any() else 1):
            for k in range(CONTACTS):
                others = (between[:, k] * forces).sum(axis=1) - between[:, k, k] * forces[:, k]
                forces[:, k] = series_force(depth[:, k] - others / self.stiffness, self.hertz_k, self.stiffness)
        return forces, normals

    def friction_step(self, state, velocity, normal, pressing, step_s):
        """Lateral force of the part on the stylus after one step; moves the bristle and the lateral deflection of the shaft.

        - velocity: of the undeflected ball.
        - normal, pressing: direction and sum of the normal forces.
        """
        is_on = (pressing > 0)[:, None]

        def lateral(vector):
            return vector - normal * (vector * normal).sum(axis=1, keepdims=True)

        z, bend, u = lateral(state.bristle), lateral(state.bend), lateral(state.slip)
        v = lateral(velocity)
        pull = self.stiffness * (bend + v * step_s) + self.loss * v
        for _ in range(BRISTLE_STEPS):
            speed = np.linalg.norm(u, axis=1, keepdims=True)
            limit = pressing[:, None] * (self.kinetic + (self.static - self.kinetic) * np.exp(-((speed / self.stribeck) ** 2)))
            damp = 1 + self.bristle * speed * step_s / np.maximum(limit, 1e-9)
            u = (pull - self.bristle * z / damp) / (self.stiffness * step_s + self.loss + self.bristle * step_s / damp)
        state.slip = np.where(is_on, u, 0.0)
        state.bend = np.where(is_on, bend + (v - u) * step_s, 0.0)
        state.bristle = np.where(is_on, (z + u * step_s) / damp, 0.0)
        return -np.where(is_on, self.stiffness * state.bend + self.loss * (v - u), 0.0)


@dataclass
class Friction:
    """State of the friction of each ball: bristle, deflection of the shaft, speed of slip."""

    bristle: np.ndarray
    bend: np.ndarray
    slip: np.ndarray

    @classmethod
    def at_rest(cls, count):
        return cls(*(np.zeros((count, 3)) for _ in range(3)))
