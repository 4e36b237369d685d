"""Faces for CAD of whole parts, read by an independent kernel (OpenCascade), against their true sizes.

Drawings: the plate of the demo and random machined parts, whose sizes are known exactly. Touched: the demo's plate and a random sheet, within
the uncertainties that their own files state.
"""

import math
import re

import numpy as np
import pytest
import trimesh
from machined.families import random_part
from machined.part import segments
from machined.touched import part_run
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_EDGE, TopAbs_SHELL, TopAbs_SOLID
from test_step_file import CONE, CYLINDER, PLANE, Part, all_of

# mm, of coordinates in single precision
ROUNDING = 1e-5
# of volumes of a mesh with flat facets instead of round walls
FACETS = 3e-4
# standard deviations
SURE = 4
# seeds of parts that planes, cylinders and cones close
CLOSED_PARTS = [3001, 3006, 3010]


def write_mesh(path, mesh):
    """A PLY file in double precision."""
    counts = f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\nelement face {len(mesh.faces)}\n"
    head = f"ply\nformat binary_little_endian 1.0\n{counts}property list uchar int vertex_indices\nend_header\n"
    faces = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    path.write_bytes(head.encode() + np.asarray(mesh.vertices, "<f8").tobytes() + faces.tobytes())


@pytest.fixture(scope="module")
def faces_of(touchup, tmp_path_factory):
    """Runs `touchup features --step`; returns the file as OpenCascade reads it, which is valid, and the printed line."""

    def run(mesh, *arguments):
        step = tmp_path_factory.mktemp("faces") / "part.step"
        done = touchup("features", mesh, *arguments, "--step", step)
        assert done.returncode == 0, done.stderr
        part = Part(step)
        assert BRepCheck_Analyzer(part.shape).IsValid()
        return part, next(line for line in done.stdout.splitlines() if line.startswith("wrote") and "step" in line)

    return run


def radii(part):
    """Radii of the cylinders, mm, in rising order."""
    surfaces = part.faces.values()
    return sorted(surface.Cylinder().Radius() for surface in surfaces if surface.GetType() == CYLINDER)


def distances(surface, points):
    """Distances of points from the whole surface of a face, mm."""
    kind = surface.GetType()
    own = {PLANE: surface.Plane, CYLINDER: surface.Cylinder, CONE: surface.Cone}[kind]()
    place, axis = own.Axis().Location(), own.Axis().Direction()
    off = points - [place.X(), place.Y(), place.Z()]
    along = off @ [axis.X(), axis.Y(), axis.Z()]
    if kind == PLANE:
        return np.abs(along)
    across = np.sqrt(np.maximum((off**2).sum(axis=1) - along**2, 0))
    if kind == CYLINDER:
        return np.abs(across - own.Radius())
    return np.abs((across - own.RefRadius()) * math.cos(own.SemiAngle()) - along * math.sin(own.SemiAngle()))


def is_solid(part):
    shells = all_of(part.shape, TopAbs_SHELL)
    return len(all_of(part.shape, TopAbs_SOLID)) == len(shells) == 1 and shells[0].Closed() and part.free_edges() == 0


def test_the_drawing_of_the_demo_is_a_solid_with_its_sizes(faces_of, demo_folder):
    part, line = faces_of(demo_folder / "truth.ply")
    assert line.endswith("18 faces, 0 of them touched, in 1 solid")
    assert is_solid(part)
    assert part.kinds() == {PLANE: 13, CYLINDER: 5}
    assert radii(part) == pytest.approx([3, 3, 3, 4, 5], abs=ROUNDING)
    # 80 × 50 × 12 with a step of 20 × 3, a hole of 8 through it, one of 6 and 8 deep, a slot of 20 × 6 and 5 deep, a boss of 10 and 4 high
    round_parts = -16 * 12 - 9 * 8 - 9 * 5 + 25 * 4
    assert part.volume() == pytest.approx(80 * 50 * 12 - 20 * 50 * 3 - 14 * 6 * 5 + math.pi * round_parts, rel=1e-6)
    heights = sorted({round(plane.Plane().Location().Z(), 4) for plane in part.faces.values() if plane.GetType() == PLANE and abs(plane.Plane().Axis().Direction().Z()) > 0.5})
    assert heights == [0, 4, 7, 9, 12, 16]


@pytest.mark.parametrize("seed", CLOSED_PARTS)
def test_the_drawing_of_a_machined_part_is_a_solid_with_its_sizes(faces_of, tmp_path, seed):
    _, drawing = random_part(seed)
    mesh, _ = drawing.finished()
    write_mesh(tmp_path / "part.ply", mesh)
    part, _ = faces_of(tmp_path / "part.ply")
    assert is_solid(part)
    assert set(part.kinds()) <= {PLANE, CYLINDER, CONE}
    assert part.volume() == pytest.approx(mesh.volume, rel=FACETS)
    off = np.min([distances(surface, np.asarray(mesh.vertices)) for surface in part.faces.values()], axis=0)
    assert off.max() < ROUNDING, "each corner of the drawing is on a face"
    found = np.array(radii(part))
    for feature in drawing.features:
        if feature.kind in ("hole", "boss") and not feature.is_optional:
            radius = feature.sizes["diameter_mm"] / 2
            # the drawing is a polygon around the circle, and the face passes through its corners
            corner = radius * 2 / (1 + math.cos(math.pi / segments(radius)))
            assert np.abs(found - corner).min() < ROUNDING, feature


