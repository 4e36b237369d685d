"""python -m machined.surfaces OUT [--json FILE]: refined surfaces of random parts beside other methods on the same contacts.

OUT is the folder of `python -m machined`. Each other method sees the scan and all contacts at once, the contacts with touchup's
compensation:

- scan: unchanged.
- poisson: screened Poisson reconstruction (Kazhdan and Hoppe 2013, by pymeshlab) of the contacts and the scan away from them.
- carve: signed distance of the scan on voxels, without the balls and with material behind contacts; marching cubes.
- gaussian_process: implicit surface by regression (Williams and Fitzgibbon 2006): zero on contacts and scan, one radius on the centres of
  the ball, less below; of the nearest observations to each voxel.

libigl measures distances from samples of one surface to the other: truth to mesh if the truth is within 1 mm of a true contact, mesh to
truth if the nearest truth is. The comparison uses signs and tangents of neither.
"""

import argparse
import csv
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import igl
import numpy as np
import pymeshlab
import trimesh
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

# voxels of the implicit surfaces, and their largest distance from contacts, mm
VOXEL_MM = 0.35
BAND_MM = 1.6
# spacing of the contacts for the other methods, mm
THIN_MM = 0.3
# distance from a contact below which the scan drops out, mm
REPLACED_MM = 1.5
# behind a contact there is material over this, mm
BEHIND_MM = 1.0
# length of the kernel, mm; the noise of an observation is this share of its amplitude; number of observations around a voxel, and their
# spacing, mm; distance off the surface of those without a ball, mm
LENGTH_MM = 2.0
NOISE = 0.03
NEIGHBOURS = 40
THIN_OF_PROCESS_MM = 0.6
OFF_MM = 0.8
# bounds the memory of the regression
PLACES_AT_ONCE = 50_000
POISSON_DEPTH = 8
# distance from all points above which Poisson's closed surface drops out, mm
POISSON_NEAR_MM = 2.5
TOUCHED_MM = 1.0
SAMPLES = 60_000


class Touched:
    """Scan, contacts, and the true part in the frame of the scan, mm."""

    def __init__(self, folder):
        self.scan = trimesh.load(folder / "scan.ply", process=False)
        with (folder / "touches.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["rejected"] == "0"]
        columns = {name: np.array([[float(row[f"{name}_{axis}"]) for axis in axes] for row in rows]) for name, axes in AXES.items()}
        self.radius = float(rows[0]["tip_radius_mm"])
        kept = thinned(columns["point"], THIN_MM)
        self.points, self.centres, self.normals = (columns[name][kept] for name in ("point", "center", "normal"))
        self.truth = trimesh.load(folder / "part.stl", process=False)
        true_points = np.loadtxt(folder / "truth_contacts.csv", delimiter=",", skiprows=1, ndmin=2)[:, 4:7]
        place = json.loads((folder / "truth.json").read_text()).get("scan_to_space")
        if place:
            (turn, shift), (told_turn, told_shift) = pose(place["truth"]), pose(place["told"])

            def moved(points):
                return told_turn.inv().apply(turn.apply(points) + shift - told_shift)

            self.truth.vertices, true_points = moved(self.truth.vertices), moved(true_points)
        self.contacts = cKDTree(true_points)


AXES = {name: ("x_mm", "y_mm", "z_mm") for name in ("point", "center")} | {"normal": ("x", "y", "z")}


def pose(of):
    return Rotation.from_quat(of["orientation_xyzw"]), np.array(of["position_m"]) * 1e3


def thinned(points, cell):
    """One point of each cell of a grid."""
    return np.sort(np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_index=True)[1])


def distances(points, mesh):
    squares, _, nearest = igl.point_mesh_squared_distance(points, np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64))
    return np.sqrt(squares), nearest


def errors(touched, mesh):
    """Mean distances of truth to mesh and of mesh to truth in the touched region, mm."""
    truth, _ = trimesh.sample.sample_surface(touched.truth, SAMPLES, seed=1)
    truth = truth[touched.contacts.query(truth)[0] < TOUCHED_MM]
    points, _ = trimesh.sample.sample_surface(mesh, SAMPLES, seed=2)
    to_truth, nearest = distances(points, touched.truth)
    is_touched = touched.contacts.query(nearest)[0] < TOUCHED_MM
    return float(distances(truth, mesh)[0].mean()), float(to_truth[is_touched].mean())


def scan_beside(touched):
    """Points of the scan away from contacts and outside of the ball's path, with normals."""
    points, faces = trimesh.sample.sample_surface(touched.scan, 40_000, seed=3)
    normals = touched.scan.face_normals[faces]
    is_kept = cKDTree(touched.points).query(points)[0] > REPLACED_MM
    is_kept &= cKDTree(touched.centres).query(points)[0] > touched.radius
    return points[is_kept], normals[is_kept]


def poisson(touched):
    scan, normals = scan_beside(touched)
    points, normals = np.vstack([scan, touched.points]), np.vstack([normals, touched.normals])
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals))
    meshes.generate_surface_reconstruction_screened_poisson(depth=POISSON_DEPTH, threads=1)
    made = meshes.current_mesh()
    mesh = trimesh.Trimesh(made.vertex_matrix(), made.face_matrix(), process=False)
    mesh.update_faces(cKDTree(points).query(mesh.triangles_center)[0] < POISSON_NEAR_MM)
    return mesh


