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
    """Results of many samples.

    - `case`: (N,) uint8: a number of `CASES`: 0 free, 1 contact expected and not measured, 2 measured and not expected, 3 both;
      255: refused.
    - `face`: (N,) int64: the touched face; −1 if none is within reach.
    - `distance`: (N,) m: signed distance of the ball's contact point from that face; NaN without one.
    - `refused`: number of refused samples by reason. `first_refusal`: index and reason of the first.
    """

    case: NDArray[np.uint8]
    face: NDArray[np.int64]
    distance: NDArray[np.float64]
    refused: dict[str, int]
    first_refusal: tuple[int, str] | None


@dataclass(frozen=True)
class Event:
    """Event at a sample.

    - `kind`: ``"contact"``: contact began; ``"lift"``: it ended; ``"refused"``: the sample was not taken.
    - `index`, `stamp_ns`: of the sample. `face`: touched first or last; None without one.
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

        - `scan`, `unit`, `scene`: as of `refine`. Samples need no conversion: `sync`, `scan_to_space` and `tip.offset_mm` are for
          recordings.
        - `wrench_frame`: ``"sensor"``: forces turn with the stylus; ``"object"``: they are in the axes of the scan.
        """
        return super().__new__(cls, *given(scene), *scan_given(scan, unit), wrench_frame)

    def push_many(self, samples: Samples) -> Pushed:
        """Takes samples one after the other; counts a refused one, which changes nothing. Ctrl-C ends it between samples."""
        if not isinstance(samples, Samples):
            raise error(f"samples are touchup.Samples, not {type(samples).__name__}: make them of arrays, Samples(stamp_ns, position, force)")
        return Pushed(**self._push_many(samples._arrays()))

    def events(self, samples: Samples, chunk: int = 1000) -> Iterator[Event]:
        """Takes samples as `push_many`, `chunk` at a time, and yields their events; it takes samples only as the caller asks for events."""
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
        """Copy of the mesh, moved by the samples until now; `finish` reconstructs the touched part."""
        return Mesh(**self._mesh())

    @property
    def counts(self) -> dict[str, int]:
        """Counts of the samples, also after `finish`: `accepted`, `contacts`, `moved`, `cut_back`, `light`, `out_of_reach` and others."""
        counted: dict[str, int] = json.loads(self._counts())
        return counted

    def finish(self, *, force: bool = False) -> Refined:
        """Reconstructs the touched part; the refiner takes no more samples.

        Checks the samples as `refine` does: raises `TouchupError` for a sure finding, and warns of the others.

        - `force`: also with a sure finding, or without a moved or replaced face of the scan.
        """
        return refined(self._finish(force))
