"""Sweeps of ``touchup sweep``: `plan` makes jobs, `run_job` runs one for engines that call Python (``touchup.ray`` is one), `table` and
`features` list the results of all."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from . import _touchup
from .mesh import Path


def plan(grid: Path, out: Path, *, recordings: Iterable[Path] = ()) -> int:
    """Writes the jobs of a sweep, a line of JSON for each, and returns their number.

    - `grid`: file of YAML with the swept settings (docs/sweep.md). `out`: the jobs; paths in them are relative to its folder.
    - `recordings`: further recordings beside those that the file names.
    """
    return _touchup.sweep_plan(grid, list(recordings), out)


def jobs(path: Path) -> list[dict[str, Any]]:
    """The jobs of a plan, in its order: `job`, `id`, `scan`, `recording`, `seed`, `keys` and so on."""
    with open(path, encoding="utf-8") as lines:
        return [json.loads(line) for line in lines if line.strip()]


@dataclass(frozen=True)
class JobReport:
    """Result of a job.

    - `job`: its number in the plan. `id`: the name of its result. `result`: the folder of that.
    - `was_there`: whether the job had its result before.
    - `failed`: reason of the failure, in the words of ``touchup refine``; None for a success. `summary`: its ``summary.json``,
      None for a failure.
    """

    job: int
    id: str
    result: str
    was_there: bool
    failed: str | None
    summary: dict[str, Any] | None


def run_job(
    jobs: Path,
    job: int,
    results: Path | None = None,
    *,
    scan: bytes | None = None,
    recording: bytes | None = None,
    again: bool = False,
) -> JobReport:
    """Runs one job, as ``touchup sweep run --job`` does: the same bytes. A job with a result returns at once.

    - `jobs`: file that ``touchup sweep plan`` wrote. `job`: number of the job, from 0 on.
    - `results`: the folder of the results; ``results`` beside `jobs` unless you say otherwise.
    - `scan`, `recording`: content of their files if already read: then the job does not read them.
    - `again`: also runs a job with a result, and replaces it.

    Raises `TouchupError` for a file that differs from the plan. A recording that cannot be refined is a result, with `failed`.
    """
    made = _touchup.run_job(jobs, job, results, scan, recording, again)
    return JobReport(**{**made, "result": str(made["result"]), "summary": json.loads(made["summary"])})


def table(jobs: Path, results: Path | None = None) -> list[dict[str, Any]]:
    """A row for each job that has a result, in the order of the plan, for ``pandas.DataFrame``; warns of changed results.

    `job`, `id`, `recording`, `seed`, each key, `failed`, then the numbers of the summary. A row has only its own keys.

    - `results`: the folder of the results; ``results`` beside `jobs` unless you say otherwise.
    """
    return _tables(jobs, results, False)["jobs"]


def features(jobs: Path, results: Path | None = None) -> list[dict[str, Any]]:
    """A row for each feature of each job that has a result: `job`, `job_id`, then its keys in ``features.json``."""
    return _tables(jobs, results, True)["features"]


def _tables(jobs: Path, results: Path | None, with_features: bool) -> dict[str, list[dict[str, Any]]]:
    tables: dict[str, list[Any]] = json.loads(_touchup.sweep_tables(jobs, results, with_features))
    for damaged in tables["damaged"]:
        warnings.warn(damaged, stacklevel=3)
    return tables
