"""Triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import Any, Literal, Protocol, Union, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _touchup
from ._arrays import MeshArrays, error, floats

Unit = Literal["mm", "m", "inch"]
Path = Union[str, "PathLike[str]"]

METRES: dict[str, float] = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}

SCAN, TOUCHED, GUESSED, UNREACHABLE = range(4)
"""Numbers of `Mesh.support`: as scanned; touched; between touches; as that, and out of the ball's reach."""


@runtime_checkable
class HasFaces(Protocol):
    """A mesh of trimesh, PyVista's or anybody's with these two."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


@runtime_checkable
class HasTriangles(Protocol):
    """A mesh of Open3D."""

    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...


MeshLike = Union["Mesh", HasFaces, HasTriangles, "tuple[ArrayLike, ArrayLike]"]
"""A `Mesh`, an object with `vertices` and `faces` (trimesh) or `triangles` (Open3D), or a pair of arrays."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh. Arrays of the right type are kept and not copied.

    - `vertices`: (V, 3) float64, m.
    - `faces`: (F, 3) uint32, counter-clockwise seen from outside.
    - `sigma`: (V,) float64, m: standard deviation of each vertex along its normal; None if unknown.
    - `support`: (V,) uint8: `SCAN`, `TOUCHED`, `GUESSED` or `UNREACHABLE`; None if unknown.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.uint32]
    sigma: NDArray[np.float64] | None = None
    support: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", floats(self.vertices, 3, "vertices"))
        object.__setattr__(self, "faces", _faces(self.faces, len(self.vertices)))
        for name, kind in (("sigma", np.float64), ("support", np.uint8)):
            given = getattr(self, name)
            if given is None:
                continue
            column = np.ascontiguousarray(given, dtype=kind)
            if column.shape != (len(self.vertices),):
                raise error(f"{name} is an array of shape {column.shape}; it must be ({len(self.vertices)},)")
            object.__setattr__(self, name, column)

    @staticmethod
    def of(mesh: MeshLike, unit: Unit = "m") -> Mesh:
        """A mesh of another library, or of a pair of arrays.

        - `unit`: of its coordinates; with ``"m"`` float64 arrays are shared and not copied.
        """
        if isinstance(mesh, Mesh):
            return mesh
        if isinstance(mesh, tuple):
            vertices, faces = mesh
        elif isinstance(mesh, HasFaces):
            # first: the triangles of trimesh are corners as points
            vertices, faces = mesh.vertices, mesh.faces
        elif isinstance(mesh, HasTriangles):
            vertices, faces = mesh.vertices, mesh.triangles
        else:
            raise error(f"a mesh has vertices and faces, or triangles; a {type(mesh).__name__} has not")
        if unit not in METRES:
            raise error(f'unit {unit!r} must be "mm", "m" or "inch"')
        in_unit = np.asarray(vertices, dtype=np.float64)
        return Mesh(in_unit if unit == "m" else in_unit * METRES[unit], np.asarray(faces))

    @staticmethod
    def read(path: Path, unit: Unit = "mm") -> Mesh:
        """Reads PLY, STL or OBJ and repairs it; of a point cloud (PLY, PCD, XYZ, E57) it makes a surface.

        - `unit`: of the coordinates in the file.
        """
        return Mesh(**{name: value for name, value in _touchup.read_mesh(path, unit).items() if name != "repair"})

    def write(self, path: Path, unit: Unit = "mm") -> None:
        """Writes PLY, STL or OBJ, by the ending of `path`; PLY also has `sigma_mm` and `support`."""
        _touchup.write_mesh(path, unit, self._arrays(), self.sigma, self.support)

    def _arrays(self) -> MeshArrays:
        return self.vertices, self.faces

    def __repr__(self) -> str:
        known = [name for name in ("sigma", "support") if getattr(self, name) is not None]
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces{''.join(', ' + name for name in known)})"


def _faces(faces: ArrayLike, vertices: int) -> NDArray[np.uint32]:
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] != 3 or not np.issubdtype(array.dtype, np.integer):
        raise error(f"faces is an array of shape {array.shape} of {array.dtype}; it must be (F, 3) of whole numbers")
    if array.size and (array.min() < 0 or array.max() >= vertices):
        face = int(np.argwhere((array < 0) | (array >= vertices))[0, 0])
        vertex = next(int(v) for v in array[face] if not 0 <= v < vertices)
        raise error(f"face {face} uses vertex {vertex}, but there are only {vertices} vertices", "mesh", 3)
    return np.ascontiguousarray(array, dtype=np.uint32)
