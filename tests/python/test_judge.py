"""Gain of a scan from a recording, measured by the judge on its cases.

The judge shares no code with touchup and the cases come from another simulator. Only the scan, the recording, and the ball's radius and
stiffness go into touchup; the judge alone reads the truth. The quick checks judge one part, with libigl behind the judge; with TOUCHUP_FULL
open3d judges all cases, and their tables go into docs/results.md.
"""

import functools
import importlib
import json
import sys
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import IS_FULL, ROOT
from scipy.spatial import cKDTree

PARTS = ["plate", "flange", "featuretype"] if IS_FULL else ["plate"]
CASES = [*PARTS, *(["plate_hard", "flange_hard", "featuretype_hard", "featuretype_clean"] if IS_FULL else [])]
KNOWN = ["--mesh-unit", "mm", "--tip-radius-mm", "1.5", "--stiffness-n-per-mm", "20"]
DIRECTIONS = ["truth_to_mesh", "mesh_to_truth"]
# the judge measures in single precision: half a rounding of a coordinate of 128 mm on each of three axes, mm
UNCHANGED_MM = 3**0.5 * 128 * 2**-24
# vertices compare in double precision: a few roundings of 128 mm on the way to metres and back, mm
UNMOVED_MM = 4 * 128 * 2**-52
# beyond this the judge counts a place as not touched, mm
FAR_MM = 6
# both baselines that throw the scan's mesh away; the better one counts in each column
OFFLINE = ["poisson", "carve"]
# permitted factor of a hard case over the baselines on the std one
HARD = 1.5
# share of the openings of holes that may stay covered if the baselines are better
COVERED = 0.02
# permitted loss of the scanned or touched surface, as a share
LOST = 0.005
# faces of the result for each of the scan
FACES = 10
# permitted inverted faces beyond the scan's own: the aim is none, the plate has five, the featuretype four
FLIPPED = 5
# permitted excess of a rim over the scan's own and the ends of the through-holes, as the lattice cuts it, mm
RIM_SLACK_MM = 5.0
# holes and slots that the judge requires: those that the ball fits and touched
REQUIRED = {"plate": (1, 0), "flange": (6, 0), "featuretype": (4, 2)}
# permitted errors of center and size by the issue, for the flange larger: its holes are polygons, mm
ALLOWED_MM = {"plate": 0.1, "flange": 0.2, "featuretype": 0.1}
# largest errors, mm: center and size, by measurement (0.003 and 0.045, 0.007 and 0.039, 0.014 and 0.166, 0.023 and 0.157, 0.004 and 0.030,
# 0.019 and 0.028, 0.001 and 0.032) with room for another seed
OFF_MM = {
    "plate": (0.02, 0.06),
    "plate_hard": (0.03, 0.06),
    "flange": (0.03, 0.19),
    "flange_hard": (0.05, 0.19),
    "featuretype": (0.02, 0.05),
    "featuretype_hard": (0.04, 0.05),
    "featuretype_clean": (0.005, 0.05),
}
# least found share of the touched edges, and least true share of the found ones, for cases with edges in the judge's list; measured: 0.537
# and 0.863, 0.828 and 0.906, 0.752 and 0.878, 0.526 and 0.867, 0.687 and 0.809; a rounding of the mesh changes these by up to 0.045
EDGES = {
    "plate": (0.48, 0.8),
    "plate_hard": (0.7, 0.8),
    "featuretype": (0.65, 0.75),
    "featuretype_hard": (0.45, 0.75),
    "featuretype_clean": (0.6, 0.75),
}
# the judge on libigl against the judge on open3d, which measures in single precision: of each distance, mm
SAME_MM = 1e-4
ON_LIBIGL = Path(__file__).with_name("judge_on_libigl")

Judged = namedtuple("Judged", "summary scan refined folder mesh")


def loaded(*folders):
    """The judge as a module, with the contents of the folders before all else."""
    for name in ("judge", "common", "open3d"):
        sys.modules.pop(name, None)
    sys.path[:0] = map(str, folders)
    try:
        return importlib.import_module("judge")
    finally:
        del sys.path[: len(folders)]


@pytest.fixture(scope="module")
def judging(judge):
    """The judge as a module."""
    return loaded(judge.parent) if IS_FULL else loaded(ON_LIBIGL, judge.parent)


