"""Features of a mesh."""

from __future__ import annotations

import json
from typing import Literal, TypedDict, cast

from . import _touchup
from .mesh import Mesh, MeshLike, Unit
from .touches import Touches

Vector = list[float]


class Form(TypedDict, total=False):
    """How far a touched surface is off its ideal form: widths of the narrowest zones (ISO 1101), mm."""

    roundness_mm: float
    cylindricity_mm: float
    straightness_mm: float
    flatness_mm: float
    least_squares: dict[str, float]
    std: dict[str, float]
    coverage: float
    undulations: int
    lobes: list[int]


class Feature(TypedDict, total=False):
    """One feature; keys that do not apply to its kind, or are unknown, are left out.

    Lengths in mm, angles in degrees, in the frame of the mesh. `std` has the standard uncertainties by name of the number,
    `touches` the runs of touches behind each, first and last, and `fitted_to` says whether touches or the mesh measured it.
    """

    id: int
    kind: str
    center_mm: Vector
    axis: Vector
    diameter_mm: float
    length_mm: float
    width_mm: float
    depth_mm: float
    depth_is_at_least: bool
    through: bool
    cone_angle_deg: float
    direction: Vector
    group: int
    points_mm: list[Vector]
    convex: bool
    std: dict[str, float]
    form: Form
    touched: float
    fitted_to: Literal["touches", "mesh"]
    touches: dict[str, list[list[int]]]


class Relation(TypedDict, total=False):
    """Relation of one touched feature to another: `of` and `to` are their ids."""

    kind: str
    of: int
    to: int
    perpendicularity_mm: float
    parallelism_mm: float
    coaxiality_mm: float
    concentricity_mm: float
    distance_mm: float
    angle_deg: float
    std: dict[str, float]


class Features(TypedDict, total=False):
    """Object that ``touchup features`` writes: the features, their relations, and the share of the area in none of them."""

    features: list[Feature]
    relations: list[Relation]
    unexplained: float


def features(mesh: MeshLike, touches: Touches | None = None, *, unit: Unit = "m") -> Features:
    """Finds holes, slots, pockets, bosses, spheres, edges, corners and planes, and measures them.

    - `touches`: measure the features under them, as in `Refined.touches`; without touches the mesh does.
    - `unit`: of the coordinates of `mesh`, unless it is a `Mesh`.
    """
    arrays = Mesh.of(mesh, unit)._arrays()
    return cast(Features, json.loads(_touchup.features(arrays, None if touches is None else touches._arrays())))
