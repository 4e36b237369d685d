"""The refinement of arrays and of files."""

import sys
import threading
import time
import warnings

import numpy as np
import pytest
import touchup
from conftest import SCENE, plate, slide

QUIET = pytest.mark.filterwarnings("ignore::touchup.TouchupWarning")


@QUIET
def test_files_make_what_arrays_make(refined, touched_files):
    """Bit by bit; that the command makes it too of the same files is a test of it (`a_job_is_what_refine_does`)."""
    folder = touched_files
    again = touchup.refine(folder / "scan.ply", folder / "touch.mcap", folder / "scene.yaml", unit="m")
    for of in ("mesh", "touches"):
        ours, theirs = (vars(getattr(one, of)) for one in (again, refined))
        assert ours.keys() == theirs.keys()
        for name, value in ours.items():
            assert np.array_equal(value, theirs[name]), name
    for key in ("samples", "accepted", "refused", "contacts", "moved_faces", "cut_back", "findings", "uncertainty", "friction"):
        assert again.summary[key] == refined.summary[key], key


OWN_COLUMNS = {"time": "when_s", "position": ["px_mm", "py_mm", "pz_mm"], "force": ["a_N", "b_N", "c_N"]}


def test_a_table_is_read_by_the_columns_that_the_scene_names(tmp_path):
    samples, table, scene = slide(0.2e-3), tmp_path / "own.csv", {**SCENE, "columns": OWN_COLUMNS}
    names = [OWN_COLUMNS["time"], *OWN_COLUMNS["position"], *OWN_COLUMNS["force"]]
    rows = zip(samples.stamp_ns * 1e-9, samples.position * 1e3, samples.force)
    lines = [",".join(map(repr, map(float, (stamp, *position, *force)))) for stamp, position, force in rows]
    table.write_text("\n".join([",".join(names), *lines]), encoding="utf-8")
    read = touchup.Recording.read(table, scene=scene)
    assert np.array_equal(read.pose_stamp_ns, samples.stamp_ns) and np.array_equal(read.wrench_stamp_ns, samples.stamp_ns)
    assert np.allclose(read.position, samples.position, rtol=0, atol=1e-15) and np.array_equal(read.force, samples.force)
    by_file, by_arrays = (touchup.refine(plate(), of, scene, force=True) for of in (table, read))
    assert np.array_equal(by_file.mesh.vertices, by_arrays.mesh.vertices)
    with pytest.raises(touchup.TouchupError, match="px_mm"):
        touchup.Recording.read(table)


def test_what_is_doubtful_is_warned_of():
    """A plane touched in strokes by a leaning hand whose forces turn with the stylus, with orientations of the other direction."""
    samples = slide(0.2e-3, count=8000)
    lean = np.stack([40 + 20 * np.sin(np.arange(8000) / 700), 30 * np.cos(np.arange(8000) / 900)], axis=1) * np.pi / 360
    sine, cosine = np.sin(lean), np.cos(lean)
    # about x, then about y
    turn = np.stack([sine[:, 0] * cosine[:, 1], cosine[:, 0] * sine[:, 1], -sine[:, 0] * sine[:, 1], cosine[:, 0] * cosine[:, 1]], axis=1)
    x, y, z, w = turn.T
    # force along z of the scan, in the axes of the tip
    up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    right = touchup.Samples(samples.stamp_ns, samples.position, 2.0 * up, turn)
    wrong = touchup.Samples(samples.stamp_ns, samples.position, 2.0 * up, turn * [-1, -1, -1, 1])
    with warnings.catch_warnings():
        warnings.simplefilter("error", touchup.TouchupWarning)
        assert not touchup.refine(plate(), right, SCENE).summary["findings"]
    with pytest.warns(touchup.TouchupWarning, match="wrench"):
        doubtful = touchup.refine(plate(), wrong, SCENE, force=True)
    assert doubtful.summary["findings"]


def lifted(of_strokes):
    """A plane touched in strokes; one in `of_strokes` of them meets a part pushed up by 0.1 mm in between."""
    samples = slide(0.2e-3, count=8000)
    is_lifted = np.arange(8000) // 400 % of_strokes == 1
    return touchup.Samples(samples.stamp_ns, samples.position + 0.1e-3 * is_lifted[:, None] * [0, 0, 1], samples.force)


