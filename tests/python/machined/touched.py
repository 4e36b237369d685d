"""Parts of the families scanned and touched by `touchup simulate`, refined, and their features judged."""

import json
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from .families import random_part
from .edges import note_edges
from .judge import TOUCHED, Verdict, described, judge
from .part import Part

WORLDS = ["workshop_stylus", "ur", "optical_tracker"]
# the world of the package `foreign`
FOREIGN = "foreign"
SIDES = {"shaft": "z,y,-y,x", "bracket": "z,-x,x", "sheet": "z"}
# distance from a contact within which a point of a wall counts as touched, mm
NEAR_MM = 1.0
# room that a ball needs beyond its own width to go in, mm
ROOM_MM = 1.0


class Failed(Exception):
    """A command that ended otherwise than it should."""


@dataclass
class Result:
    name: str
    world: str
    part: Part
    # touched share of each feature's wall
    shares: list
    verdict: Verdict
    # name of its folder
    folder: str

    def record(self):
        """As JSON has it."""
        verdict, share_of = self.verdict, {id(feature): share for feature, share in zip(self.part.features, self.shares)}
        in_pair = {id(true): found for true, found in verdict.pairs}

        def place(feature):
            of = (lambda name: feature.get(name)) if isinstance(feature, dict) else (lambda name: getattr(feature, name, None))
            center, axis = of("center_mm"), of("axis")
            return {"text": described(feature), "center_mm": np.asarray(center, float).tolist(), "axis": np.asarray(axis, float).tolist()}

        required = [
            {"kind": true.kind, "remark": true.remark, "touched": share_of[id(true)], "is_found": id(true) in in_pair} | place(true)
            for true in verdict.required
        ]
        false = [{"kind": found["kind"], "fitted_to": found["fitted_to"]} | place(found) for found in verdict.false]
        wrong_kind = [{"true": true.kind, "found": found["kind"]} | place(true) for true, found in verdict.wrong_kind]
        errors = [
            {"kind": kind, "number": number, "error_mm": error, "std_mm": std}
            for (kind, number), values in verdict.errors.items()
            for error, std in values
            if np.isfinite(std)
        ]
        return {
            "folder": self.folder,
            "world": self.world,
            "required": required,
            "false": false,
            "wrong_kind": wrong_kind,
            "errors": errors,
            "bounds": {"above": int(verdict.bounds[0]), "all": verdict.bounds[1]},
            "edges": {"without_true": verdict.edges[0], "all": verdict.edges[1]},
        }

    def lines(self):
        """Failures, one line each."""
        share_of = {id(feature): share for feature, share in zip(self.part.features, self.shares)}
        for feature in self.verdict.missed:
            yield f"{self.name}: missed {described(feature)} (touched {share_of[id(feature)]:.0%})"
        for feature in self.verdict.false:
            yield f"{self.name}: false {described(feature)}"
        for true, found in self.verdict.wrong_kind:
            yield f"{self.name}: kind {described(true)} | {described(found)}"
        for true, found in self.verdict.pairs:
            is_known = true.sizes.get("through") is not None and found.get("through") is not None
            if true.kind == found["kind"] == "hole" and is_known and true.sizes["through"] != found["through"]:
                yield f"{self.name}: through {described(true)} | {described(found)}"


class Totals:
    """Sums over several parts."""

    def __init__(self):
        self.counts = defaultdict(lambda: dict.fromkeys(["required", "missed", "false", "found", "kind"], 0))
        self.errors = defaultdict(list)
        self.bounds = [0, 0]
        self.edges = [0, 0]

    def add(self, result):
        of, verdict = self.counts[result.world], result.verdict
        of["required"] += len(verdict.required)
        of["missed"] += len(verdict.missed)
        of["false"] += len(verdict.false)
        of["found"] += verdict.found
        of["kind"] += len(verdict.wrong_kind)
        for key, values in verdict.errors.items():
            self.errors[result.world, *key].extend(values)
        self.bounds = [a + b for a, b in zip(self.bounds, verdict.bounds)]
        self.edges = [a + b for a, b in zip(self.edges, verdict.edges)]

    def table(self):
        lines = ["| world | required | found | false | of another kind |", "|---|---|---|---|---|"]
        for world, of in self.counts.items():
            found = of["required"] - of["missed"]
            lines.append(f"| {world} | {of['required']} | {found} | {of['false']} | {of['kind']} of {of['found']} |")
        lines += ["", "| world | kind | number | n | rms error / std | rms error, mm | median std, mm |", "|---|---|---|---|---|---|---|"]
        for key, values in sorted(self.errors.items()):
            error, std = np.array(values).T
            ratio = np.sqrt(np.mean((error / std) ** 2))
            rms = np.sqrt(np.mean(error**2))
            lines.append(f"| {' | '.join(key)} | {len(error)} | {ratio:.2f} | {rms:.4f} | {np.median(std):.4f} |")
        lines += ["", f"Lower bounds above the truth: {self.bounds[0]} of {self.bounds[1]}."]
        lines += [f"Touched edges without a true one: {self.edges[0]} of {self.edges[1]}."]
        return "\n".join(lines)


