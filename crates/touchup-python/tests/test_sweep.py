"""Sweeps and what-if of the package."""

import json
from pathlib import Path

import numpy as np
import pytest
import touchup


@pytest.fixture(scope="module")
def planned(touched_files, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    grid = {
        "scan": str(touched_files / "scan.ply"),
        "mesh_unit": "m",
        "recordings": [str(touched_files / "touch.mcap")],
        "scene": str(touched_files / "scene.yaml"),
        "keys": {"tip.stiffness_n_per_mm": [20, 18]},
    }
    (folder / "grid.yaml").write_text(json.dumps(grid), encoding="utf-8")
    assert touchup.sweep.plan(folder / "grid.yaml", folder / "jobs.jsonl") == 2
    return folder


def test_a_job_is_run_once_and_refuses_what_was_not_planned(planned, touched_files):
    jobs = planned / "jobs.jsonl"
    assert [job["keys"] for job in touchup.sweep.jobs(jobs)] == [{"tip.stiffness_n_per_mm": 20}, {"tip.stiffness_n_per_mm": 18}]
    made = touchup.sweep.run_job(jobs, 0)
    assert made.failed is None and not made.was_there and made.summary["samples"] > 0
    assert {path.name for path in Path(made.result).iterdir()} == {"SHA256SUMS", "job.json", "summary.json", "refined.ply", "features.json"}
    assert touchup.sweep.run_job(jobs, 0).was_there
    given = {name: (touched_files / file).read_bytes() for name, file in (("scan", "scan.ply"), ("recording", "touch.mcap"))}
    # `run_job` checks the given contents for any folder of results
    with pytest.raises(touchup.TouchupError, match="not what was planned"):
        touchup.sweep.run_job(jobs, 1, planned / "others", scan=given["scan"] + b" ", recording=given["recording"])
    assert not touchup.sweep.run_job(jobs, 1, **given).was_there
    with pytest.raises(touchup.TouchupError, match="has no job 2"):
        touchup.sweep.run_job(jobs, 2)


def test_tables_and_what_if_are_of_the_results(planned):
    jobs = planned / "jobs.jsonl"
    results = [touchup.sweep.run_job(jobs, job) for job in range(2)]
    rows = touchup.sweep.table(jobs)
    assert [(row["id"], row["tip.stiffness_n_per_mm"]) for row in rows] == [(results[0].id, 20), (results[1].id, 18)]
    assert [row["samples"] for row in rows] == [result.summary["samples"] for result in results]
    assert len(touchup.sweep.features(jobs)) == sum(row["features"] for row in rows)
    found = touchup.what_if(results[0].result, results[1].result)
    assert found.keys == {"tip.stiffness_n_per_mm": [20, 18]}
    assert found.b.moved.sum() > 0 and found.b.displacement.shape == (len(found.b.mesh.vertices),)
    # a softer stylus bends farther: its touches lie higher
    assert np.median(found.b.displacement[found.b.moved]) > 0
    with pytest.raises(touchup.TouchupError):
        touchup.what_if(results[0].result, planned)
