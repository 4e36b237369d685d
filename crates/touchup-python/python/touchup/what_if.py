"""Differences between two results of a sweep."""

from __future__ import annotations

import json
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _touchup
from .mesh import Mesh


@dataclass(frozen=True, eq=False)
class Moved:
    """A mesh, and the displacement of the surface at each of its vertices from the first result to the second.

    - `displacement`: (V,) m, along the normal; positive: outwards.
    - `plus_minus`: (V,) m, the larger ± of both at k = 2; NaN if unknown.
    """

    mesh: Mesh
    displacement: NDArray[np.float64]
    plus_minus: NDArray[np.float64]

    @property
    def moved(self) -> NDArray[np.bool_]:
        """(V,): whether the vertex moved by more than its ±."""
        known = np.nan_to_num(self.plus_minus, nan=0.0)
        return np.asarray(np.abs(self.displacement) > known, dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class WhatIf:
    """Differences between two results of one scan.

    - `keys`: of the scene, by path, with both values. `a`, `b`: both meshes. `report`: object of ``touchup whatif --json``.
    """

    keys: dict[str, list[Any]]
    a: Moved
    b: Moved
    report: dict[str, Any]


def what_if(a: str | PathLike[str], b: str | PathLike[str]) -> WhatIf:
    """Compares two results, as ``touchup whatif`` does: displacements and features that differ by more than their ±.

    - `a`, `b`: folders of results of one scan, as `touchup.sweep.run_job` makes them.
    """
    found = _touchup.what_if(a, b)
    report = json.loads(found["report"])
    moved = [Moved(Mesh(**of["mesh"]), of["displacement"], of["plus_minus"]) for of in (found["a"], found["b"])]
    return WhatIf(report["keys"], moved[0], moved[1], report)
