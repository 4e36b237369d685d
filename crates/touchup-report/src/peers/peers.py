"""Measures the closest-face query and the per-sample pipeline of libraries from PyPI; one thread, one process.

Called with a folder that holds `positions.f64` (V x 3, m), `faces.i32` (F x 3), `queries.f64` (Q x 3, m) and a number of samples.
Prints one JSON line for each peer; times in microseconds. A peer that is not installed gets a line with its error.
"""

import json
import os
import sys
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"):
    os.environ[name] = "1"
# whatever a library makes of that: one processor
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import numpy as np

# a pipeline that rebuilds is measured over so many seconds at most
SECONDS = 4.0


def closest_on_triangles(p, t):
    """Distances of p to triangles t (N x 3 x 3), exact: the foot on the plane where it is inside, else the nearest side."""
    a, b, c = t[:, 0], t[:, 1], t[:, 2]
    ab, ac, ap = b - a, c - a, p - a
    n = np.cross(ab, ac)
    nn = np.einsum("ij,ij->i", n, n)
    w = np.einsum("ij,ij->i", np.cross(ab, ap), n)
    v = np.einsum("ij,ij->i", np.cross(ap, ac), n)
    inside = (v >= 0) & (w >= 0) & (v + w <= nn) & (nn > 0)
    plane = np.einsum("ij,ij->i", ap, n) ** 2 / np.where(nn > 0, nn, 1.0)
    sides = np.roll(t, -1, axis=1) - t
    arms = p - t
    length = np.einsum("ijk,ijk->ij", sides, sides)
    s = np.clip(np.einsum("ijk,ijk->ij", arms, sides) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    off = arms - s[..., None] * sides
    side = np.einsum("ijk,ijk->ij", off, off).min(axis=1)
    return np.where(inside, plane, side)


class Cloud:
    """An exact closest face from a tree of barycentres: nearest barycentre, then all that could be nearer."""

    batched = None

    def __init__(self, positions, faces):
        self.positions, self.faces = positions, faces
        triangles = positions[faces]
        self.centres = triangles.mean(axis=1)
        self.radius = np.sqrt(((triangles - self.centres[:, None]) ** 2).sum(axis=2)).max()
        self.build()

    def closest(self, p):
        first = self.nearest(p)
        bound = np.sqrt(closest_on_triangles(p, self.positions[self.faces[first : first + 1]])[0])
        # a rounding more, so that the first is among them
        near = self.within(p, (bound + self.radius) * (1 + 1e-9))
        squared = closest_on_triangles(p, self.positions[self.faces[near]])
        best = int(np.argmin(squared))
        return int(near[best]), float(np.sqrt(squared[best]))

    def refresh(self, moved, touched):
        triangles = self.positions[self.faces[touched]]
        self.centres[touched] = centres = triangles.mean(axis=1)
        self.radius = max(self.radius, np.sqrt(((triangles - centres[:, None]) ** 2).sum(axis=2)).max())
        self.build()


class Scipy(Cloud):
    name, update = "SciPy", "rebuild of cKDTree"
    packages = ("scipy",)

    def build(self):
        from scipy.spatial import cKDTree

        self.tree = cKDTree(self.centres)

    def nearest(self, p):
        return self.tree.query(p)[1]

    def within(self, p, r):
        return self.tree.query_ball_point(p, r)


class ScipyStale(Scipy):
    name, update = "SciPy, stale tree", "none: the search reaches farther by the largest move so far"

    def __init__(self, positions, faces):
        super().__init__(positions, faces)
        self.start = positions.copy()
        self.first_radius = self.radius

    def refresh(self, moved, touched):
        moved_by = self.positions[moved] - self.start[moved]
        # no corner is farther from the barycentre in the tree than the radius then and its own displacement since
        self.radius = max(self.radius, self.first_radius + float(np.sqrt((moved_by * moved_by).sum(axis=1)).max()))


class Barycentre(Scipy):
    """What the paper asks for (Eq 12): the face with the nearest barycentre, which need not be the closest face."""

    name = "SciPy, nearest barycentre"

    def closest(self, p):
        return int(self.tree.query(p)[1]), None

    def batched(self, points):
        return self.tree.query(points)


class Sklearn(Cloud):
    name, update = "scikit-learn", "rebuild of KDTree"
    packages = ("scikit-learn",)

    def build(self):
        from sklearn.neighbors import KDTree

        self.tree = KDTree(self.centres)

    def nearest(self, p):
        return self.tree.query(p[None])[1][0, 0]

    def within(self, p, r):
        return self.tree.query_radius(p[None], r)[0]


class Open3d:
    name, update = "Open3D", "rebuild of RaycastingScene"
    packages = ("open3d",)

    def __init__(self, positions, faces):
        import open3d

        self.o3d = open3d
        self.positions, self.corners = positions, open3d.core.Tensor(faces.astype(np.uint32))
        self.refresh(None, None)

    def refresh(self, moved, touched):
        self.scene = self.o3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(self.o3d.core.Tensor(self.positions.astype(np.float32)), self.corners)

    def answer(self, points):
        found = self.scene.compute_closest_points(self.o3d.core.Tensor(points.astype(np.float32)), nthreads=1)
        return found["primitive_ids"].numpy(), found["points"].numpy()

    def closest(self, p):
        faces, points = self.answer(p[None])
        return int(faces[0]), float(np.linalg.norm(points[0] - p))

    def batched(self, points):
        return self.answer(points)


class Libigl:
    name, update = "libigl", "rebuild of AABB"
    packages = ("libigl",)

    def __init__(self, positions, faces):
        import igl

        self.igl = igl
        self.positions, self.faces = positions, faces.astype(np.int64)
        self.refresh(None, None)

    def refresh(self, moved, touched):
        self.tree = self.igl.AABB()
        self.tree.init(self.positions, self.faces)

    def closest(self, p):
        squared, face, _ = self.tree.squared_distance(self.positions, self.faces, p[None])
        return int(np.ravel(face)[0]), float(np.sqrt(np.ravel(squared)[0]))

    def batched(self, points):
        return self.tree.squared_distance(self.positions, self.faces, points)


class Trimesh:
    name, update = "trimesh", "delete and insert in its R-tree"
    packages = ("trimesh", "rtree")

    def __init__(self, positions, faces):
        import trimesh

        self.positions, self.faces = positions, faces
        self.triangles = positions[faces]
        self.tree = trimesh.triangles.bounds_tree(self.triangles)
        self.closest_point = trimesh.triangles.closest_point

    def closest(self, p):
        # as trimesh.proximity does it: the nearest box gives a bound, all boxes within it are candidates
        first = next(self.tree.nearest(np.concatenate([p, p]), 1))
        bound = np.sqrt(closest_on_triangles(p, self.triangles[first : first + 1])[0]) * (1 + 1e-9)
        near = np.fromiter(self.tree.intersection(np.concatenate([p - bound, p + bound])), dtype=np.int64)
        points = self.closest_point(self.triangles[near], np.tile(p, (len(near), 1)))
        squared = ((points - p) ** 2).sum(axis=1)
        best = int(np.argmin(squared))
        return int(near[best]), float(np.sqrt(squared[best]))

    def refresh(self, moved, touched):
        for face in touched:
            old = self.triangles[face]
            self.tree.delete(int(face), np.concatenate([old.min(axis=0), old.max(axis=0)]))
            new = self.triangles[face] = self.positions[self.faces[face]]
            self.tree.insert(int(face), np.concatenate([new.min(axis=0), new.max(axis=0)]))

    batched = None


def stars(faces, vertices):
    """The faces around each vertex, as one array and where each star begins in it."""
    corners = faces.ravel()
    order = np.argsort(corners, kind="stable")
    starts = np.searchsorted(corners[order], np.arange(vertices + 1))
    return order // 3, starts


def spread(times_ns):
    median, p10, p90 = (float(np.percentile(times_ns, q)) * 1e-3 for q in (50, 10, 90))
    return {"median": median, "p10": p10, "p90": p90}


def measure(peer, positions, faces, queries, samples):
    import importlib.metadata

    clock = time.perf_counter_ns
    positions = positions.copy()
    begin = clock()
    index = peer(positions, faces)
    build_ms = (clock() - begin) * 1e-6
    for p in queries[:20]:
        index.closest(p)
    times, distances, until = [], [], clock() + SECONDS * 1e9
    for p in queries[:samples]:
        begin = clock()
        _, distance = index.closest(p)
        times.append(clock() - begin)
        distances.append(distance)
        if clock() > until:
            break
    result = {
        "peer": peer.name,
        "versions": ", ".join(f"{package} {importlib.metadata.version(package)}" for package in peer.packages),
        "update": peer.update,
        "build_ms": build_ms,
        "query_us": spread(times),
        "batched_query_us": None,
        "distances_m": distances,
    }
    if index.batched is not None:
        each = []
        for _ in range(5):
            begin = clock()
            index.batched(queries)
            each.append((clock() - begin) / len(queries))
        result["batched_query_us"] = spread(each)
    around, starts = stars(faces, len(positions))
    times, until = [], clock() + SECONDS * 1e9
    for p in queries[:samples]:
        begin = clock()
        face, _ = index.closest(p)
        handle = faces[face]
        ring = np.concatenate([around[starts[v] : starts[v + 1]] for v in handle])
        moved = np.unique(faces[ring])
        positions[moved] += (0.0, 0.0, -1e-9)
        positions[handle] += (0.0, 0.0, -1e-9)
        touched = np.unique(np.concatenate([around[starts[v] : starts[v + 1]] for v in moved]))
        index.refresh(moved, touched)
        times.append(clock() - begin)
        if clock() > until:
            break
    result["pipeline_us"] = spread(times)
    result["pipeline_samples"] = len(times)
    return result


def main():
    folder, samples = Path(sys.argv[1]), int(sys.argv[2])
    positions = np.fromfile(folder / "positions.f64").reshape(-1, 3)
    faces = np.fromfile(folder / "faces.i32", dtype=np.int32).reshape(-1, 3)
    queries = np.fromfile(folder / "queries.f64").reshape(-1, 3)
    for peer in (Barycentre, Scipy, ScipyStale, Sklearn, Open3d, Libigl, Trimesh):
        try:
            result = measure(peer, positions, faces, queries, samples)
        except Exception as error:  # one that fails must not take the others with it
            result = {"peer": peer.name, "error": f"{type(error).__name__}: {error}"}
        print(json.dumps(result), flush=True)


main()
