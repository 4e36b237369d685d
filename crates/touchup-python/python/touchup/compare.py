"""How far a mesh is from the true part."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _touchup
from .mesh import Mesh, MeshLike, Unit


@dataclass(frozen=True, eq=False)
class Comparison:
    """What ``touchup compare --json`` has as ``after``, and the deviation of each vertex.

    - `deviation`: (V,) m, + outside of the true part.
    - `report`: ``regions`` is a list, the first ``"all"``, each with ``mesh_to_truth`` and others: `mean_mm`, `rms_mm`, `p95_mm`, …
    """

    deviation: NDArray[np.float64]
    report: dict[str, Any]

    def region(self, name: str = "all") -> dict[str, Any]:
        """The numbers of ``"all"``, ``"touched"``, ``"guessed"`` or ``"untouched"``; KeyError where there is no such region."""
        found: dict[str, dict[str, Any]] = {region["region"]: region for region in self.report["regions"]}
        return found[name]


def compare(
    mesh: MeshLike,
    truth: MeshLike,
    *,
    unit: Unit = "m",
    samples: int = 200_000,
    seed: int = 1,
    range_mm: float | None = None,
    tolerance_mm: float | None = None,
) -> Comparison:
    """Measures how far `mesh` is from `truth`, region by region where it has `support`. Both are in one frame; see `align`.

    - `unit`: of the coordinates of those that are no `Mesh`.
    - `samples`: points spread over the true surface; as dense over the mesh. Another `seed` spreads them differently.
    - `range_mm`: ends of the histogram. `tolerance_mm`: deviations of at most this are within tolerance.
    """
    of, to = Mesh.of(mesh, unit), Mesh.of(truth, unit)
    made = _touchup.compare(of._arrays(), of.support, to._arrays(), samples, seed, range_mm, tolerance_mm)
    return Comparison(made["deviation"], json.loads(made["report"]))
