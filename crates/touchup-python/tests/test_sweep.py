"""Sweeps and what-if of the package against the command."""

import json

import numpy as np
import pytest
import touchup
from conftest import SCENE, done, run


@pytest.fixture(scope="module")
def planned(touched_files, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    grid = {
        "scan": str(touched_files / "scan.ply"),
        "mesh_unit": "m",
        "recordings": [str(touched_files / "touch.mcap")],
        "scene": str(touched_files / "scene.yaml"),
        "keys": {"tip.stiffness_n_per_mm": [20, 10]},
    }
    (folder / "grid.yaml").write_text(json.dumps(grid), encoding="utf-8")
    assert touchup.sweep.plan(folder / "grid.yaml", folder / "jobs.jsonl") == 2
    return folder


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_job_is_the_same_from_files_bytes_and_by_the_command(planned, touched_files):
    jobs = planned / "jobs.jsonl"
    assert [job["keys"] for job in touchup.sweep.jobs(jobs)] == [{"tip.stiffness_n_per_mm": 20}, {"tip.stiffness_n_per_mm": 10}]
    of_command = done("sweep", "run", jobs, "--job", 0, "--json")
    of_files = touchup.sweep.run_job(jobs, 0, planned / "by_files")
    given = {name: (touched_files / file).read_bytes() for name, file in (("scan", "scan.ply"), ("recording", "touch.mcap"))}
    of_bytes = touchup.sweep.run_job(jobs, 0, planned / "by_bytes", **given)
    assert of_files.summary == of_bytes.summary == of_command["summary"]
    assert not of_files.was_there and of_files.failed is None
    results = [files(planned / place / of_files.id) for place in ("results", "by_files", "by_bytes")]
    assert results[0] == results[1] == results[2] and "refined.ply" in results[0]
    assert touchup.sweep.run_job(jobs, 0, planned / "by_files").was_there
    with pytest.raises(touchup.TouchupError, match="not what was planned"):
        touchup.sweep.run_job(jobs, 1, planned / "by_bytes", scan=given["scan"] + b" ")
    with pytest.raises(touchup.TouchupError, match="has no job 2"):
        touchup.sweep.run_job(jobs, 2, planned / "by_bytes")


def test_tables_and_what_if_are_those_of_the_command(planned):
    jobs = planned / "jobs.jsonl"
    done("sweep", "run", jobs, "--json")
    rows = touchup.sweep.table(jobs)
    assert [row["tip.stiffness_n_per_mm"] for row in rows] == [20, 10]
    assert all(row["samples"] > 0 for row in rows)
    assert len(touchup.sweep.features(jobs)) == sum(row["features"] for row in rows)
    folders = [planned / "results" / row["id"] for row in rows]
    found = touchup.what_if(*folders)
    report = done("whatif", 0, 1, "--jobs", jobs, "--json")
    assert found.keys == report["keys"] == {"tip.stiffness_n_per_mm": [20, 10]}
    assert int(found.b.moved.sum()) == report["vertices_b"]["moved"] > 0
    assert int(found.a.moved.sum()) == report["vertices_a"]["moved"]
    assert found.b.displacement.shape == (len(found.b.mesh.vertices),)
    # a softer stylus bends farther: what it touched lies higher
    assert np.median(found.b.displacement[found.b.moved]) > 0
    assert run("whatif", folders[0], planned).returncode == 3
    assert SCENE["tip"]["stiffness_n_per_mm"] == 20