@pytest.fixture(scope="module")
def baselines(judge):
    """BASELINES.md: {(case, method): {column: text}} of its first table."""
    lines = (judge.parent / "BASELINES.md").read_text().splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    head = rows[0]
    table = {(row[0], row[1]): dict(zip(head, row)) for row in rows[2:] if len(row) == len(head)}
    assert all((part, "robust") in table for part in PARTS), "the table of the baselines has changed"
    return table


@pytest.fixture(scope="module")
def run(touchup, judging, shared, tmp_path_factory):
    """Refines one case, with or without a scene: the report of touchup, and the judge's verdict on scan and result."""
    out = tmp_path_factory.mktemp("judge")

    @functools.cache
    def of_scan(folder):
        return judging.judge(str(folder), str(folder / "scan.ply"))

    def run(case, scene=None):
        folder = shared / "data" / "cases" / case
        refined = out / f"{case}_{scene.stem if scene else 'default'}.ply"
        features = refined.with_suffix(".json")
        files = ["--scan", folder / "scan.ply", "--bag", folder / "touch.mcap", "--out", refined, "--features-out", features]
        done = touchup("refine", *files, *KNOWN, *(["--scene", scene] if scene else []), "--json")
        # 4: the recordings lose messages on purpose
        assert done.returncode in (0, 4), done.stderr
        after = judging.judge(str(folder), str(refined), str(features))
        return Judged(json.loads(done.stdout), of_scan(folder), after, folder, refined)

    return run


@pytest.fixture(scope="module")
def judged(run):
    """Each case as plain `touchup refine` does it."""
    found = {case: run(case) for case in CASES}
    print("\n" + table_of(found) + "\n" + features_of(found))
    return found


@pytest.fixture(scope="module")
def moved(run, tmp_path_factory):
    """Each case by the haptic update alone: the scene without `patch`."""
    scene = tmp_path_factory.mktemp("scene") / "without_patch.yaml"
    sections = (ROOT / "config" / "default.yaml").read_text().split("\n\n")
    kept = [section for section in sections if "\npatch:" not in section]
    assert len(kept) == len(sections) - 1
    scene.write_text("\n\n".join([*kept, "patch: off\n"]))
    return {case: run(case, scene) for case in CASES}


def table_of(found):
    """The results as a table; mm, degrees, µs."""
    head = [
        "case",
        "scan t2m / m2t mean",
        "refined t2m mean / p95",
        "refined m2t mean / p95",
        "normal median",
        "covered",
        "lost %",
        "open rims (scan's own), mm",
        "flipped (scan's own)",
        "faces",
        "µs per sample",
    ]
    rows = [head, ["---"] * len(head)]
    for case, (summary, scan, refined, _, _) in found.items():
        row = [case, " / ".join(f"{mean(scan, direction):.3f}" for direction in DIRECTIONS)]
        row += [f"{mean(refined, direction):.3f} / {touched(refined, direction)['p95']:.3f}" for direction in DIRECTIONS]
        row += [f"{refined['touched']['normal_deg']['median']:.1f}", f"{refined['holes']['covered_share']:.3f}"]
        missing = refined["missing"]
        row += [f"{missing['lost_share'] * 100:.2f}", f"{missing['open_rim_mm']:.0f} ({missing['scan_open_rim_mm']:.0f})"]
        row += [f"{flipped(refined)} ({flipped(scan)})", str(refined["health"]["faces"])]
        row += [f"{(summary['replay_s'] + summary['patch']['build_s']) / summary['samples'] * 1e6:.1f}"]
        rows.append(row)
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


def features_of(found):
    """The results of each case as a table; mm, degrees."""
    head = ["case", "kind", "required", "found of them", "false", "center max", "size max", "axis mean"]
    rows = [head, ["---"] * len(head)]
    edges = [["case", "touched edges", "recall", "precision"], ["---"] * 4]
    for case, (_, _, refined, _, _) in found.items():
        for kind in ("hole", "slot"):
            m = refined["features"][kind]
            if m["matched"]:
                worst = [f"{m['centre_err_mm']['max']:.3f}", f"{m['size_err_mm']['max_abs']:.3f}", f"{m['axis_err_deg']['mean']:.2f}"]
                rows.append([case, kind, str(m["true"]), str(m["matched"]), str(m["false"]), *worst])
        edge = refined["features"]["edge"]
        if edge["recall"] is not None:
            edges.append([case, f"{edge['true_touched_length_mm']:.0f}", f"{edge['recall']:.3f}", f"{edge['precision']:.3f}"])
    return "\n".join("".join("| " + " | ".join(row) + " |\n" for row in table) for table in (rows, edges))


