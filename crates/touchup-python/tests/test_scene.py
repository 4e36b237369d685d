"""Scenes as dictionaries, and errors in the words of the command."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import touchup
from conftest import ROOT, SCENE, plate, run, slide


def test_the_usual_scene_is_a_scene():
    scene = touchup.default_scene()
    assert scene["patch"] is None or isinstance(scene["patch"], dict)
    touchup.check_scene({part: keys for part, keys in scene.items() if keys is not None})
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
    ("scene", "says"),
    [
        ({"tip": {"radius_mm": 1.5}, "contact": {"on_n": -1}}, "on_n"),
        ({"tip": {"radius_mm": 1.5, "raduis_mm": 2}}, "raduis_mm"),
        ({"tip": {"radius_mm": 1.5, "shape": "cone"}}, "cone"),
        ({"tip": {"radius_mm": 1.5}, "contact": "off"}, "contact"),
    ],
)
def test_a_scene_is_refused_by_its_key_and_its_file(scene, says, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(json.dumps(scene), encoding="utf-8")
    with pytest.raises(touchup.TouchupError, match=says) as refusal:
        touchup.check_scene(path)
    assert (refusal.value.kind, refusal.value.exit_code) == ("scene", 3) and str(path) in str(refusal.value)
    with pytest.raises(touchup.TouchupError, match=says):
        touchup.check_scene(scene)


def test_a_scene_without_a_radius_is_refused():
    with pytest.raises(touchup.TouchupError, match="tip.radius_mm"):
        touchup.refine(plate(), slide(0.1e-3, count=10))


@pytest.mark.parametrize(
    ("scan", "bag", "kind"),
    [("no.ply", "no.mcap", "mesh"), ("bad.ply", "no.mcap", "mesh"), ("scan.ply", "no.mcap", "recording"), ("scan.ply", "bad.mcap", "recording")],
)
def test_a_file_is_refused_by_its_name(scan, bag, kind, tmp_path):
    (tmp_path / "bad.ply").write_text("ply\nformat ascii 1.0\n", encoding="utf-8")
    (tmp_path / "bad.mcap").write_text("no recording", encoding="utf-8")
    touchup.Mesh(*plate()).write(tmp_path / "scan.ply")
    wrong = bag if scan == "scan.ply" else scan
    with pytest.raises(touchup.TouchupError, match=wrong) as refusal:
        touchup.refine(tmp_path / scan, tmp_path / bag, SCENE)
    assert (refusal.value.kind, refusal.value.exit_code) == (kind, 3)


def test_an_error_has_the_words_of_the_command(tmp_path):
    """All of its fields, once: both make them of one error."""
    with pytest.raises(touchup.TouchupError) as refusal:
        touchup.refine(tmp_path / "no.ply", tmp_path / "no.mcap", SCENE)
    command = run("refine", "--scan", tmp_path / "no.ply", "--bag", "no.mcap", "--out", tmp_path / "o.ply", "--tip-radius-mm", 1.5, "--json")
    told = json.loads(command.stderr.splitlines()[-1])
    assert {"message": str(refusal.value), "kind": refusal.value.kind, "hint": refusal.value.hint, "exit_code": refusal.value.exit_code} == told


def test_a_recording_that_is_surely_wrong_is_refused(touched, touched_files, tmp_path):
    pulls = touchup.Recording(
        *touched.recording._poses(), touched.recording.wrench_stamp_ns, -touched.recording.force, -touched.recording.torque
    )
    pulls.write(tmp_path / "pulls.mcap")
    for scan, recording in [(touched.scan, pulls), (touched_files / "scan.ply", tmp_path / "pulls.mcap")]:
        with pytest.raises(touchup.TouchupError, match="force") as refusal:
            touchup.refine(scan, recording, SCENE, unit="m")
        assert (refusal.value.kind, refusal.value.exit_code) == ("input", 3)
