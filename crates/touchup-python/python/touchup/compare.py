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
    """Deviation of each vertex, and the object ``after`` of ``touchup compare --json``.

    - `deviation`: (V,) m, + outside of the true part.
    - `report`: ``regions`` is a list, the first ``"all"``, each with ``mesh_to_truth`` and others: `mean_mm`, `rms_mm`, `p95_mm` and so on.
    """

    deviation: NDArray[np.float64]
    report: dict[str, Any]

    def region(self, name: str = "all") -> dict[str, Any]:
        """The numbers of ``"all"``, ``"touched"``, ``"guessed"`` or ``"untouched"``; KeyError without such a region."""
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
    """Measures the deviation of `mesh` from `truth`, by region if it has `support`. Both are in one frame; see `align`.

    - `unit`: of the coordinates, except for those of a `Mesh`.
    - `samples`: points spread over the true surface; as dense over the mesh. Another `seed` spreads them differently.
    - `range_mm`: ends of the histogram. `tolerance_mm`: deviations of at most this are within tolerance.
    """
    of, to = Mesh.of(mesh, unit), Mesh.of(truth, unit)
    made = _touchup.compare(of._arrays(), of.support, to._arrays(), samples, seed, range_mm, tolerance_mm)
    return Comparison(made["deviation"], json.loads(made["report"]))
