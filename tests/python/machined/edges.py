"""True straight edges of a part, and the errors of touched edges that features state.

The true edge is the line where the planes of both sides meet; a chamfer, from 0.8 mm on, is a side of two edges.
"""

import numpy as np

# flat faces that count as sides of an edge: least area, mm², and least spread across, mm: narrower ones are facets of round walls
LEAST_MM2 = 4.0
LEAST_SPREAD_MM = 0.3
# a side is this close to its edge, mm, and parallel to it: 3°
NEAR_MM = 1.0
ALONG = 0.05
# sine of the angle between the sides of an edge
LEAST_SINE = 0.3


def flat_faces(mesh):
    """Normal and corners of each flat face of the mesh, mm."""
    faces = []
    for facet, area in zip(mesh.facets, mesh.facets_area):
        corners = mesh.vertices[mesh.faces[facet].ravel()]
        spreads = np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False) / np.sqrt(len(corners))
        if area >= LEAST_MM2 and spreads[1] >= LEAST_SPREAD_MM:
            faces.append((mesh.face_normals[facet[0]], corners))
    return faces


def distance_to_true(edge, faces):
    """Distance of the middle of an edge of the features file from the line of the two nearest faces along it, mm; None: there are none."""
    ends = np.array(edge["points_mm"])
    middle, along = ends.mean(axis=0), (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    sides = []
    for normal, corners in faces:
        off = np.abs((ends - corners[0]) @ normal).max()
        reach = (corners - middle) @ along
        if abs(normal @ along) < ALONG and off < NEAR_MM and reach.min() < NEAR_MM and reach.max() > -NEAR_MM:
            sides.append((off, normal, normal @ corners[0]))
    pairs = [(one[0] + other[0], one[1:], other[1:]) for at, one in enumerate(sides) for other in sides[:at]]
    pairs = [pair for pair in pairs if np.linalg.norm(np.cross(pair[1][0], pair[2][0])) > LEAST_SINE]
    if not pairs:
        return None
    _, (one, at), (other, there) = min(pairs, key=lambda pair: pair[0])
    direction = np.cross(one, other)
    place = np.linalg.solve([one, other, direction], [at, there, direction @ middle])
    return float(np.linalg.norm(place - middle))


def note_edges(verdict, found, mesh):
    """Adds the errors of the touched edges between flat faces to a verdict: one number each, that has the stated standard deviation."""
    faces = flat_faces(mesh)
    for edge in found:
        std = edge.get("std", {}).get("center_mm")
        if edge["kind"] == "edge" and edge["fitted_to"] == "touches" and std is not None:
            distance = distance_to_true(edge, faces)
            verdict.edges[0] += distance is None
            verdict.edges[1] += 1
            if distance is not None:
                verdict.errors["edge", "center_mm"].append((distance, std))
