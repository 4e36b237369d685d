"""Repairs a 3D scan by touch: meshes, recordings and results as arrays of NumPy.

Lengths in arrays are in m, forces in N, torques in N·m, stamps in ns; other numbers carry their unit in their name, as
``tip_radius_mm``. Files of meshes have no unit of their own: `unit` names it, ``"mm"`` unless you say otherwise. Frames: the
scan's own frame is O; a pose maps the tip T (origin: centre of the ball; z: along the shaft, from tip to handle) to it.
A wrench is that of the part on the stylus.
"""

from . import sweep
from ._touchup import TouchupError, TouchupWarning, Update
from ._scene_keys import Scene
from .align import Alignment, align, align_pairs
from .compare import Comparison, compare
from .features import features
from .mesh import GUESSED, SCAN, TOUCHED, UNREACHABLE, Mesh, MeshLike
from .recording import Recording, Samples
from .refine import Refined, refine
from .refiner import Event, Pushed, Refiner
from .scene import check_scene, default_scene
from .simulate import Simulated, simulate
from .touches import Touches
from .what_if import Moved, WhatIf, what_if

__all__ = [
    "GUESSED",
    "SCAN",
    "TOUCHED",
    "UNREACHABLE",
    "Alignment",
    "Comparison",
    "Event",
    "Mesh",
    "MeshLike",
    "Moved",
    "Pushed",
    "Recording",
    "Refined",
    "Refiner",
    "Samples",
    "Scene",
    "Simulated",
    "TouchupError",
    "TouchupWarning",
    "Touches",
    "Update",
    "WhatIf",
    "align",
    "align_pairs",
    "check_scene",
    "compare",
    "default_scene",
    "features",
    "refine",
    "simulate",
    "sweep",
    "what_if",
]
