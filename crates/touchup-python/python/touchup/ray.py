"""Runs the jobs of ``touchup sweep plan`` on Ray, which the extra `ray` of the wheel brings: ``python -m touchup.ray jobs.jsonl``.

Results are those of ``touchup sweep run``, byte for byte, and ``touchup sweep table`` reads them. Every machine of a cluster must see the
files of the jobs and the folder of the results under the same paths.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ray
import ray.data

from . import sweep
from ._touchup import TouchupError
from .mesh import Path as AnyPath


def run(
    jobs: AnyPath,
    results: AnyPath | None = None,
    *,
    address: str | None = None,
    max_retries: int = 20,
    on_done: Callable[[int, int], None] | None = None,
) -> None:
    """Runs the jobs that have no result yet, as many at a time as the cluster has CPUs.

    Ray Data reads each recording once; the object store shares them and the scans, and spills the excess.

    - `results`: the folder of the results; ``results`` beside `jobs` unless you say otherwise.
    - `address`: of a running cluster; left out, and if Ray was not started before, this machine alone.
    - `max_retries`: number of restarts of a job whose worker died.
    - `on_done`: called after each job with the number of jobs with a result, and the number of all.

    Raises `TouchupError` for a file that differs from the plan. A recording that cannot be refined is a result: the table has the reason.
    """
    plan = Path(jobs).resolve()
    folder = plan.parent / "results" if results is None else Path(results).resolve()
    rows = [json.loads(line) for line in plan.read_text(encoding="utf-8").splitlines()]
    missing = [row for row in rows if not (folder / row["id"]).is_dir()]
    if not ray.is_initialized():
        ray.init(address=address, include_dashboard=False)
    scans = {path: ray.put(path.read_bytes()) for path in _files(missing, "scan", plan)}
    recordings = _read(_files(missing, "recording", plan))
    job: Any = ray.remote(_job).options(max_retries=max_retries)
    resources: Any = ray.cluster_resources
    queue, waiting = iter(missing), list[Any]()
    done, most = len(rows) - len(missing), max(16, 4 * int(resources().get("CPU", 0)))
    try:
        while True:
            for row in itertools.islice(queue, most - len(waiting)):
                scan, recording = (plan.parent / row[name] for name in ("scan", "recording"))
                waiting.append(job.remote(plan, row["job"], folder, scans.get(scan), recording, recordings.get(recording)))
            if not waiting:
                return
            ready, waiting = ray.wait(waiting)
            ray.get(ready)
            done += len(ready)
            if on_done:
                on_done(done, len(rows))
    except ray.exceptions.RayTaskError as error:
        raise (error.cause if isinstance(error.cause, TouchupError) else error) from None
    finally:
        for begun in waiting:
            ray.cancel(begun)


def _job(plan: Path, job: int, results: Path, scan: bytes | None, recording: Path, table: Any) -> None:
    """One job on a worker; `table` has the bytes of files by their path, among them those of the recording, unless it is a folder."""
    of_path = {} if table is None else dict(zip(table["path"].to_pylist(), table["bytes"], strict=True))
    found = of_path.get(str(recording))
    sweep.run_job(plan, job, results, scan=scan, recording=None if found is None else found.as_py())


def _files(rows: list[dict[str, Any]], name: str, plan: Path) -> list[Path]:
    """Files that the jobs read, each once; the job itself reads a folder of rosbag2."""
    return [path for path in {plan.parent / row[name]: None for row in rows} if path.is_file()]


def _read(paths: list[Path]) -> dict[Path, Any]:
    """Of each file the table in the object store that has its bytes."""
    if not paths:
        return {}
    read = ray.data.read_binary_files([str(path) for path in paths], include_paths=True, override_num_blocks=len(paths))
    tables = read.to_arrow_refs()
    names: Any = ray.remote(_names)
    return {Path(name): table for table in tables for name in ray.get(names.remote(table))}


def _names(table: Any) -> list[str]:
    names: list[str] = table["path"].to_pylist()
    return names


def main() -> int:
    """``python -m touchup.ray``."""
    parser = argparse.ArgumentParser(prog="python -m touchup.ray", description="Runs the jobs of a sweep on Ray")
    parser.add_argument("jobs", help="jobs, as touchup sweep plan writes them")
    parser.add_argument("--results", metavar="DIR", help="default: results beside the jobs")
    parser.add_argument("--address", help="of a running cluster; default: this machine alone")
    parser.add_argument("--max-retries", type=int, default=20, help="how often a job is begun again whose worker died (default: 20)")
    given = parser.parse_args()
    try:
        run(**vars(given), on_done=lambda done, of: print(f"{done} of {of} jobs have a result", file=sys.stderr))
    except TouchupError as error:
        print(f"touchup: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
