"""The refinement sample by sample."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Iterator, Literal

import numpy as np
from numpy.typing import NDArray

from . import _touchup
from ._arrays import error
from .mesh import Mesh, Unit
from .recording import Samples
from .refine import Refined, ScanLike, refined, scan_given
from .scene import SceneLike, given

if TYPE_CHECKING:
    from typing_extensions import Self

CASES = ("free", "mesh_only", "surface_only", "both")
REFUSED = 255


@dataclass(frozen=True, eq=False)
class Pushed:
    """What became of many samples.

    - `case`: (N,) uint8: a number of `CASES`: 0 free, 1 contact expected and not measured, 2 measured and not expected, 3 both;
      255: refused.
    - `face`: (N,) int64: the face that was touched, −1 where there is none within reach.
    - `distance`: (N,) m: signed distance of the ball's contact point from that face; NaN where there is none.
    - `refused`: how many samples were refused, by reason. `first_refusal`: the first, and why.
    """

    case: NDArray[np.uint8]
    face: NDArray[np.int64]
    distance: NDArray[np.float64]
    refused: dict[str, int]
    first_refusal: tuple[int, str] | None


@dataclass(frozen=True)
class Event:
    """What happened at a sample.

    - `kind`: ``"contact"``: contact began; ``"lift"``: it ended; ``"refused"``: the sample was not taken.
    - `index`, `stamp_ns`: of the sample. `face`: touched first or last; None where there is none.
    """

    kind: Literal["contact", "lift", "refused"]
    index: int
    stamp_ns: int
    face: int | None


class Refiner(_touchup.Refiner):
    """Refines a scan sample by sample.

    Examples:
        >>> import touchup
        >>> triangle = ([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]], [[0, 1, 2]])
        >>> refiner = touchup.Refiner(triangle, {"tip": {"radius_mm": 1.0}})
        >>> refiner.push(0, (0.003, 0.003, 0.001), (0, 0, 0, 1), (0, 0, 2.0)).case
        'surface_only'
    """

    _touches = False
    _last_face: int | None = None

    def __new__(
        cls,
        scan: ScanLike,
        scene: SceneLike = None,
        *,
        unit: Unit | None = None,
        wrench_frame: Literal["sensor", "object"] = "sensor",
    ) -> Self:
        """Builds the tree over the scan.

        - `scan`, `unit`, `scene`: as of `refine`. Samples are taken as they are: `sync`, `scan_to_space` and `tip.offset_mm` are for
          recordings.
        - `wrench_frame`: ``"sensor"``: forces turn with the stylus; ``"object"``: they are in the axes of the scan.
        """
        return super().__new__(cls, *given(scene), *scan_given(scan, unit), wrench_frame)

    def push_many(self, samples: Samples) -> Pushed:
        """Takes samples one after the other; a refused one is counted and changes nothing. Ctrl-C ends it between samples."""
        if not isinstance(samples, Samples):
            raise error(f"samples are touchup.Samples, not {type(samples).__name__}: make them of arrays, Samples(stamp_ns, position, force)")
        return Pushed(**self._push_many(samples._arrays()))

    def events(self, samples: Samples, chunk: int = 1000) -> Iterator[Event]:
        """Takes samples as `push_many`, `chunk` at a time, and yields what happens; what is not asked for is not taken."""
        if chunk < 1:
            raise error(f"chunk {chunk} must be at least 1")
        for begin in range(0, len(samples), chunk):
            pushed = self.push_many(samples._part(begin, begin + chunk))
            for at, (case, face) in enumerate(zip(pushed.case.tolist(), pushed.face.tolist()), start=begin):
                stamp_ns = int(samples.stamp_ns[at])
                if case == REFUSED:
                    yield Event("refused", at, stamp_ns, None)
                    continue
                touches = case >= CASES.index("surface_only")
                if touches and not self._touches:
                    yield Event("contact", at, stamp_ns, face if face >= 0 else None)
                elif self._touches and not touches:
                    yield Event("lift", at, stamp_ns, self._last_face)
                self._touches = touches
                if touches and face >= 0:
                    self._last_face = face

    @property
    def mesh(self) -> Mesh:
        """A copy of the mesh as the samples so far have moved it; what was touched is reconstructed by `finish`."""
        return Mesh(**self._mesh())

    @property
    def counts(self) -> dict[str, int]:
        """What became of the samples so far, also after `finish`: `accepted`, `contacts`, `moved`, `cut_back`, `light`, `out_of_reach`, …"""
        counted: dict[str, int] = json.loads(self._counts())
        return counted

    def finish(self, *, force: bool = False) -> Refined:
        """Reconstructs what was touched; the refiner takes no more samples.

        What came is judged as by `refine`: raises `TouchupError` where something is surely wrong, and warns of what is doubtful.

        - `force`: also where something is surely wrong, or no face of the scan was moved or replaced.
        """
        return refined(self._finish(force))
