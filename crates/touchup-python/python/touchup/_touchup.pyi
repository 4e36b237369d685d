"""The native half of touchup: arrays in, arrays out. Users take the names of the package instead."""

from os import PathLike
from typing import Any, Literal, final

from typing_extensions import Self

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "run_command",
    "TouchupError",
    "TouchupWarning",
    "read_mesh",
    "read_recording",
    "read_touches",
    "write_mesh",
    "write_recording",
    "write_touches",
    "align",
    "align_pairs",
    "compare",
    "features",
    "Refiner",
    "Update",
    "refine",
    "check_scene",
    "default_scene",
    "scene_parameters",
    "simulate",
    "run_job",
    "sweep_plan",
    "sweep_tables",
    "what_if",
]

_Floats = NDArray[np.float64]
_Mesh = tuple[_Floats, NDArray[np.uint32]]
_Poses = tuple[NDArray[np.int64], _Floats, _Floats]
_Samples = tuple[NDArray[np.int64], _Floats, _Floats, _Floats, _Floats]
_Vector = _Floats | tuple[float, ...] | list[float]
_Path = str | PathLike[str]

class TouchupError(Exception):
    """Error, in the words of the command line.

    `kind`, `hint` and `exit_code` are those of its ``--json``: `kind` is ``"usage"``, ``"scene"``, ``"mesh"``, ``"recording"``,
    ``"input"`` and others; `hint` is the remedy, if the message has none.
    """

    kind: str
    hint: str | None
    exit_code: int

class TouchupWarning(UserWarning):
    """Finding about an input, or a loss that a better input would avoid."""

@final
class Update:
    """Result of one sample."""

    @property
    def case(self) -> Literal["free", "mesh_only", "surface_only", "both"]:
        """Whether contact is expected (mesh) and measured (surface)."""

    @property
    def face(self) -> int | None:
        """The touched face; None if none is within reach."""

    @property
    def distance(self) -> float | None:
        """Signed distance of the ball's contact point from that face, m; negative inside."""

    @property
    def expected_force(self) -> tuple[float, float, float] | None:
        """Force that the scan implies, N, in the frame of the scan."""

    @property
    def mismatch(self) -> tuple[float, float, float] | None:
        """Measured less expected force, N, in the frame of the scan."""

    @property
    def moved(self) -> bool:
        """Whether the mesh was moved."""

class Refiner:
    def __new__(
        cls,
        scene_text: str | None,
        scene_path: _Path | None,
        scan: _Mesh | None,
        scan_file: tuple[_Path, str] | None,
        frame: str,
    ) -> Self: ...
    def push(
        self,
        stamp_ns: int,
        position: _Vector,
        orientation_xyzw: _Vector,
        force: _Vector,
        torque: _Vector | None = None,
    ) -> Update:
        """Takes the next sample and moves the mesh by it.

        - `stamp_ns`: ns, after that of the sample before. `position`: (3,) m, centre of the ball in the frame of the scan.
        - `orientation_xyzw`: (4,) unit quaternion of the tip. `force`: (3,) N. `torque`: (3,) N·m, zeros if left out.

        Each may be an array, a tuple or a list. Raises `TouchupError` for a sample that is not finite, absurd or not in order of
        time; it changes nothing.
        """
    def _push_many(self, samples: _Samples) -> dict[str, Any]: ...
    def _push_in_rust(self, samples: _Samples) -> int: ...
    def _mesh(self) -> dict[str, Any]: ...
    def _counts(self) -> str: ...
    def _finish(self, force: bool) -> dict[str, Any]: ...

def run_command(arguments: list[str]) -> int: ...
def read_mesh(path: _Path, unit: str) -> dict[str, Any]: ...
def write_mesh(
    path: _Path, unit: str, mesh: _Mesh, sigma: _Floats | None, support: NDArray[np.uint8] | None
) -> None: ...
def read_recording(scene_text: str | None, scene_path: _Path | None, path: _Path, recorded: str) -> dict[str, Any]: ...
def write_recording(path: _Path, poses: _Poses, wrenches: _Poses, frame: str) -> None: ...
def read_touches(path: _Path) -> dict[str, Any]: ...
def write_touches(path: _Path, touches: dict[str, Any]) -> None: ...
def refine(
    scene_text: str | None,
    scene_path: _Path | None,
    scan: _Mesh | None,
    scan_file: tuple[_Path, str] | None,
    poses: _Poses | None,
    wrenches: _Poses | None,
    frame: str,
    recording_file: tuple[_Path, str] | None,
    force: bool,
) -> dict[str, Any]: ...
def features(mesh: _Mesh, touches: dict[str, Any] | None) -> str: ...
def compare(
    mesh: _Mesh,
    support: NDArray[np.uint8] | None,
    truth: _Mesh,
    samples: int,
    seed: int,
    range_mm: float | None,
    tolerance_mm: float | None,
) -> dict[str, Any]: ...
def align(source: _Mesh, target: _Mesh, method: str, alternative: int | None, seed: int) -> dict[str, Any]: ...
def align_pairs(source: _Floats, target: _Floats) -> dict[str, Any]: ...
def simulate(
    truth: _Mesh,
    seed: int,
    world: str | None,
    told_off: list[str],
    tip_radius_mm: float | None,
    stiffness_n_per_mm: float | None,
    friction: float | None,
    scan_edge_mm: float | None,
    scan_noise_mm: float | None,
    scanner: str | None,
    sides: list[str],
) -> dict[str, Any]: ...
def scene_parameters() -> str: ...
def default_scene() -> str: ...
def check_scene(text: str | None, path: _Path | None) -> None: ...
def sweep_plan(grid: _Path, recordings: list[_Path], out: _Path) -> int: ...
def sweep_tables(jobs: _Path, results: _Path | None, with_features: bool) -> str: ...
def what_if(a: _Path, b: _Path) -> dict[str, Any]: ...
def run_job(
    jobs: _Path,
    job: int,
    results: _Path | None,
    scan: bytes | None,
    recording: bytes | None,
    again: bool,
) -> dict[str, Any]: ...
