"""Touches that features rest on."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _touchup
from .mesh import Path

_KINDS: dict[str, Any] = {"stamp_ns": np.int64, "stroke": np.uint32, "is_rejected": np.bool_}


@dataclass(frozen=True, eq=False)
class Touches:
    """Touches of the surface, in order of time, in the frame of the scan.

    - `stamp_ns`: (N,) int64, ns. `stroke`: (N,) uint32: number of the stroke.
    - `centre`: (N, 3) m: centre of the ball. `radius`: (N,) m. `point`: (N, 3) m: of the surface. `normal`: (N, 3): outward, unit.
    - `sigma`, `calibration_sigma`, `place_sigma`: (N,) m: standard deviation of the centre along the normal due to random
      errors, to the calibration of the tip, and to the place of the scan.
    - `weight`: (N,): at most 1. `is_rejected`: (N,) bool: whether the touch contradicts earlier ones there.
    """

    stamp_ns: NDArray[np.int64]
    stroke: NDArray[np.uint32]
    centre: NDArray[np.float64]
    radius: NDArray[np.float64]
    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    sigma: NDArray[np.float64]
    calibration_sigma: NDArray[np.float64]
    place_sigma: NDArray[np.float64]
    weight: NDArray[np.float64]
    is_rejected: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.ascontiguousarray(getattr(self, field.name), dtype=_KINDS.get(field.name, np.float64))
            object.__setattr__(self, field.name, array)

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @staticmethod
    def read(path: Path) -> Touches:
        """Reads the CSV that ``touchup refine --touches-out`` writes."""
        return Touches(**_touchup.read_touches(path))

    def write(self, path: Path) -> None:
        """Writes that CSV; Parquet if the name ends in ``.parquet``."""
        _touchup.write_touches(path, self._arrays())

    def _arrays(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}
