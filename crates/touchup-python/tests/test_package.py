"""Contents of the wheel: simulation, command, types, examples, documentation."""

import os
import subprocess
import sys

import numpy as np
import pytest
import touchup
from conftest import ROOT, run

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def script(path, folder):
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    return subprocess.run([sys.executable, str(path)], cwd=folder, env=environment, capture_output=True, text=True)


def test_a_simulation_in_a_world_comes_with_its_scene_and_back_from_its_file(ring, tmp_path):
    made = touchup.simulate(ring, unit="mm", seed=3, scan_noise_mm=0.1, scan_edge_mm=1.5, world="workshop_stylus")
    (tmp_path / "scene.yaml").write_text(made.scene, encoding="utf-8")
    touchup.check_scene(tmp_path / "scene.yaml")
    made.recording.write(tmp_path / "touch.mcap")
    recorded = touchup.Recording.read(tmp_path / "touch.mcap")
    assert recorded.wrench_frame == made.recording.wrench_frame == "sensor"
    for name in ("pose_stamp_ns", "position", "orientation_xyzw", "wrench_stamp_ns", "force", "torque"):
        # the reader follows the order of a file's stamps, and some arrive late
        assert np.array_equal(np.sort(getattr(made.recording, name), 0), np.sort(getattr(recorded, name), 0)), name
    # of an edge of 1.5 mm: the median of the scan's edges
    corners = made.scan.vertices[made.scan.faces]
    assert 0.7e-3 < np.median(np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)) < 2e-3


def test_the_command_comes_along():
    ended = run("--version")
    assert ended.returncode == 0 and ended.stdout.startswith("touchup ")
    assert run("refine").returncode == 2
    as_module = subprocess.run([sys.executable, "-m", "touchup", "--version"], capture_output=True, text=True)
    assert as_module.stdout == ended.stdout


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_is_short_and_runs(path, tmp_path):
    assert len(path.read_text(encoding="utf-8").splitlines()) < 60
    ended = script(path, tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout


def test_there_are_three_examples():
    assert len(EXAMPLES) == 3


def test_types_are_right_in_the_eyes_of_mypy(tmp_path):
    use = tmp_path / "use.py"
    use.write_text(
        "import touchup\n"
        "scene: touchup.Scene = {'tip': {'radius_mm': 1.5}, 'patch': False}\n"
        "refined = touchup.refine('scan.ply', 'touch.mcap', scene)\n"
        "diameter: float = refined.features['features'][0]['diameter_mm']\n"
        "samples = touchup.Samples(refined.touches.stamp_ns, refined.touches.centre, refined.touches.normal)\n"
        "first: touchup.Event = next(touchup.Refiner(refined.mesh, scene).events(samples))\n"
        "update: touchup.Update = touchup.Refiner(refined.mesh, scene).push(0, (0, 0, 0), (0, 0, 0, 1), [0, 0, 1])\n",
        encoding="utf-8",
    )
    # Ray comes with its own tests: test_ray.py
    config = tmp_path / "without_ray.ini"
    config.write_text("[mypy-ray.*]\nignore_missing_imports = True\n", encoding="utf-8")
    for target in ([str(use)], ["-p", "touchup", "--config-file", str(config)]):
        ended = subprocess.run([sys.executable, "-m", "mypy", "--strict", *target], capture_output=True, text=True, cwd=tmp_path)
        assert ended.returncode == 0, ended.stdout
    use.write_text("import touchup\nscene: touchup.Scene = {'tip': {'raduis_mm': 1.5}}\n", encoding="utf-8")
    ended = subprocess.run([sys.executable, "-m", "mypy", "--strict", str(use)], capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 1 and 'TypedDict item "tip"' in ended.stdout


def test_stubs_have_what_the_native_half_has(tmp_path):
    command = [sys.executable, "-m", "mypy.stubtest", "touchup._touchup", "--ignore-disjoint-bases"]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_everything_public_says_what_it_is():
    for name in touchup.__all__:
        of = getattr(touchup, name)
        assert isinstance(of, int) or getattr(of, "__doc__", None) or name in ("MeshLike",), name
