"""Rigid registration."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _touchup
from ._arrays import floats
from .mesh import Mesh, MeshLike, Unit


@dataclass(frozen=True, eq=False)
class Alignment:
    """A rigid motion.

    - `matrix`: (4, 4): maps homogeneous points of the source to the target, m.
    - `report`: `method`, `rms_mm`, `undetermined` (motions without effect on the fit), and the counts of the method.
    - `residuals`: (N, 3) m: of pairs, target − moved source; None for meshes.
    """

    matrix: NDArray[np.float64]
    report: dict[str, Any]
    residuals: NDArray[np.float64] | None = None

    def apply(self, mesh: MeshLike, unit: Unit = "m") -> Mesh:
        """The mesh after the motion."""
        of = Mesh.of(mesh, unit)
        return Mesh(of.vertices @ self.matrix[:3, :3].T + self.matrix[:3, 3], of.faces, of.sigma, of.support)


def align(
    source: MeshLike,
    target: MeshLike,
    method: Literal["icp", "features"] = "icp",
    *,
    unit: Unit = "m",
    alternative: int | None = None,
    seed: int = 1,
) -> Alignment:
    """The motion that brings `source` onto `target`.

    - `method`: ``"icp"``: from about the right place, point to plane; ``"features"``: from anywhere, by holes, slots, corners and
      planes, then point to plane.
    - `unit`: of the coordinates of those that are no `Mesh`.
    - `alternative`: which of several motions, from 1 on, where features do not decide: without it that is an error.
    """
    of, to = Mesh.of(source, unit), Mesh.of(target, unit)
    made = _touchup.align(of._arrays(), to._arrays(), method, alternative, seed)
    return Alignment(made["matrix"], json.loads(made["report"]))


def align_pairs(source_points: ArrayLike, target_points: ArrayLike) -> Alignment:
    """The motion that fits pairs of points by least squares.

    - `source_points`, `target_points`: (N, 3) m: the same points before and after it, at least three that are on no line.
    """
    pairs = floats(source_points, 3, "source_points"), floats(target_points, 3, "target_points")
    made = _touchup.align_pairs(*pairs)
    return Alignment(made["matrix"], json.loads(made["report"]), made["residuals"])
