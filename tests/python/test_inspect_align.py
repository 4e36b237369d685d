"""`touchup inspect --align`: a drawing in a frame of its own, against NumPy and SciPy."""

import csv
import json
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import trimesh
from conftest import ROOT
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

DRAWING = ROOT / "examples/plate_nominal.csv"
PLACES, AXES = ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")
MOTION = Rotation.from_rotvec([0.7, -1.9, 0.4]), np.array([310.0, -42.0, 87.5])
UP, SIDE = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
# a plate as drawn: name, kind, centre, axis, diameter
PLATE = [
    ("top", "plane", (30.0, 25.0, 12.0), UP, None),
    ("bore", "hole", (16.0, 36.0, 12.0), UP, 8.0),
    ("pin", "hole", (52.0, 11.0, 12.0), UP, 5.0),
    ("boss", "boss", (47.0, 29.0, 12.0), UP, 10.0),
    ("side", "plane", (60.0, 25.0, 6.0), SIDE, None),
]


def measured(part, motion, noise=0.0, seed=1):
    """Features that touching finds of the part in its place: the inverse of the motion, and errors of the stated size."""
    turn, shift = motion
    rng = np.random.default_rng(seed)
    features = []
    for number, (_, kind, centre, axis, diameter) in enumerate(part):
        u, tilt = 0.004 + 0.002 * number, 0.02 + 0.01 * number
        across = rng.normal(0, noise * u / np.sqrt(2), 3)
        axis = np.array(axis) + rng.normal(0, noise * np.radians(tilt) / np.sqrt(2), 3)
        feature = {
            "id": 10 + number,
            "kind": kind,
            "center_mm": turn.inv().apply(np.array(centre) + across - shift).tolist(),
            "axis": turn.inv().apply(axis / np.linalg.norm(axis)).tolist(),
            "std": {"center_mm": u, "axis_deg": tilt, "diameter_mm": 0.004},
            "fitted_to": "touches",
        }
        features.append(feature | ({"diameter_mm": diameter} if diameter else {}))
    return features


def rows_of(part, ids=False):
    rows = []
    for number, (name, kind, centre, axis, diameter) in enumerate(part):
        row = {"name": name, "kind": kind, "center_mm": list(centre), "axis": list(axis)} | ({"feature": 10 + number} if ids else {})
        if diameter:
            rows.append(row | {"quantity": "diameter_mm", "nominal_mm": diameter, "tolerance_mm": 0.1})
            rows.append(row | {"name": f"{name} place", "quantity": "position_mm", "tolerance_mm": 0.2})
        else:
            rows.append(row | {"quantity": "flatness_mm", "tolerance_mm": 0.1})
    return rows


def inspect(touchup, folder, features, rows, *more):
    (folder / "features.json").write_text(json.dumps({"features": features}))
    (folder / "drawing.json").write_text(json.dumps({"characteristics": rows}))
    return touchup("inspect", folder / "features.json", "--nominal", folder / "drawing.json", "--json", *more)


def aligned(touchup, folder, features, rows, *more):
    ran = inspect(touchup, folder, features, rows, *more)
    assert ran.returncode in (0, 4), ran.stderr
    return json.loads(ran.stdout)


def refused(touchup, folder, features, rows, *more):
    ran = inspect(touchup, folder, features, rows, *more)
    assert (ran.returncode, ran.stdout) == (3, ""), ran
    error = json.loads(ran.stderr)
    assert error["kind"] == "alignment", error
    return error["message"]


@pytest.mark.parametrize("how", ["best-fit", "datums=top,bore,pin", "datums=top,side,boss"])
@pytest.mark.parametrize("ids", [False, True])
def test_a_known_motion_is_found_and_positions_are_about_the_drawing(touchup, tmp_path, how, ids):
    record = aligned(touchup, tmp_path, measured(PLATE, MOTION), rows_of(PLATE, ids), "--align", how)
    found = record["alignment"]
    assert np.abs(np.array(found["rotation"]) - MOTION[0].as_matrix()).max() < 1e-9
    assert np.abs(np.array(found["translation_mm"]) - MOTION[1]).max() < 1e-6
    assert np.abs(Rotation.from_rotvec(found["rotation_vector_deg"], degrees=True).as_matrix() - MOTION[0].as_matrix()).max() < 1e-9
    assert found["residual_max_mm"] < 1e-6 and found["method"] == how.split("=")[0]
    places = {one["name"]: one for one in record["characteristics"] if one["quantity"] == "position_mm"}
    assert len(places) == 3 and all(one["actual_mm"] < 1e-6 and one["decision"] == "pass" for one in places.values())
    assert len(found["features"]) == (5 if how == "best-fit" else 3)


