"""Speed-up of a sweep by Ray with two workers over one process.

    python benches/sweep.py [JOBS] [SECONDS]      jobs, 200; seconds of touches in each, 20

Both run the same jobs on a quiet machine; each worker of Ray has a CPU. A line of its own gives the start of the cluster, which a running
one saves. The results must be the same bytes.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import ray
import touchup.ray
import trimesh

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from sweeps import files_of, planned

WORKERS = 2


def seconds_of(work):
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main():
    count, seconds = (int(word) for word in [*sys.argv[1:3], *["200", "20"][len(sys.argv) - 1 :]])
    ring = trimesh.creation.annulus(r_min=4.0, r_max=11.0, height=5.0, sections=96)
    with tempfile.TemporaryDirectory() as folder:
        jobs = planned(Path(folder), ring, seeds=(1, 2), seconds=seconds, stiffnesses=range(10, 10 + count // 4), on_n=[0.3, 0.4])
        count = 2 * 2 * (count // 4)
        command = [Path(sys.executable).with_name("touchup"), "sweep", "run", jobs, "--results", jobs.parent / "serial"]
        serial = seconds_of(lambda: subprocess.run(command, check=True, capture_output=True))
        start = seconds_of(lambda: ray.init(num_cpus=WORKERS, include_dashboard=False))
        parallel = seconds_of(lambda: touchup.ray.run(jobs, jobs.parent / "ray"))
        ray.shutdown()
        assert files_of(jobs.parent / "ray") == files_of(jobs.parent / "serial")
    print(f"{count} jobs: one process {serial:.1f} s; Ray with {WORKERS} workers {parallel:.1f} s, {serial / parallel:.2f} times as fast")
    print(f"start of the cluster {start:.1f} s: with it {serial / (parallel + start):.2f} times")


if __name__ == "__main__":
    main()