class Band:
    """Voxels near contacts, their corners, and the signed distance of the scan there."""

    def __init__(self, touched):
        low = touched.points.min(axis=0) - BAND_MM - VOXEL_MM
        size = np.ceil((touched.points.max(axis=0) + BAND_MM - low) / VOXEL_MM).astype(int) + 2
        tree = cKDTree(touched.points[thinned(touched.points, VOXEL_MM)])
        blocks = [np.arange(n) for n in size]
        cells = np.stack(np.meshgrid(*blocks, indexing="ij"), axis=-1).reshape(-1, 3)
        near = [tree.query(low + (part + 0.5) * VOXEL_MM, distance_upper_bound=BAND_MM)[0] < BAND_MM for part in np.array_split(cells, 20)]
        cells = cells[np.concatenate(near)]
        corners = (cells[:, None, :] + CORNERS).reshape(-1, 3)
        keys, self.of_cell = np.unique(corners @ [1, size[0] + 1, (size[0] + 1) * (size[1] + 1)], return_inverse=True)
        self.of_cell = self.of_cell.reshape(-1, 8)
        places = np.stack([keys % (size[0] + 1), keys // (size[0] + 1) % (size[1] + 1), keys // ((size[0] + 1) * (size[1] + 1))], axis=1)
        self.places = low + places * VOXEL_MM
        scan = np.asarray(touched.scan.vertices, float), np.asarray(touched.scan.faces, np.int64)
        self.signed = igl.signed_distance(self.places, *scan, igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)[0]

    def surface(self, values):
        vertices, faces, _ = igl.marching_cubes(values, self.places, self.of_cell.astype(np.int64), 0.0)
        return trimesh.Trimesh(vertices, faces, process=False)


# in the order of libigl's marching cubes: x fastest, one face of the cell around, then the other
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def carve(touched, band):
    values = band.signed.copy()
    # the material behind the nearest contact, then the space that the ball swept
    distance, nearest = cKDTree(touched.points).query(band.places)
    off = band.places - touched.points[nearest]
    height = (off * touched.normals[nearest]).sum(axis=1)
    aside = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    is_behind = (height < 0) & (height > -BEHIND_MM) & (aside < VOXEL_MM)
    values[is_behind] = np.minimum(values[is_behind], height[is_behind])
    free = touched.radius - cKDTree(touched.centres).query(band.places)[0]
    return band.surface(np.maximum(values, free))


def gaussian_process(touched, band):
    scan, normals = scan_beside(touched)
    points, normals = np.vstack([scan, touched.points]), np.vstack([normals, touched.normals])
    out = np.concatenate([np.full(len(scan), OFF_MM), np.full(len(touched.points), touched.radius)])
    kept = thinned(points, THIN_OF_PROCESS_MM)
    points, normals, out = points[kept], normals[kept], out[kept]
    observed = np.vstack([points, points + normals * out[:, None], points - normals * OFF_MM])
    values = np.concatenate([np.zeros(len(points)), out, np.full(len(points), -OFF_MM)])
    # the posterior mean of a Gaussian process with a squared exponential kernel
    kernel = {"kernel": "gaussian", "epsilon": 1 / (np.sqrt(2) * LENGTH_MM), "degree": -1, "smoothing": NOISE**2}
    process = RBFInterpolator(observed, values, neighbors=NEIGHBOURS, **kernel)
    parts = np.array_split(band.places, len(band.places) // PLACES_AT_ONCE + 1)
    return band.surface(np.concatenate([process(part) for part in parts]))


def compared(folder):
    """Both errors of each method on one part, mm."""
    touched = Touched(folder)
    band = Band(touched)
    meshes = {
        "scan": touched.scan,
        "poisson": poisson(touched),
        "carve": carve(touched, band),
        "gaussian_process": gaussian_process(touched, band),
        "touchup": trimesh.load(folder / "refined.ply", process=False),
    }
    return folder.name, {name: errors(touched, mesh) for name, mesh in meshes.items()}


def table(results):
    """Lines of both errors by part, and the parts on which touchup is not the best."""
    names = list(next(iter(results.values())))
    lines = [f"{'t2m / m2t, mm':34}" + "".join(f"{name:>18}" for name in names)]
    for part, of in results.items():
        lines.append(f"{part:34}" + "".join(f"{t2m:9.4f} /{m2t:7.4f}" for t2m, m2t in of.values()))
    lines.append(f"{'mean':34}" + "".join(f"{t2m:9.4f} /{m2t:7.4f}" for t2m, m2t in np.mean([list(of.values()) for of in results.values()], axis=0)))
    for at, name in enumerate(("truth to mesh", "mesh to truth")):
        worse = [f"{part} ({min(of, key=lambda m: of[m][at])})" for part, of in results.items() if min(of, key=lambda m: of[m][at]) != "touchup"]
        lines.append(f"{name}: touchup is best on {len(results) - len(worse)} of {len(results)}; not on {', '.join(worse) or 'none'}")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.out.glob("*/refined.ply"))
    results = {}
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for name, of in pool.map(compared, folders):
            results[name] = of
            print(name, " ".join(f"{method} {t2m:.4f}/{m2t:.4f}" for method, (t2m, m2t) in of.items()), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1))
    print("\n" + "\n".join(table(results)))


if __name__ == "__main__":
    main()
