"""Features, comparison and alignment, against closed forms and trimesh."""

import contextlib

import numpy as np
import pytest
import touchup
import trimesh
from conftest import plate


def test_the_hole_of_a_ring_has_its_diameter(ring):
    (hole,) = [of for of in touchup.features(ring, unit="mm")["features"] if of["kind"] == "hole"]
    # 96 flats lie between the circle through the corners and the one inside
    assert 8.0 * np.cos(np.pi / 96) - 1e-6 <= hole["diameter_mm"] <= 8.0 + 1e-6
    assert hole["through"] and hole["depth_mm"] == pytest.approx(5.0, abs=1e-6)
    assert abs(hole["axis"][2]) == pytest.approx(1.0, abs=1e-9)


def test_corners_that_each_triangle_has_by_itself_are_one(ring):
    soup = ring.triangles.reshape(-1, 3), np.arange(3 * len(ring.faces)).reshape(-1, 3)
    found, expected = (touchup.features(of, unit="mm")["features"] for of in (soup, ring))
    assert [of["kind"] for of in found] == [of["kind"] for of in expected] and len(expected) == 4
    with pytest.raises(touchup.TouchupError, match="too large for a work-piece"):
        touchup.features(ring)  # mm taken for m


def test_touches_measure_the_hole_better_than_the_scan(ring, refined):
    holes = [of for of in refined.features["features"] if of["kind"] == "hole"]
    assert holes and min(abs(hole["diameter_mm"] - 8.0) for hole in holes) < 0.05
    assert holes[0]["fitted_to"] == "touches" and holes[0]["std"]["diameter_mm"] > 0


def test_a_plate_above_another_deviates_by_its_height():
    compared = touchup.compare(plate(z=0.1e-3), plate(), samples=2000)
    assert np.allclose(compared.deviation, 0.1e-3, atol=1e-12)
    assert compared.region()["mesh_to_truth"]["bias_mm"] == pytest.approx(0.1, abs=1e-9)
    assert [region["region"] for region in compared.report["regions"]] == ["all"]
    for tolerance_mm, share in [(0.05, 0.0), (0.15, 1.0)]:
        within = touchup.compare(plate(z=0.1e-3), plate(), samples=500, tolerance_mm=tolerance_mm).region()
        assert within["within_tolerance_share"] == share


def test_a_unit_and_a_frame_that_are_probably_wrong_are_warned_of(ring):
    large, small = touchup.Mesh.of(ring, "m"), touchup.Mesh.of(ring, "mm")
    for of in (touchup.compare, touchup.align):
        # which may then have no result
        with pytest.warns(touchup.TouchupWarning, match="the mesh is 1000.0 times smaller than the truth: are both in m"), contextlib.suppress(touchup.TouchupError):
            of(small, large)
    beside = touchup.Mesh(small.vertices + [0.1, 0, 0], small.faces)
    # 22 mm wide
    with pytest.warns(touchup.TouchupWarning, match="the mesh lies 78.0 mm beside the truth: are both in one frame"):
        touchup.compare(beside, small, samples=100)


def test_deviations_are_the_distances_of_trimesh(ring, refined):
    compared = touchup.compare(refined.mesh, touchup.Mesh.of(ring, "mm"), samples=5000)
    _, distance, _ = trimesh.proximity.closest_point_naive(ring, refined.mesh.vertices[::50] * 1e3)
    assert np.allclose(np.abs(compared.deviation[::50]) * 1e3, distance, atol=1e-9)


def bracket():
    """Two boxes that lie on no symmetry of one another, finely cut, m."""
    boxes = [trimesh.creation.box((30, 20, 8)), trimesh.creation.box((6, 14, 10))]
    boxes[1].apply_translation((8, 2, 11))
    return trimesh.util.concatenate(boxes).subdivide().subdivide()


def test_a_small_motion_is_taken_back():
    part = bracket()
    motion = trimesh.transformations.rotation_matrix(0.01, (1, 2, 3), (5, 0, 0))
    motion[:3, 3] += (0.2, -0.1, 0.3)
    moved = part.copy().apply_transform(motion)
    found = touchup.align(moved, part, unit="mm")
    back = np.linalg.inv(motion)
    assert np.allclose(found.matrix[:3, :3], back[:3, :3], atol=1e-4)
    assert np.allclose(found.apply(moved, "mm").vertices * 1e3, part.vertices, atol=0.02)
    assert found.report["undetermined"] == 0


def test_pairs_are_fitted_as_by_the_singular_value_decomposition():
    random = np.random.default_rng(1)
    before = random.normal(scale=0.05, size=(12, 3))
    motion = trimesh.transformations.rotation_matrix(0.7, (1, -1, 2))[:3, :3]
    after = before @ motion.T + (0.1, 0.2, 0.3) + random.normal(scale=1e-4, size=before.shape)
    found = touchup.align_pairs(before, after)
    u, _, vt = np.linalg.svd((before - before.mean(0)).T @ (after - after.mean(0)))
    turn = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    assert np.allclose(found.matrix[:3, :3], turn, atol=1e-9)
    assert np.allclose(found.matrix[:3, 3], after.mean(0) - turn @ before.mean(0), atol=1e-9)
    assert np.allclose(found.residuals, after - (before @ turn.T + found.matrix[:3, 3]), atol=1e-9)


def test_a_ring_is_free_to_turn_and_the_error_says_about_which_axis(ring):
    with pytest.raises(touchup.TouchupError, match="alignment|turn|symmetric") as refusal:
        touchup.align(ring, ring, "features", unit="mm")
    assert refusal.value.kind == "alignment"


def test_a_method_that_is_none_is_refused():
    with pytest.raises(touchup.TouchupError, match='must be "icp" or "features"'):
        touchup.align(plate(), plate(), "magic")
