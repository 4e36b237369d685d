"""Scan and touches of a known part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Sequence

from . import _touchup
from .mesh import Mesh, MeshLike, Unit
from .recording import Recording

World = Literal["workshop_stylus", "optical_tracker", "ur", "soft_probe", "careless_operator"]


@dataclass(frozen=True, eq=False)
class Simulated:
    """Scan and touch of a part.

    - `scan`: that of a poor scanner. `recording`: poses and wrenches of a ball that slides over the part.
    - `scene`: the text of a scene with the calibration of the world; None without a world.
    """

    scan: Mesh
    recording: Recording
    scene: str | None


def simulate(
    truth: MeshLike,
    *,
    unit: Unit = "m",
    seed: int = 1,
    world: World | None = None,
    told_off: Sequence[str] = (),
    tip_radius_mm: float | None = None,
    stiffness_n_per_mm: float | None = None,
    friction: float | None = None,
    scan_edge_mm: float | None = None,
    scan_noise_mm: float | None = None,
    scanner: Literal["cheap", "good"] | None = None,
    sides: Sequence[str] = ("z",),
) -> Simulated:
    """Scans and touches a part, as ``touchup simulate`` does; the same seed gives the same numbers.

    - `truth`: the part, a closed mesh. `unit`: of its coordinates, unless it is a `Mesh`.
    - `world`: draws true values that are not named from the ranges of this world.
    - `told_off`: factors of the calibration errors relative to the scene's uncertainties: ``"3"`` for all, ``"radius=3"`` for one.
    - `tip_radius_mm` (1.5), `stiffness_n_per_mm` (20), `friction` (0.15), `scan_edge_mm` (2.4), `scan_noise_mm` (0.6): true
      values, in brackets their defaults without a world.
    - `sides`: sides from which the hand reaches the part: ``"x"``, ``"-x"``, ``"y"`` and so on.
    """
    made = _touchup.simulate(
        Mesh.of(truth, unit)._arrays(),
        seed,
        world,
        [str(factor) for factor in told_off],
        tip_radius_mm,
        stiffness_n_per_mm,
        friction,
        scan_edge_mm,
        scan_noise_mm,
        scanner,
        list(sides),
    )
    return Simulated(Mesh(**made["scan"]), Recording(**made["recording"]), made["scene"])
