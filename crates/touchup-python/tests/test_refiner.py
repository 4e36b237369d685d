"""The refinement sample by sample."""

import numpy as np
import pytest
import touchup
from conftest import SCENE, plate, slide

HAPTIC = {**SCENE, "patch": False}


def pushed_one_by_one(samples, of=lambda row: row):
    refiner = touchup.Refiner(plate(), HAPTIC)
    rows = zip(samples.stamp_ns.tolist(), samples.position, samples.orientation_xyzw, samples.force, samples.torque)
    updates = [refiner.push(stamp, of(p), of(q), of(f), of(t)) for stamp, p, q, f, t in rows]
    return refiner, updates


def test_many_samples_do_what_they_do_one_by_one():
    samples = slide(0.1e-3, count=500)
    one_by_one, updates = pushed_one_by_one(samples)
    at_once = touchup.Refiner(plate(), HAPTIC)
    pushed = at_once.push_many(samples)
    assert np.array_equal(one_by_one.mesh.vertices, at_once.mesh.vertices)
    cases = ("free", "mesh_only", "surface_only", "both")
    assert [update.case for update in updates] == [cases[case] for case in pushed.case]
    assert [-1 if update.face is None else update.face for update in updates] == pushed.face.tolist()
    assert one_by_one.counts == at_once.counts and pushed.refused == {} and pushed.first_refusal is None


@pytest.mark.parametrize("of", [tuple, list, lambda row: row.astype(np.float32), lambda row: np.repeat(row, 2)[::2]])
def test_vectors_may_be_tuples_lists_and_arrays_of_any_kind(of):
    samples = slide(0.125e-3, count=50, force=2.0)
    exact = touchup.Samples(samples.stamp_ns, samples.position.astype(np.float32), samples.force)
    by_rows, _ = pushed_one_by_one(exact)
    by_others, _ = pushed_one_by_one(exact, of)
    assert np.array_equal(by_rows.mesh.vertices, by_others.mesh.vertices)


def test_a_plane_is_felt_where_the_ball_bends_towards_it():
    height, force, stiffness = 0.15e-3, 2.0, 2e4
    refiner, updates = pushed_one_by_one(slide(height, count=16000, force=force, stiffness=stiffness))
    first = next(update for update in updates if update.case != "free")
    # the ball of the pose is lower than the real one, by the bend of the tip
    assert first.distance == pytest.approx(height - force / stiffness, abs=1e-9)
    x, y, z = refiner.mesh.vertices.T
    # well inside of the swept region; at its rim faces tilt
    inside = (np.abs(x - 0.01) < 0.004) & (np.abs(y - 0.01) < 0.004)
    assert inside.sum() > 40 and np.median(z[inside]) == pytest.approx(height, abs=2e-6)


def test_a_refused_sample_changes_nothing_and_says_why():
    samples = slide(0.1e-3, count=300)
    refiner, _ = pushed_one_by_one(samples)
    before = refiner.mesh.vertices
    for position, says in [((0, 0, float("nan")), "position .* is not finite"), ((2e3, 0, 0), "beyond")]:
        with pytest.raises(touchup.TouchupError, match=says) as refusal:
            refiner.push(10**12, position, (0, 0, 0, 1), (0, 0, 1))
        assert refusal.value.kind == "refinement" and refusal.value.exit_code == 3
    with pytest.raises(touchup.TouchupError, match="not after"):
        refiner.push(0, (0, 0, 0), (0, 0, 0, 1), (0, 0, 1))
    with pytest.raises(touchup.TouchupError, match="quaternion of length 2"):
        refiner.push(10**12, (0, 0, 0), (0, 0, 0, 2), (0, 0, 1))
    assert np.array_equal(refiner.mesh.vertices, before)


def test_refused_samples_among_many_are_counted():
    samples = slide(0.1e-3, count=100)
    samples.stamp_ns[50] = 0
    pushed = touchup.Refiner(plate(), HAPTIC).push_many(samples)
    assert pushed.refused == {"sample": 1} and np.flatnonzero(pushed.case == 255).tolist() == [50]
    assert pushed.first_refusal[0] == 50 and "order of time" in pushed.first_refusal[1]


def test_events_tell_when_contact_begins_and_ends():
    samples = slide(0.1e-3, count=900)
    samples.force[:300] = 0
    samples.position[:300, 2] += 5e-3
    samples.force[600:] = 0
    samples.position[600:, 2] += 5e-3
    refiner = touchup.Refiner(plate(), HAPTIC)
    events = refiner.events(samples, chunk=64)
    first = next(events)
    assert first.kind == "contact" and first.index == first.stamp_ns // 1_000_000 and 300 <= first.index < 320
    assert refiner.counts["accepted"] < 900, "what is not asked for is not taken"
    (last,) = events
    assert last.kind == "lift" and 600 <= last.index < 620 and last.face is not None
    assert refiner.counts["accepted"] == 900


def test_a_finished_refiner_takes_no_more():
    refiner, _ = pushed_one_by_one(slide(0.1e-3, count=300))
    mesh = refiner.mesh
    counts = refiner.counts
    finished = refiner.finish()
    assert np.array_equal(finished.mesh.vertices, mesh.vertices) and finished.mesh.support is None
    assert refiner.counts == counts
    with pytest.raises(touchup.TouchupError, match="finished"):
        refiner.push(10**12, (0, 0, 0), (0, 0, 0, 1), (0, 0, 1))


def test_arrays_that_differ_in_length_are_refused():
    with pytest.raises(touchup.TouchupError, match="force has 2 rows and stamp_ns has 3"):
        samples = touchup.Samples(np.arange(3), np.zeros((3, 3)), np.zeros((2, 3)))
        touchup.Refiner(plate(), HAPTIC).push_many(samples)


def test_stamps_in_seconds_are_refused():
    with pytest.raises(touchup.TouchupError, match="1e9"):
        touchup.Samples(np.array([0.0, 0.001]), np.zeros((2, 3)), np.zeros((2, 3)))


def test_what_was_pushed_is_judged_as_a_recording_is():
    samples = slide(0.2e-3)
    refiner = touchup.Refiner(plate(), SCENE, wrench_frame="object")
    refiner.push_many(samples)
    finished, refined = refiner.finish(force=True), touchup.refine(plate(), samples.recording("object"), SCENE, force=True)
    assert np.array_equal(finished.mesh.vertices, refined.mesh.vertices)
    assert finished.summary["findings"] == refined.summary["findings"]
    assert finished.summary["samples"] == len(samples) == finished.summary["accepted"] and finished.summary["refused"] == {}


def test_forces_of_the_wrong_sign_are_refused_at_the_end():
    samples = slide(0.2e-3)
    for push in ("push_many", "push"):
        refiner = touchup.Refiner(plate(), SCENE)
        reverse = touchup.Samples(samples.stamp_ns, samples.position, -samples.force)
        if push == "push_many":
            refiner.push_many(reverse)
        else:
            for row in zip(*reverse._arrays()):
                refiner.push(*row)
        with pytest.raises(touchup.TouchupError, match="force"):
            refiner.finish()