def touched(verdict, direction):
    return verdict["touched"][direction]


def mean(verdict, direction):
    return touched(verdict, direction)["mean"]


def flipped(verdict):
    return verdict["health"]["flipped_faces"]


def columns_of(verdict):
    """Columns of the baselines' table that a case compares in."""
    t2m, m2t = (touched(verdict, direction) for direction in DIRECTIONS)
    return {
        "t2m mean": t2m["mean"],
        "t2m p95": t2m["p95"],
        "m2t mean": m2t["mean"],
        "m2t p95": m2t["p95"],
        "normal": verdict["touched"]["normal_deg"]["median"],
        "covered": verdict["holes"]["covered_share"],
    }


def best_offline(baselines, part, column):
    # "median / p95" of the normals: the median counts
    return min(float(baselines[part, method][column].split("/")[0]) for method in OFFLINE)


@pytest.mark.parametrize("column", ["t2m mean", "t2m p95", "m2t mean", "m2t p95", "normal", "covered"])
@pytest.mark.parametrize("case", CASES)
def test_no_worse_than_the_better_offline_baseline(judged, baselines, case, column):
    limit = best_offline(baselines, case.split("_")[0], column) * (HARD if case.endswith("hard") else 1)
    if column == "covered":
        limit = max(limit, COVERED)
    assert columns_of(judged[case].refined)[column] <= limit


@pytest.mark.full
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_clean_is_no_worse_than_std(judged, direction):
    assert mean(judged["featuretype_clean"].refined, direction) <= mean(judged["featuretype"].refined, direction)


def through_hole_ends_mm(folder):
    features = json.loads((folder / "truth_features.json").read_text())["features"]
    return sum(np.pi * f["diameter_mm"] for f in features if f["kind"] == "hole" and f.get("through") and f.get("ball_fits"))


@pytest.mark.parametrize("case", CASES)
def test_one_closed_skin(judged, case):
    missing = judged[case].refined["missing"]
    assert missing["lost_share"] <= LOST
    ends = through_hole_ends_mm(judged[case].folder)
    assert missing["open_rim_mm"] <= missing["scan_open_rim_mm"] + ends + RIM_SLACK_MM


@pytest.mark.parametrize("direction, column", list(zip(DIRECTIONS, ["t2m mean", "m2t mean"])))
@pytest.mark.parametrize("part", PARTS)
def test_the_haptic_update_alone_is_better_than_the_robust_baseline(moved, baselines, part, direction, column):
    assert mean(moved[part].refined, direction) < float(baselines[part, "robust"][column])


@pytest.mark.full
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("part", PARTS)
def test_the_haptic_update_alone_is_at_most_half_again_as_far_on_hard(moved, part, direction):
    assert mean(moved[f"{part}_hard"].refined, direction) <= HARD * mean(moved[part].refined, direction)


@pytest.mark.parametrize("case", CASES)
def test_the_haptic_update_alone_keeps_the_faces_and_their_soundness(moved, case):
    scan, refined = (verdict["health"] for verdict in moved[case][1:3])
    assert (refined["vertices"], refined["faces"]) == (scan["vertices"], scan["faces"])
    assert refined["flipped_faces"] <= scan["flipped_faces"]
    assert refined["zero_area"] == 0
    assert refined["nonmanifold_edges"] <= scan["nonmanifold_edges"]
    assert moved[case].summary["patch"] is None


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("case", CASES)
def test_every_case_is_nearer_to_the_truth_than_its_scan(judged, case, direction):
    assert mean(judged[case].refined, direction) < mean(judged[case].scan, direction)


@pytest.mark.parametrize("case", CASES)
def test_the_mesh_stays_sound(judged, case):
    scan, refined = (verdict["health"] for verdict in judged[case][1:3])
    assert refined["flipped_faces"] <= scan["flipped_faces"] + FLIPPED
    assert refined["zero_area"] == 0
    assert refined["nonmanifold_edges"] <= scan["nonmanifold_edges"]
    assert refined["faces"] <= FACES * scan["faces"]


@pytest.mark.full
@pytest.mark.parametrize("case", CASES)
def test_nothing_intersects_itself(judged, moved, case):
    """By pymeshlab."""
    verdicts = [judged[case].scan, judged[case].refined, moved[case].refined]
    assert [verdict["health"]["self_intersecting_faces"] for verdict in verdicts] == [0, 0, 0]


