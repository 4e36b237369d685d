"""What comes with the wheel: simulation, command, types, examples, documentation."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import touchup
from conftest import ROOT, run

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PAGE = ROOT.parents[1] / "docs/python.md"


def script(path, folder):
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    return subprocess.run([sys.executable, str(path)], cwd=folder, env=environment, capture_output=True, text=True)


def test_the_simulation_is_that_of_the_command(ring, tmp_path):
    ring.export(tmp_path / "ring.ply")
    flags = ("--seed", 3, "--scan-noise-mm", 0.1, "--scan-edge-mm", 1.5, "--world", "workshop_stylus")
    ended = run("simulate", "--truth", tmp_path / "ring.ply", "--out", tmp_path / "made", *flags)
    assert ended.returncode == 0, ended.stderr
    truth = touchup.Mesh.read(tmp_path / "ring.ply")
    made = touchup.simulate(truth, seed=3, scan_noise_mm=0.1, scan_edge_mm=1.5, world="workshop_stylus")
    scan = touchup.Mesh.read(tmp_path / "made/scan.ply")
    assert np.array_equal(made.scan.faces, scan.faces) and np.allclose(made.scan.vertices, scan.vertices, rtol=1e-14, atol=1e-16)
    recorded = touchup.Recording.read(tmp_path / "made/touch.mcap")
    assert recorded.wrench_frame == "sensor"
    for name in ("pose_stamp_ns", "position", "orientation_xyzw", "wrench_stamp_ns", "force", "torque"):
        assert np.array_equal(np.sort(getattr(made.recording, name), 0), np.sort(getattr(recorded, name), 0)), name
    assert made.scene == (tmp_path / "made/scene.yaml").read_text(encoding="utf-8")


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


def test_every_block_of_the_page_runs(tmp_path):
    blocks = re.findall(r"^```(python|sh)\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    code = tmp_path / "page.py"
    code.write_text("\n".join(text for language, text in blocks if language == "python"), encoding="utf-8")
    ended = script(code, tmp_path)
    assert ended.returncode == 0, ended.stderr
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for text in (text for language, text in blocks if language == "sh" and "pip install" not in text):
        ended = subprocess.run(["sh", "-ec", text], cwd=tmp_path, env={**os.environ, "PATH": path}, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr


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
    for target in ([str(use)], ["-p", "touchup"]):
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