def kabsch(a, b):
    """The motion of a onto b of least squares."""
    turn, _ = Rotation.align_vectors(b - b.mean(axis=0), a - a.mean(axis=0))
    return turn, b.mean(axis=0) - turn.apply(a.mean(axis=0))


def test_a_known_motion_is_that_of_kabsch(touchup, tmp_path):
    features = measured(PLATE, MOTION)
    turn, shift = kabsch(np.array([one["center_mm"] for one in features]), np.array([one[2] for one in PLATE]))
    found = aligned(touchup, tmp_path, features, rows_of(PLATE), "--align", "best-fit")["alignment"]
    assert np.abs(turn.as_matrix() - found["rotation"]).max() < 1e-9 and np.abs(shift - found["translation_mm"]).max() < 1e-6


def across(axis):
    """Two directions across an axis."""
    return np.linalg.svd(np.reshape(axis, (1, 3)))[2][1:]


def test_a_best_fit_and_its_uncertainties_are_those_of_scipy(touchup, tmp_path):
    features = measured(PLATE, MOTION, noise=1.0)
    record = aligned(touchup, tmp_path, features, rows_of(PLATE), "--align", "best-fit")
    middle = np.mean([one["center_mm"] for one in features], axis=0)

    def equations(twist):
        """Deviations from nominal places and directions, each over its standard uncertainty; and the number of those of the place."""
        turn, all_of = Rotation.from_rotvec(twist[3:]) * MOTION[0], []
        for one, (_, kind, centre, axis, _) in zip(features, PLATE, strict=True):
            place = turn.apply(np.array(one["center_mm"]) - middle) + twist[:3] + MOTION[0].apply(middle) + MOTION[1]
            directions = np.reshape(axis, (1, 3)) if kind == "plane" else across(axis)
            std = one["std"]["center_mm"] / np.sqrt(len(directions))
            all_of.append(directions @ (place - centre) / std)
            all_of.append(across(axis) @ turn.apply(one["axis"]) / (np.radians(one["std"]["axis_deg"]) / np.sqrt(2)))
        return np.concatenate(all_of)

    best = least_squares(equations, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    turn = Rotation.from_rotvec(best.x[3:]) * MOTION[0]
    found = record["alignment"]
    assert np.abs(turn.as_matrix() - found["rotation"]).max() < 1e-7
    shift = best.x[:3] + MOTION[0].apply(middle) + MOTION[1] - turn.apply(middle)
    assert np.abs(shift - found["translation_mm"]).max() < 1e-5
    covariance = np.linalg.inv(best.jac.T @ best.jac)
    stds = np.sqrt(np.diag(covariance))
    assert np.allclose(found["translation_std_mm"], stds[:3], rtol=1e-3)
    assert np.allclose(np.radians(found["rotation_std_deg"]), stds[3:], rtol=1e-3)
    # the share of a feature in the frame is no error of its own
    left = np.eye(len(best.fun)) - best.jac @ covariance @ best.jac.T
    at, checked = 0, 0
    for one, (name, kind, *_) in zip(features, PLATE, strict=True):
        count = 1 if kind == "plane" else 2
        rows = range(at, at + count)
        at += count + 2
        if kind == "plane":
            continue
        position = next(row for row in record["characteristics"] if row["name"] == f"{name} place")
        share = np.sqrt(np.trace(left[np.ix_(rows, rows)]) / 2)
        expected = 2 * share * one["std"]["center_mm"] / np.sqrt(2)
        assert position["standard_uncertainty_mm"] == pytest.approx(expected, rel=1e-3)
        off = np.linalg.norm(best.fun[rows]) * one["std"]["center_mm"] / np.sqrt(2)
        aside = next(row for row in found["features"] if row["name"] == name)["residual_mm"]
        assert aside == pytest.approx(off, abs=1e-6)
        checked += 1
    assert checked == 3


def moved_rows(motion):
    """The drawing of the example in another frame."""
    turn, shift = motion
    with open(DRAWING, newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in table:
        for names in ([f"center_{axis}" for axis in PLACES], [f"datum_{axis}" for axis in PLACES]):
            if row[names[0]]:
                place = turn.apply([float(row[name]) for name in names]) + shift
                row |= {name: repr(float(x)) for name, x in zip(names, place, strict=True)}
        row |= {name: repr(float(x)) for name, x in zip(AXES, turn.apply([float(row[name]) for name in AXES]), strict=True)}
    return table


def test_a_drawing_that_was_moved_gives_the_same_decisions_and_a_report_that_says_so(touchup, demo_folder, tmp_path):
    records = []
    for number, motion in enumerate([(Rotation.identity(), np.zeros(3)), MOTION]):
        table, folder = moved_rows(motion), tmp_path / str(number)
        folder.mkdir()
        with open(folder / "n.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, table[0].keys())
            writer.writeheader()
            writer.writerows(table)
        files = [folder / name for name in ("r.html", "r.csv", "r.qif")]
        flags = [flag for pair in zip(("--out", "--csv", "--qif"), files, strict=True) for flag in pair]
        ran = touchup("inspect", demo_folder / "features.json", "--nominal", folder / "n.csv", "--align", "best-fit", "--json", *flags)
        assert ran.returncode == 4, ran.stderr
        records.append((json.loads(ran.stdout), files))
    (still, _), (moved, files) = records
    for one, other in zip(still["characteristics"], moved["characteristics"], strict=True):
        assert (one["name"], one["decision"], one["feature"]) == (other["name"], other["decision"], other["feature"])
        assert one["actual_mm"] == pytest.approx(other["actual_mm"], abs=1e-6)
        assert one["standard_uncertainty_mm"] == pytest.approx(other["standard_uncertainty_mm"], rel=1e-6)
    decisions = {one["name"]: one["decision"] for one in moved["characteristics"]}
    assert [name for name, decision in decisions.items() if decision != "pass"] == ["blind hole diameter", "slot width"]
    # the plate lies in the scan as drawn, and alignment finds it there to the accuracy of its touches
    found = still["alignment"]
    assert np.abs(found["rotation_vector_deg"]).max() < 0.05 and found["residual_max_mm"] < 0.03
    turned = np.array(moved["alignment"]["rotation"])
    assert np.abs(turned - MOTION[0].as_matrix() @ np.array(found["rotation"])).max() < 1e-8
    html, table, qif = (file.read_text(encoding="utf-8") for file in files)
    assert "<h2>Alignment</h2>" in html and "best fit" in html and "through-hole diameter" in html
    assert all(row["frame"] == "drawing by best-fit" for row in csv.DictReader(table.splitlines()))
    attributes = {node.get("name"): node.get("value") for node in ElementTree.fromstring(qif).iter() if node.get("name")}
    assert attributes["touchup.frame"] == "drawing by best-fit"
    motion = [[float(x) for x in row.split()] for row in attributes["touchup.mesh_to_drawing"].split(";")]
    assert np.abs(np.array(motion)[:, :3] - turned).max() < 1e-12
    # and without it alignment finds nothing
    ran = touchup("inspect", demo_folder / "features.json", "--nominal", tmp_path / "1/n.csv", "--json")
    assert {one["decision"] for one in json.loads(ran.stdout)["characteristics"]} == {"undecided"}


def square(turn=0.0):
    """Four bores in a square, and the plane that they are in."""
    corners = [(20.0, 20.0), (40.0, 20.0), (40.0, 40.0), (20.0, 40.0)]
    bores = [(f"bore {number}", "hole", (x, y, 10.0), UP, 6.0) for number, (x, y) in enumerate(corners)]
    return [("top", "plane", (30.0, 30.0, 10.0), UP, None), *bores]


def test_what_cannot_be_aligned_is_one_error_that_says_what_to_do(touchup, tmp_path):
    best = ("--align", "best-fit")
    features = measured(PLATE, MOTION)
    # turns of a square are as good as one another, unless the drawing names its bores
    error = refused(touchup, tmp_path, measured(square(), MOTION), rows_of(square()), *best)
    assert "the pattern is symmetric" in error and "column feature" in error, error
    named = aligned(touchup, tmp_path, measured(square(), MOTION), rows_of(square(), ids=True), *best)
    assert named["alignment"]["residual_max_mm"] < 1e-6
    # the left-handed twin
    twin = [(name, kind, (-x, y, z), (-a, b, c), d) for name, kind, (x, y, z), (a, b, c), d in PLATE]
    error = refused(touchup, tmp_path, features, rows_of(twin), *best)
    assert "mirror image" in error or "no motion brings" in error, error
    # without axes bores in one plane leave turns open
    bare = [{name: value for name, value in row.items() if name != "axis"} for row in rows_of(PLATE, ids=True)]
    error = refused(touchup, tmp_path, features, [row for row in bare if row["name"] != "side"], *best)
    assert "open" in error and "axis_x, axis_y, axis_z" in error, error
    # one bore, and one bore and a plane
    error = refused(touchup, tmp_path, features, rows_of(PLATE, ids=True)[1:2], *best)
    assert "a turn about (0.00 0.00 1.00) and a shift along (0.00 0.00 1.00) are left open by bore (hole)" in error, error
    error = refused(touchup, tmp_path, features, rows_of(PLATE), "--align", "datums=top,bore")
    assert "a turn about (0.00 0.00 1.00) is left open by top (plane), bore (hole)" in error, error
    # datums that are none
    error = refused(touchup, tmp_path, features, rows_of(PLATE), "--align", "datums=top,axle")
    assert '"axle"' in error and "it has top, bore, pin" in error, error
    untouched = [one | {"std": {}} if one["id"] == 11 else one for one in features]
    error = refused(touchup, tmp_path, untouched, rows_of(PLATE), "--align", "datums=top,bore,pin")
    assert '"bore"' in error and "feature 11 has no touches behind its place: touch it" in error, error
    # a method that is none is wrong usage
    ran = inspect(touchup, tmp_path, features, rows_of(PLATE), "--align", "icp")
    assert ran.returncode == 2 and "best-fit, or datums=NAME" in ran.stderr, ran.stderr


def test_a_named_feature_that_is_far_off_is_refused_with_its_distance(touchup, tmp_path):
    features, rows = measured(PLATE, MOTION), rows_of(PLATE, ids=True)
    for row in rows:
        if row["name"].startswith("boss"):
            row["center_mm"] = [47.0, 32.0, 12.0]
    error = refused(touchup, tmp_path, features, rows, "--align", "best-fit")
    assert "off its nominal place" in error or "fit it in no way" in error, error
    # by datums it is a position that fails
    record = aligned(touchup, tmp_path, features, rows, "--align", "datums=top,bore,pin")
    boss = next(one for one in record["characteristics"] if one["name"] == "boss place")
    assert (boss["decision"], boss["actual_mm"]) == ("fail", pytest.approx(6.0, abs=1e-6))


@pytest.mark.parametrize("of_mesh", [{"std": {}, "fitted_to": "mesh"}, {"fitted_to": "mesh"}])
def test_features_that_were_not_touched_are_named_and_do_not_count(touchup, tmp_path, of_mesh):
    features = measured(PLATE, MOTION)
    features[3] |= of_mesh | { "center_mm": (np.array(features[3]["center_mm"]) + 0.3).tolist()}
    record = aligned(touchup, tmp_path, features, rows_of(PLATE), "--align", "best-fit")
    assert record["alignment"]["residual_max_mm"] < 1e-6
    assert [one["name"] for one in record["alignment"]["features"]] == ["top", "bore", "pin", "side"]
    assert any("boss" in note and "Not used for the alignment" in note for note in record["notes"])


def test_a_cad_mesh_in_a_frame_of_its_own_is_found_by_its_features(touchup, demo_folder, tmp_path):
    cad = trimesh.load(demo_folder / "truth.ply", process=False)
    to_drawing = np.eye(4)
    to_drawing[:3, :3], to_drawing[:3, 3] = MOTION[0].as_matrix(), MOTION[1]
    records = []
    for number, motion in enumerate([np.eye(4), to_drawing]):
        path = tmp_path / f"cad{number}.ply"
        cad.copy().apply_transform(motion).export(path)
        flags = ["--general", "iso2768-m", "--position-mm", 0.3, "--align", "best-fit", "--json"]
        ran = touchup("inspect", demo_folder / "features.json", "--nominal", path, *flags)
        assert ran.returncode in (0, 4), ran.stderr
        records.append(json.loads(ran.stdout))
    still, moved = records
    decisions = [{(one["feature"], one["quantity"]): one["decision"] for one in record["characteristics"]} for record in records]
    assert decisions[0] == decisions[1] and "pass" in decisions[0].values()
    assert any(quantity == "position_mm" for _, quantity in decisions[0])
    # the scan of the demo lies as its plate does: the motion is that of the drawing, to the accuracy of its touches
    found = moved["alignment"]
    turn = Rotation.from_matrix(found["rotation"]) * MOTION[0].inv()
    middle = MOTION[0].inv().apply(np.array(found["center_mm"]) - MOTION[1])
    shift = Rotation.from_matrix(found["rotation"]).apply(middle) + found["translation_mm"] - found["center_mm"]
    assert np.all(np.abs(shift) < 5 * np.array(found["translation_std_mm"]) + 0.005), (shift, found)
    assert np.all(np.abs(turn.as_rotvec(degrees=True)) < 5 * np.array(found["rotation_std_deg"]) + 0.005), found
    assert {one["kind"] for one in found["features"]} >= {"hole", "plane"} and len(still["alignment"]["features"]) == len(found["features"])
