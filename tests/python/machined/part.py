"""A part: a solid of manifold3d, and its features, cut into it or put on it.

Lengths in mm. Each feature keeps the number that manifold3d gives the faces of its tool, so the label of every face of the finished part is
exact, for any crossings of tools.
"""

from dataclasses import dataclass, field

import numpy as np
import trimesh
from manifold3d import CrossSection, JoinType, Manifold

# a circle of a tool lies this far from the true one at most, mm
SAGITTA_MM = 0.002


def segments(radius):
    """Corners of a circle whose chords are no farther from it than SAGITTA_MM."""
    return int(np.clip(np.ceil(np.pi / np.arccos(1 - SAGITTA_MM / radius)), 24, 400))


def circle(radius):
    """A regular polygon that lies as much inside of the circle as outside of it."""
    count = segments(radius)
    return CrossSection.circle(radius * 2 / (1 + np.cos(np.pi / count)), count)


def rod(radius, low, high):
    """A cylinder along z."""
    return circle(radius).extrude(high - low).translate([0, 0, low])


def cone(radii, low, high):
    """A frustum along z with the radii at both ends."""
    scale = radii[1] / radii[0]
    return circle(radii[0]).extrude(high - low, scale_top=(scale, scale)).translate([0, 0, low])


def rounded(length, width, corner):
    """A rectangle about the origin with rounded corners; a stadium if the corner is half the width."""
    if corner <= 0:
        return CrossSection.square([length, width], center=True)
    corner = min(corner, width / 2)
    core = CrossSection.square([length - 2 * corner, max(width - 2 * corner, 1e-6)], center=True)
    return core.offset(corner, JoinType.Round, circular_segments=4 * (segments(corner) // 4 + 1))


def frame(origin, axis, direction=None):
    """The 3 × 4 matrix that takes z to the axis and the origin to a place."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.asarray(direction if direction is not None else np.eye(3)[np.argmin(np.abs(z))], float)
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z, origin])


@dataclass
class Feature:
    """A cut or an addition: the fields are those of the features file, lengths in mm."""

    kind: str
    center_mm: np.ndarray
    axis: np.ndarray
    sizes: dict = field(default_factory=dict)
    group: int | None = None
    # numbers of the tool's faces that are its wall, and of those that close it
    wall: list = field(default_factory=list)
    floor: list = field(default_factory=list)
    # the smallest width that a ball has to go through, mm
    entry_mm: float = 0.0
    # whether a program need not find it: its kind is ambiguous, or another feature cuts it
    is_optional: bool = False
    remark: str = ""


class Part:
    """A solid and its features, under construction."""

    def __init__(self, blank):
        self.solid = blank.as_original()
        self.features = []

    def cut(self, tool, place, feature=None, part="wall"):
        """Takes a tool away at a place; its faces become part of the feature."""
        tool = tool.as_original().transform(place)
        self.solid = self.solid - tool
        self._label(tool, feature, part)

    def add(self, tool, place, feature=None, part="wall"):
        tool = tool.as_original().transform(place)
        self.solid = self.solid + tool
        self._label(tool, feature, part)

    def _label(self, tool, feature, part):
        if feature is not None:
            getattr(feature, part).extend(np.unique(tool.to_mesh().run_original_id).tolist())

    def note(self, feature):
        self.features.append(feature)
        return feature

    def finished(self):
        """The mesh (merged vertices), and for each face the number of the tool that made it."""
        solid = max(self.solid.decompose(), key=lambda body: body.volume())
        mesh = solid.to_mesh64()
        counts = np.diff(np.asarray(mesh.run_index)) // 3
        labels = np.repeat(np.asarray(mesh.run_original_id), counts)
        vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        for feature in self.features:
            feature.is_optional |= is_cut(feature, mesh, labels)
        return mesh, labels


def is_cut(feature, mesh, labels):
    """Whether another feature took more of the wall of a hole than a broken edge does."""
    if feature.kind != "hole" or not feature.wall:
        return False
    # the floor has the label of its tool too
    is_wall = np.isin(labels, feature.wall) & (np.abs(mesh.face_normals @ feature.axis) < 0.3)
    wall = mesh.area_faces[is_wall].sum()
    whole = np.pi * feature.sizes["diameter_mm"] * feature.sizes["depth_mm"]
    return wall < 0.85 * whole
