"""Recordings of stylus and sensor."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _touchup
from ._arrays import error, floats, stamps
from .mesh import Path
from .scene import SceneLike, given

Stamp = Literal["header", "log"]
PoseArrays = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]
SampleArrays = tuple[
    NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]


def recorded_as(**names: str | None) -> str:
    """Names of the poses and wrenches in a recording, for the native half."""
    return json.dumps({key: name for key, name in names.items() if name is not None})


@dataclass(frozen=True, eq=False)
class Recording:
    """Poses and wrenches, each with stamps and a number of its own.

    - `pose_stamp_ns`: (N,) int64, ns. `position`: (N, 3) m: centre of the ball in the frame of the scan, or as
      `tip.offset_mm` and `scan_to_space` of the scene say. `orientation_xyzw`: (N, 4): unit quaternions x, y, z, w of the tip.
    - `wrench_stamp_ns`: (M,) int64, ns. `force`: (M, 3) N. `torque`: (M, 3) N·m; zeros if left out.
    - `wrench_frame`: ``"sensor"``: wrenches turn with the stylus; ``"object"``: they are in the axes of the poses' frame.
    """

    pose_stamp_ns: NDArray[np.int64]
    position: NDArray[np.float64]
    orientation_xyzw: NDArray[np.float64]
    wrench_stamp_ns: NDArray[np.int64]
    force: NDArray[np.float64]
    torque: NDArray[np.float64] | None = None
    wrench_frame: Literal["sensor", "object"] = "sensor"

    def __post_init__(self) -> None:
        torque = np.zeros_like(np.asarray(self.force, dtype=np.float64)) if self.torque is None else self.torque
        for name, value in (
            ("pose_stamp_ns", stamps(self.pose_stamp_ns, "pose_stamp_ns")),
            ("position", floats(self.position, 3, "position")),
            ("orientation_xyzw", floats(self.orientation_xyzw, 4, "orientation_xyzw")),
            ("wrench_stamp_ns", stamps(self.wrench_stamp_ns, "wrench_stamp_ns")),
            ("force", floats(self.force, 3, "force")),
            ("torque", floats(torque, 3, "torque")),
        ):
            object.__setattr__(self, name, value)
        if self.wrench_frame not in ("sensor", "object"):
            raise error(f'wrench_frame {self.wrench_frame!r} must be "sensor" or "object"')

    @staticmethod
    def read(
        path: Path,
        *,
        scene: SceneLike = None,
        pose_topic: str | None = None,
        wrench_topic: str | None = None,
        pose_frame: str | None = None,
        base_frame: str | None = None,
        stamp: Stamp = "header",
    ) -> Recording:
        """Reads a recording of any kind that ``touchup refine`` reads: of ROS 2 or ROS 1, or a table.

        - `pose_topic`, `wrench_topic`: ``"/stylus/pose"`` and ``"/stylus/wrench"`` unless they are named.
        - `pose_frame`: takes the pose of this frame from the transforms on `pose_topic`, ``"/tf"`` unless it is named, in `base_frame`
          or in the root of the tree.
        - `stamp`: which time of a message counts: that of its header, or when it was recorded.
        - `scene`: names the `columns` of a table; nothing else of it counts.
        """
        recorded = recorded_as(
            pose_topic=pose_topic, wrench_topic=wrench_topic, pose_frame=pose_frame, base_frame=base_frame, stamp=stamp
        )
        return Recording(**_touchup.read_recording(*given(scene), path, recorded))

    def write(self, path: Path) -> None:
        """Writes MCAP that rosbag2 and ``touchup refine --bag`` read."""
        _touchup.write_recording(path, self._poses(), self._wrenches(), self.wrench_frame)

    def _poses(self) -> PoseArrays:
        return self.pose_stamp_ns, self.position, self.orientation_xyzw

    def _wrenches(self) -> PoseArrays:
        assert self.torque is not None
        return self.wrench_stamp_ns, self.force, self.torque


@dataclass(frozen=True, eq=False)
class Samples:
    """Pose and wrench at the same instants, in order of time.

    - `stamp_ns`: (N,) int64, ns. `position`: (N, 3) m: centre of the ball in the frame of the scan.
    - `orientation_xyzw`: (N, 4): unit quaternions of the tip; no rotation if left out.
    - `force`: (N, 3) N. `torque`: (N, 3) N·m; zeros if left out.
    """

    stamp_ns: NDArray[np.int64]
    position: NDArray[np.float64]
    force: NDArray[np.float64]
    orientation_xyzw: NDArray[np.float64] | None = None
    torque: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        count = len(np.asarray(self.stamp_ns))
        turn: ArrayLike = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
        if self.orientation_xyzw is not None:
            turn = self.orientation_xyzw
        torque: ArrayLike = np.zeros((count, 3)) if self.torque is None else self.torque
        for name, value in (
            ("stamp_ns", stamps(self.stamp_ns, "stamp_ns")),
            ("position", floats(self.position, 3, "position")),
            ("force", floats(self.force, 3, "force")),
            ("orientation_xyzw", floats(turn, 4, "orientation_xyzw")),
            ("torque", floats(torque, 3, "torque")),
        ):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def recording(self, wrench_frame: Literal["sensor", "object"] = "sensor") -> Recording:
        """The same as poses and wrenches of equal stamps, for `refine`; nothing is copied."""
        stamp_ns, position, turn, force, torque = self._arrays()
        return Recording(stamp_ns, position, turn, stamp_ns, force, torque, wrench_frame)

    def _arrays(self) -> SampleArrays:
        assert self.orientation_xyzw is not None and self.torque is not None
        return self.stamp_ns, self.position, self.orientation_xyzw, self.force, self.torque

    def _part(self, begin: int, end: int) -> Samples:
        stamp_ns, position, turn, force, torque = (array[begin:end] for array in self._arrays())
        return Samples(stamp_ns, position, force, turn, torque)  # type: ignore[arg-type]
