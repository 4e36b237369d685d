"""The form of openings in a drawing that are no circles; manifold3d cuts the parts."""

import json
import math

import manifold3d
import numpy as np
import pytest
import trimesh

HEIGHT_MM = 12.0


def outline(radius, corners=96):
    """Corners of a closed line about the origin, from its radius at each angle."""
    angles = 2 * np.pi * np.arange(corners) / corners
    radii = np.array([radius(angle) for angle in angles])
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


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
