"""What is said of a mesh alone: the form of openings that are no circles, how far numbers are off, and that nothing is decided on them.

Parts are cut by manifold3d and scanned here: facets of random size, waves, white noise, blur and gaps.
"""

import json
import math

import manifold3d
import numpy as np
import pytest
import trimesh
from conftest import IS_FULL

SEEDS = range(50 if IS_FULL else 12)
# root mean square of error over standard uncertainty
HONEST = 1.25
HEIGHT_MM = 12.0


def outline(radius, corners=96):
    """Corners of a closed line about the origin, from its radius at each angle."""
    angles = 2 * np.pi * np.arange(corners) / corners
    radii = np.array([radius(angle) for angle in angles])
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def polygon(corners, radius):
    return outline(lambda _: radius, corners)


def oval(a, b):
    angles = 2 * np.pi * np.arange(96) / 96
    return np.column_stack([a * np.cos(angles), b * np.sin(angles)])


def prism(corners, low, high, place=(0, 0)):
    return manifold3d.CrossSection([corners + place]).extrude(high - low).translate([0, 0, low])


def meshed(solid):
    mesh = solid.to_mesh()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts)


def plate():
    return prism(np.array([[-40, -25], [40, -25], [40, 25], [-40, 25]]), 0, HEIGHT_MM)


def cut(corners, depth=None):
    return meshed(plate() - prism(corners, -1 if depth is None else HEIGHT_MM - depth, HEIGHT_MM + 1))


def features(touchup, mesh, folder, *kinds):
    path = folder / "part.stl"
    mesh.export(path)
    done = touchup("features", path, "--json")
    assert done.returncode == 0, done.stderr
    return [feature for feature in json.loads(done.stdout)["features"] if feature["kind"] in (kinds or ("hole", "slot", "pocket", "boss"))]


# width of the zone between two circles about the middle
OUT_OF_ROUND = {
    "oval by 0.08": (oval(4.02, 3.98), 0.04),
    "oval by 0.6": (oval(4.15, 3.85), 0.30),
    "three lobes": (outline(lambda angle: 4 + 0.1 * math.cos(3 * angle)), 0.20),
    "five lobes": (outline(lambda angle: 4 + 0.05 * math.cos(5 * angle)), 0.10),
    "hexagon": (polygon(6, 4.0), 4 - 4 * math.cos(math.pi / 6)),
    "triangle": (polygon(3, 5.0), 2.5),
}


@pytest.mark.parametrize("depth", [None, 6.0])
@pytest.mark.parametrize("name", OUT_OF_ROUND)
def test_an_opening_that_is_no_circle_is_told_with_its_form(touchup, tmp_path, name, depth):
    corners, width = OUT_OF_ROUND[name]
    (hole,) = features(touchup, cut(corners, depth), tmp_path)
    assert hole["kind"] == "hole" and hole["through"] == (depth is None)
    assert hole["depth_mm"] == pytest.approx(depth or HEIGHT_MM, abs=1e-3)
    assert hole["form"]["roundness_mm"] == pytest.approx(width, rel=0.03)
    # no circle of that size is there
    assert hole["std"]["diameter_mm"] > 0.3 * width


def test_what_stands_on_a_plate_and_is_no_circle_is_told_with_its_form(touchup, tmp_path):
    raised = meshed(plate() + prism(oval(6.5, 5.5), HEIGHT_MM - 1, HEIGHT_MM + 8))
    (boss,) = features(touchup, raised, tmp_path)
    assert (boss["kind"], boss["depth_mm"]) == ("boss", pytest.approx(8.0, abs=1e-3))
    assert boss["form"]["roundness_mm"] == pytest.approx(1.0, rel=0.03)


def wave(points, random, length):
    """A field of root mean square 1 whose hills are about so long."""
    steps, phases = random.normal(0, 1 / length, (60, 3)), random.uniform(0, 2 * np.pi, 60)
    return np.cos(points @ steps.T + phases).sum(axis=1) * math.sqrt(2 / 60)


def scanned(mesh, random):
    """Facets of 0.5 to 1.6 mm, waves, white noise, blur and gaps."""
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, random.uniform(0.5, 1.6), max_iter=14)
    scan = trimesh.Trimesh(vertices, faces)
    waves = random.uniform(0.01, 0.12) * wave(scan.vertices, random, random.uniform(2, 9))
    off = waves + random.normal(0, random.uniform(0.005, 0.12), len(waves))
    scan.vertices = scan.vertices + scan.vertex_normals * off[:, None]
    trimesh.smoothing.filter_laplacian(scan, iterations=int(random.integers(0, 4)))
    for middle in scan.triangles_center[random.integers(len(scan.faces), size=4)]:
        scan.update_faces(np.linalg.norm(scan.triangles_center - middle, axis=1) > random.uniform(0.3, 1.5))
    return scan


def errors_over_std(found, kind, place, truth):
    """Of the numbers of the feature of a kind that is at a place; none where it was not found."""
    off = [np.array(feature["center_mm"])[:2] - place for feature in found]
    near = [at for at, feature in enumerate(found) if feature["kind"] == kind and np.linalg.norm(off[at]) < 2]
    for at in near[:1]:
        std = found[at]["std"]
        yield from ((found[at][name] - value) / std[name] for name, value in truth.items() if name in std)
        yield from off[at] / (std["center_mm"] / math.sqrt(2))


def test_numbers_of_a_scan_alone_are_off_as_far_as_they_say(touchup, tmp_path):
    ratios = []
    for seed in SEEDS:
        random = np.random.default_rng(seed)
        bore, pin, depth, height = random.uniform(5, 14), random.uniform(6, 16), random.uniform(3, 10), random.uniform(4, 10)
        solid = plate() - prism(polygon(256, bore / 2), HEIGHT_MM - depth, HEIGHT_MM + 1, (-20, 8))
        solid += prism(polygon(256, pin / 2), HEIGHT_MM - 1, HEIGHT_MM + height, (20, -8))
        found = features(touchup, scanned(meshed(solid), random), tmp_path)
        ratios += errors_over_std(found, "hole", [-20, 8], {"diameter_mm": bore, "depth_mm": depth})
        ratios += errors_over_std(found, "boss", [20, -8], {"diameter_mm": pin, "depth_mm": height})
    print(f"{len(ratios)} numbers of {len(SEEDS)} scans: error over std {np.sqrt(np.mean(np.square(ratios))):.2f} rms")
    assert len(ratios) > 4 * len(SEEDS)
    assert np.sqrt(np.mean(np.square(ratios))) < HONEST