def test_contacts_that_contradict_each_other_are_warned_of_and_refused_where_they_are_many():
    with pytest.warns(touchup.TouchupWarning, match=r"2\d % of the contacts contradicted others"):
        summary = touchup.refine(plate(), lifted(4), SCENE).summary["uncertainty"]
    # of 8000, one stroke of four
    assert 1600 <= summary["rejected"] <= 2400
    with pytest.raises(touchup.TouchupError, match="50 % of the contacts contradicted others") as refused:
        touchup.refine(plate(), lifted(2), SCENE)
    assert (refused.value.kind, refused.value.exit_code) == ("input", 3)
    with pytest.warns(touchup.TouchupWarning, match="50 % of the contacts contradicted others"):
        touchup.refine(plate(), lifted(2), SCENE, force=True)


def test_faces_that_are_left_out_are_warned_of():
    vertices, faces = plate()
    vertices[0] = np.nan
    # the corner at which the square is not cut
    with pytest.warns(touchup.TouchupWarning, match="the coordinates of a corner are no place: 1$"):
        touchup.refine((vertices, faces), slide(0.2e-3), SCENE)


def test_arrays_that_hold_no_numbers_are_refused():
    samples = slide(0.2e-3, count=10)
    hidden = np.ma.array(samples.position, mask=np.zeros((10, 3), bool))
    assert np.array_equal(touchup.Samples(samples.stamp_ns, hidden, samples.force).position, samples.position)
    hidden[3, 1] = np.ma.masked
    for position, message in [(hidden, "masked"), (samples.position.astype(str), "of numbers"), (samples.position > 0, "of numbers")]:
        with pytest.raises(touchup.TouchupError, match=message):
            touchup.Samples(samples.stamp_ns, position, samples.force)
    with pytest.raises(touchup.TouchupError, match="touchup.Samples, not tuple"):
        touchup.Refiner(plate(), SCENE).push_many((samples.stamp_ns, samples.position, samples.force))


def test_names_that_do_not_go_together_are_refused(touched_files):
    file, scan = touched_files / "touch.mcap", plate()
    for message, named in [
        ("name pose_frame", {"base_frame": "base"}),
        ("leave out pose_topic", {"markers_topic": "/markers", "pose_topic": "/pose"}),
        ("must be header or log", {"stamp": "Header"}),
        ("/stylus/pose", {"pose_topic": "/nowhere"}),
    ]:
        with pytest.raises(touchup.TouchupError, match=message):
            touchup.refine(scan, file, SCENE, **named)
    with pytest.raises(touchup.TouchupError, match="the recording is arrays"):
        touchup.refine(scan, slide(0.2e-3), SCENE, pose_topic="/pose")


def test_what_was_touched_is_nearer_to_the_part_than_the_scan(ring, touched, refined):
    before = touchup.compare(touched.scan, touchup.Mesh.of(ring, "mm")).region()["vertices_to_truth"]["rms_mm"]
    touched_part = touchup.compare(refined.mesh, touchup.Mesh.of(ring, "mm")).region("touched")
    assert touched_part["vertices_to_truth"]["rms_mm"] < before / 3


@QUIET
def test_a_flat_scan_comes_up_to_the_plane_that_was_touched():
    height = 0.2e-3
    refined = touchup.refine(plate(), slide(height), SCENE, force=True)
    is_touched = refined.mesh.support == touchup.TOUCHED
    x, y, z = refined.mesh.vertices.T
    # 10 mm of strokes each way; at their rim the surface bends down to the scan, and says how uncertain it is there
    inside = is_touched & (np.abs(x - 0.01) < 0.0045) & (np.abs(y - 0.01) < 0.0045)
    assert inside.sum() > 40 and np.allclose(z[inside], height, atol=5e-6)
    assert (np.abs(z - height)[is_touched] < 2 * refined.mesh.sigma[is_touched]).all()


def test_other_threads_run_while_a_scan_is_refined(touched):
    ticks, is_over = 0, threading.Event()

    def tick():
        nonlocal ticks
        while not is_over.is_set():
            ticks += 1
            time.sleep(0)  # gives the interpreter back by itself

    beside = threading.Thread(target=tick)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e3)  # no interruption: a tick comes only when the push releases the interpreter
    try:
        beside.start()
        time.sleep(0.01)
        scan, recording = touched.scan._arrays(), touched.recording
        arguments = ('{"tip": {"radius_mm": 1.5}}', None, scan, None, recording._poses(), recording._wrenches())
        before = ticks
        touchup._touchup.refine(*arguments, "sensor", None, True)
        during = ticks - before
    finally:
        is_over.set()
        sys.setswitchinterval(interval)
        beside.join()
    assert during > 100


def test_touches_come_back_from_their_file(refined, tmp_path):
    refined.touches.write(tmp_path / "touches.csv")
    again = touchup.Touches.read(tmp_path / "touches.csv")
    assert len(again) == len(refined.touches)
    for name in ("centre", "point", "normal", "sigma"):
        assert np.allclose(getattr(again, name), getattr(refined.touches, name), atol=1e-6), name