def run(command, **more):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, **more)


def simulated(touchup, folder, seed, family, world, scanner):
    """Scan, recording and true contacts of the part in a folder."""
    sides = SIDES.get(family, "z,y,-y,x,-x")
    if world == FOREIGN:
        command = [sys.executable, "-m", "foreign", folder.resolve(), "--seed", seed, f"--sides={sides}"]
        done = run(command, cwd=Path(__file__).parent.parent)
        if done.returncode != 0:
            raise Failed(done.stderr)
        return
    options = ["--world", world] if world else []
    options += ["--scanner", scanner] if scanner else []
    command = [touchup, "simulate", "--truth", folder / "part.stl", "--out", folder, "--seed", seed, f"--sides={sides}", *options]
    done = run(command)
    if done.returncode != 0:
        raise Failed(done.stderr)


def checked_scene(touchup, folder, recording):
    """The scene of a world, with the clock drift that `touchup doctor` reports, as a user would enter it."""
    scene = folder / "scene.yaml"
    done = run([touchup, "doctor", folder / "scan.ply", recording, "--scene", scene, "--json"])
    # 3: surely wrong, which a clock that drifts is; 4: the recordings lose messages on purpose
    if done.returncode not in (0, 3, 4):
        raise Failed(done.stderr)
    clock = json.loads(done.stdout)["wrench_offset"]
    if clock is None or clock["wrench_drift_sigma_ppm"] is None:
        return scene
    numbers = "".join(f"  {key}: {clock[key]}\n" for key in ("wrench_offset_ms", "wrench_drift_ppm"))
    lines = [line for line in scene.read_text().splitlines(True) if not line.lstrip().startswith("wrench_offset_ms:")]
    checked = folder / "checked.yaml"
    checked.write_text("".join(line + numbers if line.startswith("sync:") else line for line in lines))
    return checked


def refined(touchup, folder, world):
    recording = folder / ("touch.csv" if world == FOREIGN else "touch.mcap")
    files = ["--scan", folder / "scan.ply", "--bag", recording, "--out", folder / "refined.ply"]
    files += ["--features-out", folder / "features.json", "--touches-out", folder / "touches.csv"]
    options = ["--scene", checked_scene(touchup, folder, recording)] if world else ["--mesh-unit", "mm", "--tip-radius-mm", "1.5", "--stiffness-n-per-mm", "20"]
    done = run([touchup, "refine", *files, *options, "--json"])
    (folder / "refine.log").write_text(done.stdout + done.stderr)
    # 4: the recordings lose messages on purpose
    if done.returncode not in (0, 4):
        raise Failed(done.stderr)
    return json.loads((folder / "features.json").read_text())["features"]


def touched_shares(part, mesh, labels, contacts):
    """For each feature the touched share of its wall."""
    tree = cKDTree(contacts) if len(contacts) else None
    shares = []
    for feature in part.features:
        faces = np.flatnonzero(np.isin(labels, feature.wall))
        if not len(faces) or tree is None:
            shares.append(0.0)
            continue
        points, _ = trimesh.sample.sample_surface(mesh.submesh([faces], append=True), 400, seed=1)
        shares.append(float((tree.query(points)[0] < NEAR_MM).mean()))
    return shares


def part_run(touchup, out, seed, world, scanner):
    """The verdict on one part, and the touched shares of its features.

    The features are in the frame of the scan. A world's told place of the scan is off, by its stated standard deviation: that is in each
    centre, as it is in the uncertainty of each centre.
    """
    family, part = random_part(seed)
    mesh, labels = part.finished()
    folder = out / f"{seed}_{family}_{world or 'plain'}{'_' + scanner if scanner else ''}"
    folder.mkdir(parents=True, exist_ok=True)
    mesh.export(folder / "part.stl")
    if not (folder / "truth_contacts.csv").exists():
        simulated(touchup, folder, seed, family, world, scanner)
    features = refined(touchup, folder, world)
    contacts_file = np.loadtxt(folder / "truth_contacts.csv", delimiter=",", skiprows=1, ndmin=2)
    centres, contacts = contacts_file[:, 1:4], contacts_file[:, 4:7]
    radius = np.median(np.linalg.norm(centres - contacts, axis=1))
    shares = touched_shares(part, mesh, labels, contacts)
    fits = [feature.entry_mm > 2 * radius + ROOM_MM for feature in part.features]
    required = [not f.is_optional and fit and share > TOUCHED for f, fit, share in zip(part.features, fits, shares)]
    name = f"{seed} {family} {world or 'plain'}"
    verdict = judge(features, part.features, required)
    note_edges(verdict, features, mesh)
    return Result(name, world or "plain", part, shares, verdict, folder.name)
