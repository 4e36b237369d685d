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
    """What scanner and stylus made of a part.

    - `scan`: as a poor scanner has it. `recording`: poses and wrenches of a ball that slides over the part.
    - `scene`: the text of a scene with what a calibration tells of the world; None without one.
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

    - `truth`: the part, a closed mesh. `unit`: of its coordinates, where it is no `Mesh`.
    - `world`: draws the truth of all that is not named from the ranges of this world.
    - `told_off`: by which factor the errors of what the scene tells are larger than it says: ``"3"`` for all, ``"radius=3"`` for one.
    - `tip_radius_mm` (1.5), `stiffness_n_per_mm` (20), `friction` (0.15), `scan_edge_mm` (2.4), `scan_noise_mm` (0.6): the truth;
      in brackets what it is without a world.
    - `sides`: from which the hand reaches the part: ``"x"``, ``"-x"``, ``"y"``, …
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
