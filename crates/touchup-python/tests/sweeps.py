"""A sweep of small jobs: seconds of touches on the ring, and the results of its engines."""

import json

import touchup
from conftest import run

# two recordings, three stiffnesses
STIFFNESSES, ON_N = [15, 20, 25], [0.3, 0.4]


def part_of(recording, seconds):
    """The first `seconds` of a recording in which the ball touches."""
    begin = recording.wrench_stamp_ns[(recording.force**2).sum(1) > 1][0]
    poses, wrenches = (
        (begin <= stamps) & (stamps < begin + seconds * 10**9) for stamps in (recording.pose_stamp_ns, recording.wrench_stamp_ns)
    )
    return touchup.Recording(
        recording.pose_stamp_ns[poses],
        recording.position[poses],
        recording.orientation_xyzw[poses],
        recording.wrench_stamp_ns[wrenches],
        recording.force[wrenches],
        recording.torque[wrenches],
        recording.wrench_frame,
    )


def planned(folder, ring, seeds=(1, 2), seconds=4, stiffnesses=STIFFNESSES, on_n=ON_N):
    """Plans a job for each seed, stiffness and threshold; the path of the jobs."""
    for seed in seeds:
        touched = touchup.simulate(ring, unit="mm", seed=seed, scan_noise_mm=0.1, scan_edge_mm=1.5)
        part_of(touched.recording, seconds).write(folder / f"touch_{seed}.mcap")
    touched.scan.write(folder / "scan.ply")
    grid = {
        "scan": "scan.ply",
        "recordings": [f"touch_{seed}.mcap" for seed in seeds],
        "keys": {"tip.stiffness_n_per_mm": list(stiffnesses), "contact.on_n": list(on_n)},
    }
    # JSON is YAML
    (folder / "grid.yaml").write_text(json.dumps({**grid, "mesh_unit": "mm", "scene": "scene.yaml"}), encoding="utf-8")
    (folder / "scene.yaml").write_text("tip: {radius_mm: 1.5}\nscan: {noise_mm: 0.1}\n", encoding="utf-8")
    command("sweep", "plan", folder / "grid.yaml", "--out", folder / "jobs.jsonl")
    rows = rows_of(folder / "jobs.jsonl")
    assert len(rows) == len(seeds) * len(stiffnesses) * len(on_n)
    return folder / "jobs.jsonl"


def rows_of(jobs):
    return [json.loads(line) for line in jobs.read_text(encoding="utf-8").splitlines()]


def command(*arguments, cwd=None):
    ended = run(*arguments, cwd=cwd)
    assert ended.returncode == 0, ended.stderr


def table(jobs, results):
    """The bytes of the tables of jobs and features."""
    jobs_out, features_out = results.with_suffix(".csv"), results.with_suffix(".features.csv")
    command("sweep", "table", jobs, "--results", results, "--out", jobs_out, "--features-out", features_out)
    return jobs_out.read_bytes(), features_out.read_bytes()


def files_of(results):
    """Every file below the results, hidden ones too, by its path there."""
    return {path.relative_to(results).as_posix(): path.read_bytes() for path in results.rglob("*") if path.is_file()}