@pytest.mark.full
def test_the_quick_judge_says_what_the_judge_says(judge, judged):
    """libigl in place of open3d: every distance, share and count, and the face that gives a normal.

    If a place is as near to two faces, as beside an edge, either of them is right, and angles between normals differ by the angle of those
    faces: so the test checks that the named faces are nearest, not which of several.
    """
    folder, mesh = str(judged["plate"].folder), str(judged["plate"].mesh)
    whole, quick = loaded(judge.parent), loaded(ON_LIBIGL, judge.parent)
    verdict = quick.judge(folder, mesh)
    for part in ("touched", "missing", "holes", "damage"):
        for ours, theirs in zip(numbers(verdict[part]), numbers(judged["plate"].refined[part]), strict=True):
            assert ours == pytest.approx(theirs, rel=1e-3, abs=SAME_MM), part

    truth, refined = (trimesh.load(path, process=False) for path in (judged["plate"].folder / "truth.ply", mesh))
    places = whole.sample(truth.vertices, truth.faces, 120_000, 1)[0]
    named = [module.closest(module.scene_of(refined.vertices, refined.faces), places) for module in (whole, quick)]
    assert (named[0][1] == named[1][1]).mean() > 0.9
    nearest = np.linalg.norm(named[1][0] - places, axis=1)
    for _, faces in named:
        points = trimesh.triangles.closest_point(refined.triangles[faces], places)
        assert np.abs(np.linalg.norm(points - places, axis=1) - nearest).max() < SAME_MM


def numbers(verdict):
    """All numbers of a verdict but angles, in order."""
    if isinstance(verdict, dict):
        verdict = [value for name, value in verdict.items() if name != "normal_deg"]
    if isinstance(verdict, list):
        return [number for value in verdict for number in numbers(value)]
    return [verdict] if isinstance(verdict, (int, float)) else []


@pytest.mark.parametrize("case", CASES)
def test_what_was_not_touched_is_unchanged(judged, case):
    damage = judged[case].refined["damage"]
    assert damage["scan_to_mesh"]["p99"] <= UNCHANGED_MM
    assert damage["mesh_to_scan"]["p99"] <= UNCHANGED_MM
    scan, refined = (
        np.asarray(trimesh.load(path, process=False).vertices)
        for path in (judged[case].folder / "scan.ply", judged[case].mesh)
    )
    contacts = np.load(judged[case].folder / "oracle.npz")
    to_contact = cKDTree(contacts["contacts"]).query(scan)[0]
    to_ball = cKDTree(contacts["centres"]).query(scan)[0]
    far = (to_contact > FAR_MM) & (to_ball > FAR_MM)
    assert far.sum() > 100
    assert cKDTree(refined).query(scan[far])[0].max() <= UNMOVED_MM


@pytest.mark.parametrize("case", CASES)
def test_every_sample_is_accounted_for(judged, case):
    summary = judged[case].summary
    lost = sum(count for reason, count in summary["refused"].items() if not reason.startswith("pose_"))
    assert summary["samples"] == summary["accepted"] + lost
    assert summary["accepted"] > 0.98 * summary["samples"]


@pytest.mark.parametrize("case", CASES)
def test_every_required_hole_and_slot_is_found_and_no_false_one(judged, case):
    features = judged[case].refined["features"]
    assert (features["hole"]["true"], features["slot"]["true"]) == REQUIRED[case.split("_")[0]]
    for kind in ("hole", "slot"):
        assert (features[kind]["matched"], features[kind]["false"]) == (features[kind]["true"], 0), kind


@pytest.mark.parametrize("kind", ["hole", "slot"])
@pytest.mark.parametrize("case", CASES)
def test_holes_and_slots_are_where_and_as_wide_as_they_are(judged, case, kind):
    part, features = case.split("_")[0], judged[case].refined["features"][kind]
    if REQUIRED[part][kind == "slot"] == 0:
        assert features["found"] == 0
        return
    center, size = features["centre_err_mm"]["max"], features["size_err_mm"]["max_abs"]
    assert max(OFF_MM[case]) <= ALLOWED_MM[part]
    assert (center <= OFF_MM[case][0], size <= OFF_MM[case][1]) == (True, True), (center, size)


@pytest.mark.parametrize("case", [case for case in CASES if case in EDGES])
def test_touched_edges_are_found(judged, case):
    edge, (recall, precision) = judged[case].refined["features"]["edge"], EDGES[case]
    assert edge["true_touched_length_mm"] > 100
    assert edge["recall"] >= recall and edge["precision"] >= precision