def stated(part, face):
    """Standard uncertainties that the file states for a face, by name."""
    lines = dict(line.rstrip(";").split("=", 1) for line in part.text.splitlines() if line.startswith("#"))
    aspect = next(key for key, line in lines.items() if line.startswith(f"SHAPE_ASPECT('{face}'"))
    definition = next(key for key, line in lines.items() if line.startswith("PROPERTY_DEFINITION(") and line.endswith(f",{aspect})"))
    link = next(line for line in lines.values() if line.startswith(f"PROPERTY_DEFINITION_REPRESENTATION({definition},"))
    representation = lines[link.rstrip(")").split(",")[1]]
    items = representation[representation.index("(#") + 1 :].split(")")[0].split(",")
    number = re.compile(r"MEASURE_REPRESENTATION_ITEM\('(\w+)',\w+\(([^)]+)\)")
    matches = [number.match(lines[item]) for item in items]
    return {match[1]: float(match[2].replace("E", "e")) for match in matches if match}


@pytest.fixture(scope="module")
def touched(faces_of, demo_folder):
    part, line = faces_of(demo_folder / "refined.ply", "--touches", demo_folder / "touches.csv")
    assert re.search(r": \d+ faces, \d+ of them touched, in \d+ open shells?", line), line
    return part


def middle_of(part, name):
    """Centre of the area of a face, mm."""
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(part.faces[name].Face(), properties)
    return properties.CentreOfMass()


def test_touched_faces_of_the_demo_have_the_true_sizes_within_their_uncertainty(touched):
    # truth: (kind, radius or distance from the origin along the axis, a point near the face)
    cylinders = [(4, (16, 36)), (3, (32, 34)), (3, (18, 14)), (3, (32, 14)), (5, (47, 25))]
    is_touched = {name: surface for name, surface in touched.faces.items() if name.endswith("(touched)")}
    for radius, (x, y) in cylinders:
        near = [
            (name, surface.Cylinder())
            for name, surface in is_touched.items()
            if surface.GetType() == CYLINDER and math.hypot(surface.Cylinder().Location().X() - x, surface.Cylinder().Location().Y() - y) < 1
        ]
        assert len(near) == 1, (radius, x, y)
        name, cylinder = near[0]
        sigma = stated(touched, name)
        assert abs(2 * cylinder.Radius() - 2 * radius) < SURE * sigma["diameter_mm"], name
        assert 0 < sigma["diameter_mm"] < 0.05
    true_planes = [gp_Pnt(0, 0, z) for z in (7, 9, 12, 16)] + [gp_Pnt(0, y, 0) for y in (11, 17)]
    planes = {name: surface.Plane() for name, surface in is_touched.items() if surface.GetType() == PLANE}
    assert len(planes) == len(true_planes)
    for name, plane in planes.items():
        middle, direction = middle_of(touched, name), plane.Axis().Direction()
        axis = 2 if abs(direction.Z()) > 0.9 else 1
        coordinate = middle.Coord(axis + 1)
        off = min(abs(coordinate - point.Coord(axis + 1)) for point in true_planes)
        assert off < SURE * stated(touched, name)["position_mm"], name


def test_scanned_faces_beside_touches_state_no_uncertainty(touched):
    scanned = [name for name in touched.faces if name.endswith("(scan)")]
    assert scanned
    assert all(stated(touched, name) == {} for name in scanned)


def test_touched_neighbours_share_their_edges(touched):
    """Around the top of the boss, the floor of the slot, and both walls at it, nothing is open."""
    names = {name: surface for name, surface in touched.faces.items() if name.endswith("(touched)")}
    height = {name: middle_of(touched, name).Z() for name, surface in names.items() if surface.GetType() == PLANE}
    edges = {name: all_of(surface.Face(), TopAbs_EDGE) for name, surface in touched.faces.items()}
    for true_height in (16, 7):
        name = next(name for name, z in height.items() if abs(z - true_height) < 0.1)
        others = [edge for other, of_face in edges.items() if other != name for edge in of_face]
        assert edges[name]
        for edge in edges[name]:
            assert any(edge.IsSame(other) for other in others), f"an open edge of {name}"


def test_touched_faces_of_a_sheet_have_the_true_sizes_within_their_uncertainty(faces_of, touchup_bin, tmp_path):
    result = part_run(touchup_bin, tmp_path, 2003, None, None)
    folder = tmp_path / result.folder
    part, _ = faces_of(folder / "refined.ply", "--touches", folder / "touches.csv")
    # the ends of a slot are as wide as it is
    sizes = [feature.sizes for feature in result.part.features]
    true = np.array([size[name] for size in sizes for name in ("diameter_mm", "width_mm") if name in size])
    is_touched = {name: surface for name, surface in part.faces.items() if name.endswith("(touched)")}
    walls = [(name, surface.Cylinder()) for name, surface in is_touched.items() if surface.GetType() == CYLINDER]
    assert len(walls) >= 2
    for name, cylinder in walls:
        assert np.abs(true - 2 * cylinder.Radius()).min() < SURE * stated(part, name)["diameter_mm"], (name, true)


def test_a_mesh_without_faces_writes_no_file(touchup, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=20)
    ball.vertices += np.random.default_rng(1).normal(0, 0.2, ball.vertices.shape)
    write_mesh(tmp_path / "ball.ply", ball)
    done = touchup("features", tmp_path / "ball.ply", "--step", tmp_path / "ball.step")
    assert done.returncode == 3
    assert "no part of the mesh is a plane, cylinder or cone" in done.stderr
    assert not (tmp_path / "ball.step").exists()
