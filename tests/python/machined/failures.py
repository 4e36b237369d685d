"""python -m machined.failures OUT.png PARTS VERDICTS.json...: missed (red) and invented (violet) features, each with its surroundings.

PARTS is the folder of `python -m machined`, the files are its --json. Each picture shows the true part on the left and the refined mesh on
the right, cut out around the place and seen along the axis, a little aslant; red faces show their backs.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageDraw

from .sheet import SIZE, TOWARDS_EYE, Camera, drawn

# around the place, mm
AROUND = 16.0
WORDS = 34
MISSED, INVENTED = (200, 30, 30), (120, 0, 160)


def cut_out(mesh, centre):
    near = np.linalg.norm(mesh.triangles.mean(1) - centre, axis=1) < AROUND
    faces = mesh.triangles[near] if near.any() else mesh.triangles[:1]
    return trimesh.Trimesh(**trimesh.triangles.to_kwargs(faces))


def view_along(axis):
    """Turns the world so that the sheet's camera looks along an axis, 30° aslant."""
    axis = np.array(axis) / np.linalg.norm(axis)
    aside = np.linalg.svd(axis[None])[2][1]
    towards = axis * np.cos(np.radians(30)) + aside * np.sin(np.radians(30))
    return trimesh.geometry.align_vectors(towards, TOWARDS_EYE / np.linalg.norm(TOWARDS_EYE))[:3, :3]


def picture(parts, verdict, place, colour):
    folder = parts / verdict["folder"]
    centre = np.array(place["center_mm"])
    turn = view_along(place["axis"])
    panels = []
    meshes = [trimesh.load(folder / "part.stl"), trimesh.load(folder / "refined.ply", process=False)]
    # large faces of the true part reach far beyond the cut
    meshes[0] = meshes[0].subdivide_to_size(4.0)
    for mesh in meshes:
        piece = cut_out(mesh, centre)
        piece.vertices = (piece.vertices - centre) @ turn.T
        camera = Camera(np.array([[-1, -1, -1], [1, 1, 1]]) * AROUND / 2)
        panels.append(drawn(piece, camera)[::-1])
    image = Image.fromarray((255 * np.concatenate(panels, axis=1)).round().astype(np.uint8))
    framed = Image.new("RGB", (2 * SIZE, SIZE + 52), "white")
    framed.paste(image, (0, 0))
    text = ImageDraw.Draw(framed)
    words, lines = f"{verdict['folder']}: {place['text']}".split(), [""]
    for word in words:
        if len(lines[-1]) + len(word) > 2 * WORDS:
            lines.append("")
        lines[-1] += word + " "
    for number, line in enumerate(lines[:4]):
        text.text((4, SIZE + 1 + 12 * number), line, fill=colour)
    text.rectangle((0, 0, 2 * SIZE - 1, SIZE + 51), outline=colour)
    return framed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("parts", type=Path)
    parser.add_argument("verdicts", type=Path, nargs="+")
    parser.add_argument("--columns", type=int, default=3)
    arguments = parser.parse_args()
    cells = []
    for verdict in (verdict for path in arguments.verdicts for verdict in json.loads(path.read_text())):
        missed = [one for one in verdict["required"] if not one["is_found"]]
        for place, colour in [(one, MISSED) for one in missed] + [(one, INVENTED) for one in verdict["false"]]:
            cells.append(picture(arguments.parts, verdict, place, colour))
            print(f"{verdict['folder']}: {place['text']}", flush=True)
    if not cells:
        print("nothing was missed or invented")
        return
    width, height = cells[0].size
    rows = -(-len(cells) // arguments.columns)
    sheet = Image.new("RGB", (width * arguments.columns, height * rows), "white")
    for number, one in enumerate(cells):
        sheet.paste(one, (number % arguments.columns * width, number // arguments.columns * height))
    sheet.save(arguments.out)


if __name__ == "__main__":
    main()
