"""A scan and touches in, the refined mesh out."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from os import PathLike, fspath
from typing import Any, Union

from . import _touchup
from ._arrays import MeshArrays, error
from .features import Features, features
from .mesh import Mesh, MeshLike, Path, Unit
from .recording import Recording, Samples, Stamp, recorded_as
from .scene import SceneLike, given
from .touches import Touches

ScanLike = Union[MeshLike, Path]


@dataclass(frozen=True, eq=False)
class Refined:
    """Result of a refinement.

    - `mesh`: with `sigma` and `support` if the scene has a patch.
    - `touches`: touches that measure the features.
    - `summary`: object of ``touchup refine --json``: `samples`, `accepted`, `refused`, `contacts`, `moved_faces`, `friction`, `patch`,
      `uncertainty`, `findings`.
    """

    mesh: Mesh
    touches: Touches
    summary: dict[str, Any]

    @cached_property
    def features(self) -> Features:
        """Features of the mesh, measured by the touches; found at the first use."""
        return features(self.mesh, self.touches)


def refine(
    scan: ScanLike,
    recording: Recording | Samples | Path,
    scene: SceneLike = None,
    *,
    unit: Unit | None = None,
    pose_topic: str | None = None,
    wrench_topic: str | None = None,
    markers_topic: str | None = None,
    pose_frame: str | None = None,
    base_frame: str | None = None,
    stamp: Stamp = "header",
    force: bool = False,
) -> Refined:
    """Refines a scan by touches, as ``touchup refine`` does.

    - `scan`: a mesh, or the path of a file. `unit`: of its coordinates: ``"mm"`` for a file and ``"m"`` for arrays unless it is named.
    - `recording`: poses and wrenches, `Samples` (whose wrenches turn with the stylus), or the path of a recording: of ROS 2 or
      ROS 1, or a table.
    - `pose_topic`, `wrench_topic`, `pose_frame`, `base_frame`, `stamp`: of a file, as of `Recording.read`. `markers_topic`: of the
      markers that give the pose.
    - `scene`: differences from the default scene; it must name the radius of the ball: ``{"tip": {"radius_mm": 1.5}}``.
    - `force`: refines despite sure findings in the recording.

    Raises `TouchupError`, and warns with `TouchupWarning` of findings and losses. The interpreter is free for other threads meanwhile.
    """
    scan_arrays, scan_file = scan_given(scan, unit)
    poses = wrenches = file = None
    frame: str = "sensor"
    if isinstance(recording, Samples):
        recording = recording.recording()
    topics = {"pose_topic": pose_topic, "wrench_topic": wrench_topic, "markers_topic": markers_topic}
    recorded = recorded_as(**topics, pose_frame=pose_frame, base_frame=base_frame, stamp=None if stamp == "header" else stamp)
    if isinstance(recording, Recording):
        if recorded != recorded_as():
            raise error(f"{recorded} say where poses and wrenches are in a file, and the recording is arrays: leave them out")
        poses, wrenches, frame = recording._poses(), recording._wrenches(), recording.wrench_frame
    else:
        file = (fspath(recording), recorded)
    made = _touchup.refine(*given(scene), scan_arrays, scan_file, poses, wrenches, frame, file, force)
    return refined(made)


def scan_given(scan: ScanLike, unit: Unit | None) -> tuple[MeshArrays | None, tuple[str, str] | None]:
    """Its arrays, or its path and unit."""
    if isinstance(scan, (str, PathLike)):
        return None, (fspath(scan), unit or "mm")
    return Mesh.of(scan, unit or "m")._arrays(), None


def refined(made: dict[str, Any]) -> Refined:
    """The result of the native half."""
    mesh = Mesh(made["vertices"], made["faces"], made["sigma"], made["support"])
    return Refined(mesh, Touches(**made["touches"]), json.loads(made["summary"]))
