"""Jobs of ``touchup sweep plan``, for engines that call Python; ``touchup.ray`` is one."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from . import _touchup
from .mesh import Path


@dataclass(frozen=True)
class JobReport:
    """What there is of a job.

    - `job`: its number in the plan. `id`: the name of its result. `result`: the folder of that.
    - `was_there`: whether it had its result before.
    - `failed`: why nothing can come of it, in the words of ``touchup refine``; None where something did. `summary`: its
      ``summary.json``, None where it failed.
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
    """Runs one job, as ``touchup sweep run --job`` does: the same bytes. One that has its result returns at once.

    - `jobs`: what ``touchup sweep plan`` wrote. `job`: the number of one, from 0 on.
    - `results`: the folder of the results; ``results`` beside `jobs` unless you say otherwise.
    - `scan`, `recording`: content of their files where you have it already: then they are not read.
    - `again`: also where its result is there, which is replaced.

    Raises `TouchupError` where a file is not that of the plan. A recording that cannot be refined is a result, with `failed`.
    """
    made = _touchup.run_job(jobs, job, results, scan, recording, again)
    return JobReport(**{**made, "result": str(made["result"]), "summary": json.loads(made["summary"])})
