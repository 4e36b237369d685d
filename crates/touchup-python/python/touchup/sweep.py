"""Many refinements as jobs that give the same bytes wherever they run: what ``touchup sweep`` does, for engines of Python."""

from __future__ import annotations

import json
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Iterable

from . import _touchup

_Path = str | PathLike[str]


def plan(grid: _Path, out: _Path, *, recordings: Iterable[_Path] = ()) -> int:
    """Writes the jobs of a sweep, a line of JSON for each, and returns how many there are.

    - `grid`: what is swept, a file of YAML (docs/sweep.md). `out`: the jobs; paths in them are relative to its folder.
    - `recordings`: more of them beside those that the file names.
    """
    return _touchup.sweep_plan(grid, list(recordings), out)


def jobs(path: _Path) -> list[dict[str, Any]]:
    """The jobs of a plan, in its order: `job`, `id`, `scan`, `recording`, `seed`, `keys`, …"""
    with open(path, encoding="utf-8") as lines:
        return [json.loads(line) for line in lines if line.strip()]


def run_job(
    jobs: _Path,
    job: int,
    results: _Path,
    *,
    scan: bytes | None = None,
    recording: bytes | None = None,
    again: bool = False,
) -> dict[str, Any]:
    """Runs one job, and returns `job`, `id`, `result` (its folder), `was_there`, `failed` and `summary`.

    A job whose result is there returns at once. One that fails by its input is a result too: `failed` says why, and `summary` is None.
    Raises `TouchupError` where it cannot be run, as for a file that is not what was planned; then nothing is written. The same job in
    several processes at once is one result.

    - `jobs`: as `plan` writes them. `job`: the number of one. `results`: the folder in which each has one by its id.
    - `scan`, `recording`: content of the files, where the process has it already: then they are not read, and need not be there.
    - `again`: also where its result is there, which is replaced.
    """
    report: dict[str, Any] = json.loads(_touchup.sweep_run_job(jobs, job, results, scan, recording, again))
    return report


def results_of(jobs: _Path) -> Path:
    """Where ``touchup sweep run`` has the results of a plan unless it says otherwise: ``results`` beside it."""
    return Path(fspath(jobs)).parent / "results"


def table(jobs: _Path, results: _Path | None = None) -> list[dict[str, Any]]:
    """A row for each job that has a result, in the order of the plan, for ``pandas.DataFrame``.

    `job`, `id`, `recording`, `seed`, each key, `failed`, then the numbers of the summary. What a row has not is not in it.
    """
    return _tables(jobs, results, False)["jobs"]


def features(jobs: _Path, results: _Path | None = None) -> list[dict[str, Any]]:
    """A row for each feature of each job that has a result: `job`, `job_id`, then what ``features.json`` has of it."""
    return _tables(jobs, results, True)["features"]


def _tables(jobs: _Path, results: _Path | None, with_features: bool) -> dict[str, list[dict[str, Any]]]:
    place = results_of(jobs) if results is None else results
    tables: dict[str, list[dict[str, Any]]] = json.loads(_touchup.sweep_tables(jobs, place, with_features))
    return tables
