"""A STEP file from three sides, as docs/step.png shows that of the demo: blue faces are touched, grey ones scanned.

    target/python/bin/python tests/python/step_picture.py part.step docs/step.png
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from test_step_file import Part

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

# elevation and azimuth of each view, degrees
VIEWS = [(35, -60), (35, 120), (-35, 30)]
COLOURS = {True: np.array([0.2, 0.6, 0.9]), False: np.array([0.7, 0.7, 0.7])}
# deflection of the triangles, mm and rad
FINENESS = 0.1, 0.2


def triangles(part):
    """Corners of all triangles, their outward normals, and the colours of their faces."""
    BRepMesh_IncrementalMesh(part.shape, FINENESS[0], False, FINENESS[1])
    corners, colours = [], []
    for name, surface in part.faces.items():
        face = surface.Face()
        mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
        places = np.array([mesh.Node(i).Coord() for i in range(1, mesh.NbNodes() + 1)])
        numbers = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)]) - 1
        corners.append(places[numbers[:, ::-1] if face.Orientation() == TopAbs_REVERSED else numbers])
        colours += [COLOURS[name.endswith("(touched)")]] * len(numbers)
    corners = np.concatenate(corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12), np.array(colours)


def main(step, out):
    corners, normals, colours = triangles(Part(Path(step)))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    figure = plt.figure(figsize=(15, 4))
    for number, (elevation, azimuth) in enumerate(VIEWS, 1):
        up, turn = np.radians([elevation, azimuth])
        view = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        light = 0.45 + 0.55 * np.abs(normals @ view)
        axes = figure.add_subplot(1, len(VIEWS), number, projection="3d")
        shaded = colours * light[:, None]
        axes.add_collection3d(Poly3DCollection(corners, facecolors=shaded, edgecolors=shaded, linewidths=0.4))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low, zoom=1.1)
        axes.view_init(elevation, azimuth)
        axes.set_axis_off()
    figure.subplots_adjust(0, 0, 1, 1, 0, 0)
    figure.savefig(out, dpi=60)


if __name__ == "__main__":
    main(*sys.argv[1:])
