"""Tests of the installed wheel: they run outside of the source tree, so that they import no file beside it.

    cd /tmp && python -m pytest …/crates/touchup-python/tests

The mark `full` names a slow proof, for the shards of tests/shards.sh (TOUCHUP_FULL); without the variable pytest does not select it, and
does not read files that need its packages.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import touchup
import trimesh

ROOT = Path(__file__).resolve().parents[1]
collect_ignore = [] if os.environ.get("TOUCHUP_FULL") else ["test_ray.py", "test_engines.py"]

RADIUS_MM = 1.5
SCENE = {"tip": {"radius_mm": RADIUS_MM, "stiffness_n_per_mm": 20.0}, "scan": {"noise_mm": 0.1}}


def pytest_configure(config):
    config.addinivalue_line("markers", "full: a slow proof, for tests/shards.sh")
    assert ROOT not in Path(touchup.__file__).resolve().parents, "install the wheel and run from another folder"


def pytest_collection_modifyitems(config, items):
    if os.environ.get("TOUCHUP_FULL"):
        return
    slow = [item for item in items if item.get_closest_marker("full")]
    config.hook.pytest_deselected(items=slow)
    items[:] = [item for item in items if item not in slow]


def run(*arguments, cwd=None):
    """The command `touchup` of the wheel, beside the interpreter."""
    command = [str(Path(sys.executable).with_name("touchup")), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=cwd)


def done(*arguments, cwd=None):
    """The JSON that a command prints."""
    ended = run(*arguments, cwd=cwd)
    assert ended.returncode in (0, 4), ended.stderr
    return json.loads(ended.stdout)


@pytest.fixture(scope="session")
def ring():
    """A ring of trimesh, in mm: a hole of 8 mm through 5 mm, closed."""
    return trimesh.creation.annulus(r_min=4.0, r_max=11.0, height=5.0, sections=96)


@pytest.fixture(scope="session")
def touched(ring):
    """The ring, scanned and touched."""
    return touchup.simulate(ring, unit="mm", seed=3, scan_noise_mm=0.1, scan_edge_mm=1.5)


@pytest.fixture(scope="session")
def refined(touched):
    return touchup.refine(touched.scan, touched.recording, SCENE)


@pytest.fixture(scope="session")
def touched_files(touched, tmp_path_factory):
    """The same as files: scan in m, recording, scene."""
    folder = tmp_path_factory.mktemp("touched")
    touched.scan.write(folder / "scan.ply", "m")
    touched.recording.write(folder / "touch.mcap")
    (folder / "scene.yaml").write_text(json.dumps(SCENE), encoding="utf-8")
    return folder


def plate(z=0.0, side=0.02, count=21):
    """A flat scan of squares cut in two, m: vertices and faces, normals up."""
    x, y = np.meshgrid(np.linspace(0, side, count), np.linspace(0, side, count), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return vertices, faces


def slide(height, count=4000, force=2.0, stiffness=2e4, side=0.02):
    """A ball of 1.5 mm that presses on a plane at `height`, m, and slides there and back; the tip bends by force / stiffness."""
    turn = np.linspace(0, 40 * np.pi, count)
    share = np.linspace(0.25, 0.75, count)
    position = np.stack([side * (0.5 + 0.25 * np.sin(turn)), side * share, np.full(count, height)], axis=1)
    position[:, 2] += RADIUS_MM * 1e-3 - force / stiffness
    pushes = np.tile([0.0, 0.0, force], (count, 1))
    return touchup.Samples(np.arange(count) * 1_000_000, position, pushes)
