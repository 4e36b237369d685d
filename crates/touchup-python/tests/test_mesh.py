"""Meshes: arrays, objects of other libraries, files."""

from types import SimpleNamespace

import numpy as np
import pytest
import touchup
import trimesh
from conftest import SCENE, plate


def test_arrays_of_the_right_type_are_shared_and_not_copied():
    vertices, faces = plate()
    faces = faces.astype(np.uint32)
    mesh = touchup.Mesh(vertices, faces)
    assert np.shares_memory(mesh.vertices, vertices) and np.shares_memory(mesh.faces, faces)


def test_a_mesh_of_trimesh_keeps_its_area_in_m(ring):
    mesh = touchup.Mesh.of(ring, "mm")
    corners = mesh.vertices[mesh.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(ring.area * 1e-6, rel=1e-12)


def test_an_object_with_triangles_as_open3d_has_them_is_a_mesh():
    class Vector3dVector:
        """As Open3D's: a sequence that NumPy converts."""

        def __init__(self, rows):
            self.rows = rows

        def __array__(self, dtype=None, copy=None):
            return np.array(self.rows, dtype=dtype)

    vertices, faces = plate()
    mesh = touchup.Mesh.of(SimpleNamespace(vertices=Vector3dVector(vertices), triangles=Vector3dVector(faces)))
    assert np.array_equal(mesh.vertices, vertices) and np.array_equal(mesh.faces, faces)


@pytest.mark.full
def test_a_mesh_of_open3d_is_refined_and_comes_back(touched, refined):
    import open3d

    scan = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(touched.scan.vertices), open3d.utility.Vector3iVector(touched.scan.faces.astype(np.int32))
    )
    again = touchup.refine(scan, touched.recording, SCENE)
    assert np.array_equal(again.mesh.vertices, refined.mesh.vertices) and np.array_equal(again.mesh.faces, refined.mesh.faces)
    back = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(again.mesh.vertices), open3d.utility.Vector3iVector(again.mesh.faces.astype(np.int32))
    )
    assert back.get_surface_area() == pytest.approx(trimesh.Trimesh(again.mesh.vertices, again.mesh.faces, process=False).area, rel=1e-12)


def test_trimesh_reads_what_is_written(tmp_path):
    vertices, faces = plate()
    sigma, support = np.linspace(0, 1e-4, len(vertices)), np.arange(len(vertices)) % 4
    touchup.Mesh(vertices, faces, sigma, support).write(tmp_path / "plate.ply", "mm")
    other = trimesh.load(tmp_path / "plate.ply", process=False)
    assert np.allclose(other.vertices, vertices * 1e3, rtol=1e-15, atol=0) and np.array_equal(other.faces, faces)
    columns = other.metadata["_ply_raw"]["vertex"]["data"]
    assert np.allclose(columns["sigma_mm"].ravel(), sigma * 1e3, rtol=1e-6)
    assert np.array_equal(columns["support"].ravel(), support)


def test_a_mesh_in_m_comes_back_bit_by_bit(tmp_path):
    vertices, faces = plate(z=1 / 3)
    mesh = touchup.Mesh(vertices, faces, support=np.full(len(vertices), touchup.GUESSED))
    mesh.write(tmp_path / "plate.ply", "m")
    again = touchup.Mesh.read(tmp_path / "plate.ply", "m")
    assert np.array_equal(again.vertices, vertices) and np.array_equal(again.faces, faces)
    assert again.sigma is None and np.array_equal(again.support, mesh.support)


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices is an array of shape \(3, 2\); it must be \(N, 3\)"),
        (np.zeros((3, 3)), [[0, 1, -2]], "face 0 uses vertex -2, but there are only 3 vertices"),
        (np.zeros((3, 3)), [[0, 1, 3]], "face 0 uses vertex 3, but there are only 3 vertices"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], "of float64; it must be .F, 3. of whole numbers"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(vertices, faces, says):
    with pytest.raises(touchup.TouchupError, match=says):
        touchup.Mesh(vertices, faces)


def test_what_has_no_faces_is_no_mesh():
    with pytest.raises(touchup.TouchupError, match="a dict has not"):
        touchup.Mesh.of({})
