"""Scenes as dictionaries, and errors in the words of the command."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import touchup
from conftest import ROOT, SCENE, plate, run, slide


def error_of_command(*arguments):
    return json.loads(run(*arguments, "--json").stderr.splitlines()[-1])


def test_the_usual_scene_is_the_one_that_the_command_writes(tmp_path):
    scene = touchup.default_scene()
    assert scene["patch"] is None or isinstance(scene["patch"], dict)
    written = tmp_path / "scene.yaml"
    assert run("init", "--help").returncode == 0
    written.write_text(json.dumps({part: keys for part, keys in scene.items() if keys is not None}), encoding="utf-8")
    touchup.check_scene(written)
    assert "robot" not in scene and "compensation" not in scene, "what is off is not there"


def test_keys_are_typed_as_they_are_declared():
    made = subprocess.run([sys.executable, str(ROOT / "generate_scene_keys.py"), "-"], capture_output=True, text=True)
    assert made.stdout == (Path(touchup.__file__).parent / "_scene_keys.py").read_text(encoding="utf-8")


def test_numbers_of_numpy_and_what_is_off_are_taken():
    touchup.check_scene({"tip": {"radius_mm": np.float64(1.5)}, "scan": {"region_low_mm": np.zeros(3), "region_high_mm": (9, 9, 9)}})
    for off in (False, "off"):
        finished = touchup.Refiner(plate(), {**SCENE, "patch": off})
        finished.push_many(slide(0.1e-3, count=300))
        assert finished.finish().mesh.sigma is None


@pytest.mark.parametrize(
    "scene",
    [
        {"tip": {"radius_mm": 1.5}, "contact": {"on_n": -1}},
        {"tip": {"radius_mm": 1.5, "raduis_mm": 2}},
        {"tip": {"radius_mm": 1.5, "shape": "cone"}},
        {"tip": {"radius_mm": 1.5}, "contact": "off"},
    ],
)
def test_a_scene_is_refused_in_the_words_of_the_command(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(json.dumps(scene), encoding="utf-8")
    command = error_of_command("refine", "--scan", "no.ply", "--bag", "no.mcap", "--out", tmp_path / "o.ply", "--scene", path)
    with pytest.raises(touchup.TouchupError) as refusal:
        touchup.check_scene(path)
    assert str(refusal.value) == command["message"]
    assert (refusal.value.kind, refusal.value.hint, refusal.value.exit_code) == tuple(
        command[key] for key in ("kind", "hint", "exit_code")
    )
    with pytest.raises(touchup.TouchupError) as of_dictionary:
        touchup.check_scene(scene)
    assert str(of_dictionary.value) in command["message"]


def test_a_scene_without_a_radius_is_refused():
    with pytest.raises(touchup.TouchupError, match="tip.radius_mm"):
        touchup.refine(plate(), slide(0.1e-3, count=10))


@pytest.mark.parametrize(("scan", "bag"), [("no.ply", "no.mcap"), ("bad.ply", "no.mcap"), ("scan.ply", "no.mcap"), ("scan.ply", "bad.mcap")])
def test_files_are_refused_in_the_words_of_the_command(scan, bag, tmp_path):
    (tmp_path / "bad.ply").write_text("ply\nformat ascii 1.0\n", encoding="utf-8")
    (tmp_path / "bad.mcap").write_text("no recording", encoding="utf-8")
    (tmp_path / "scene.yaml").write_text(json.dumps(SCENE), encoding="utf-8")
    touchup.Mesh(*plate()).write(tmp_path / "scan.ply")
    scan, bag, scene = tmp_path / scan, tmp_path / bag, tmp_path / "scene.yaml"
    command = error_of_command("refine", "--scan", scan, "--bag", bag, "--out", tmp_path / "o.ply", "--scene", scene)
    with pytest.raises(touchup.TouchupError) as refusal:
        touchup.refine(scan, bag, scene)
    assert str(refusal.value) == command["message"]
    assert (refusal.value.kind, refusal.value.hint, refusal.value.exit_code) == tuple(
        command[key] for key in ("kind", "hint", "exit_code")
    )


def test_a_recording_that_is_surely_wrong_is_refused_as_by_the_command(touched, touched_files, tmp_path):
    pulls = touchup.Recording(
        *touched.recording._poses(), touched.recording.wrench_stamp_ns, -touched.recording.force, -touched.recording.torque
    )
    pulls.write(tmp_path / "pulls.mcap")
    scan, scene = touched_files / "scan.ply", touched_files / "scene.yaml"
    flags = ("--scan", scan, "--mesh-unit", "m", "--bag", tmp_path / "pulls.mcap", "--scene", scene)
    command = error_of_command("refine", *flags, "--out", tmp_path / "o.ply")
    with pytest.raises(touchup.TouchupError) as refusal:
        touchup.refine(scan, tmp_path / "pulls.mcap", scene, unit="m")
    assert refusal.value.kind == command["kind"] == "input" and str(refusal.value) == command["message"]
    with pytest.raises(touchup.TouchupError) as of_arrays:
        touchup.refine(touched.scan, pulls, SCENE)
    assert str(of_arrays.value).partition(": ")[2] == command["message"].partition(": ")[2]
