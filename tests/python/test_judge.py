"""What a scan gains by a recording, measured by the judge on its cases.

The judge shares no code with touchup and the cases come from another simulator. Only the scan, the recording, and the
ball's radius and stiffness go into touchup; the truth is read by the judge alone. The table goes to target/judge.md.
"""

import importlib
import json
import sys
from collections import namedtuple

import numpy as np
import pytest
import trimesh
from conftest import ROOT
from scipy.spatial import cKDTree

PARTS = ["plate", "flange", "featuretype"]
CASES = ["plate", "plate_hard", "flange", "flange_hard", "featuretype", "featuretype_hard", "featuretype_clean"]
KNOWN = ["--mesh-unit", "mm", "--tip-radius-mm", "1.5", "--stiffness-n-per-mm", "20"]
DIRECTIONS = ["truth_to_mesh", "mesh_to_truth"]
# the judge measures in single precision: half a rounding of a coordinate of 128 mm on each of three axes, mm
UNCHANGED_MM = 3**0.5 * 128 * 2**-24
# vertices are compared in double precision: a few roundings of 128 mm on the way to metres and back, mm
UNMOVED_MM = 4 * 128 * 2**-52
# beyond this the judge counts a place as not touched, mm
FAR_MM = 6

Judged = namedtuple("Judged", "summary scan refined folder mesh")


@pytest.fixture(scope="module")
def judging(judge):
    """The judge as a module."""
    folder = str(judge.parent)
    sys.path.insert(0, folder)
    try:
        return importlib.import_module("judge")
    finally:
        sys.path.remove(folder)


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
def judged(touchup, judging, shared, tmp_path_factory):
    """Each case: what touchup says, and what the judge says about the scan and about the refined mesh."""
    out, found = tmp_path_factory.mktemp("judge"), {}
    for case in CASES:
        folder = shared / "data" / "cases" / case
        refined = out / f"{case}.ply"
        files = ["--scan", folder / "scan.ply", "--bag", folder / "touch.mcap", "--out", refined]
        done = touchup("refine", *files, *KNOWN, "--json")
        # 4: the recordings lose messages on purpose
        assert done.returncode in (0, 4), done.stderr
        before, after = (judging.judge(str(folder), str(mesh)) for mesh in (folder / "scan.ply", refined))
        found[case] = Judged(json.loads(done.stdout), before, after, folder, refined)
    (ROOT / "target").mkdir(exist_ok=True)
    (ROOT / "target" / "judge.md").write_text(table_of(found))
    print("\n" + table_of(found))
    return found


def table_of(found):
    """The results as a table for the README; mm, degrees, µs."""
    head = [
        "case",
        "scan t2m / m2t mean",
        "refined t2m mean / p95",
        "refined m2t mean / p95",
        "normal median",
        "covered",
        "flipped (scan's own)",
        "µs per sample",
    ]
    rows = [head, ["---"] * len(head)]
    for case, (summary, scan, refined, _, _) in found.items():
        row = [case, " / ".join(f"{mean(scan, direction):.3f}" for direction in DIRECTIONS)]
        row += [f"{mean(refined, direction):.3f} / {touched(refined, direction)['p95']:.3f}" for direction in DIRECTIONS]
        row += [f"{refined['touched']['normal_deg']['median']:.1f}", f"{refined['holes']['covered_share']:.3f}"]
        row += [f"{flipped(refined)} ({flipped(scan)})"]
        row += [f"{summary['replay_s'] / summary['samples'] * 1e6:.1f}"]
        rows.append(row)
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


def touched(verdict, direction):
    return verdict["touched"][direction]


def mean(verdict, direction):
    return touched(verdict, direction)["mean"]


def flipped(verdict):
    return verdict["health"]["flipped_faces"]


@pytest.mark.parametrize("direction, column", list(zip(DIRECTIONS, ["t2m mean", "m2t mean"])))
@pytest.mark.parametrize("part", PARTS)
def test_std_is_better_than_the_robust_baseline(judged, baselines, part, direction, column):
    assert mean(judged[part].refined, direction) < float(baselines[part, "robust"][column])


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("part", PARTS)
def test_hard_is_at_most_half_again_std(judged, part, direction):
    assert mean(judged[f"{part}_hard"].refined, direction) <= 1.5 * mean(judged[part].refined, direction)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_clean_is_no_worse_than_std(judged, direction):
    assert mean(judged["featuretype_clean"].refined, direction) <= mean(judged["featuretype"].refined, direction)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("case", CASES)
def test_every_case_is_nearer_to_the_truth_than_its_scan(judged, case, direction):
    assert mean(judged[case].refined, direction) < mean(judged[case].scan, direction)


@pytest.mark.parametrize("case", CASES)
def test_the_mesh_stays_sound(judged, case):
    scan, refined = (verdict["health"] for verdict in judged[case][1:3])
    assert refined["flipped_faces"] <= scan["flipped_faces"]
    assert refined["self_intersecting_faces"] == 0 == scan["self_intersecting_faces"]
    assert refined["zero_area"] == 0
    assert refined["nonmanifold_edges"] <= scan["nonmanifold_edges"]
    assert (refined["vertices"], refined["faces"]) == (scan["vertices"], scan["faces"])


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
    assert np.abs(refined - scan)[far].max() <= UNMOVED_MM


@pytest.mark.parametrize("case", CASES)
def test_every_sample_is_accounted_for(judged, case):
    summary = judged[case].summary
    lost = sum(count for reason, count in summary["refused"].items() if not reason.startswith("pose_"))
    assert summary["samples"] == summary["accepted"] + lost
    assert summary["accepted"] > 0.98 * summary["samples"]
