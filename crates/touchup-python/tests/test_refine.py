"""The refinement of arrays and of files, beside the command."""

import sys
import threading
import time

import numpy as np
import pytest
import touchup
from conftest import SCENE, done, plate, slide

QUIET = pytest.mark.filterwarnings("ignore::touchup.TouchupWarning")


@QUIET
def test_arrays_and_the_command_make_the_same_mesh_bit_by_bit(refined, touched_files):
    folder = touched_files
    names = ("scan.ply", "touch.mcap", "scene.yaml", "out.ply", "touches.csv")
    scan, bag, scene, out, touches = (folder / name for name in names)
    summary = done(
        *("refine", "--scan", scan, "--mesh-unit", "m", "--bag", bag, "--scene", scene, "--json"),
        *("--out", out, "--touches-out", touches),
    )
    by_command = touchup.Mesh.read(out, "m")
    assert np.array_equal(refined.mesh.vertices, by_command.vertices)
    assert np.array_equal(refined.mesh.faces, by_command.faces)
    assert np.array_equal(refined.mesh.support, by_command.support)
    assert np.allclose(refined.mesh.sigma, by_command.sigma, rtol=1e-6, atol=1e-12)
    for key in ("samples", "accepted", "refused", "contacts", "moved_faces", "cut_back", "findings", "uncertainty", "friction"):
        assert refined.summary[key] == summary[key], key
    by_file = touchup.Touches.read(touches)
    assert np.allclose(refined.touches.point, by_file.point, atol=1e-9)
    assert np.array_equal(refined.touches.stamp_ns, by_file.stamp_ns)


@QUIET
def test_files_make_the_same_mesh_as_arrays(refined, touched_files):
    folder = touched_files
    again = touchup.refine(folder / "scan.ply", folder / "touch.mcap", folder / "scene.yaml", unit="m")
    assert np.array_equal(again.mesh.vertices, refined.mesh.vertices)


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
    sys.setswitchinterval(1e3)  # nobody is interrupted: a tick comes only where the interpreter is let go of
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
