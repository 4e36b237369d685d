"""Makes the folders of changed recordings: touch.mcap, scene.yaml as told, change.json, and scan.ply if it is another one."""

import json
import shutil
import zlib
from functools import cache, partial
from multiprocessing import Pool

import numpy as np
import yaml

from . import of_part, of_pose, of_wrench
from .causes import CAUSES_OF, CONTROLS
from .kind import KINDS, Changed, turned_by_hand
from .recording import read, write

# these add their kinds as they are imported
FAMILIES = (of_part, of_wrench, of_pose)
SIZES = ("small", "middle", "large", "whole")


def make_all(out, cases, kinds, sizes, turn_deg, workers):
    """- `cases`: folders. `kinds`, `sizes`: their names; empty: all of them."""
    assert set(KINDS) == set(CAUSES_OF), set(KINDS) ^ set(CAUSES_OF)
    jobs = [(case, kind) for case in cases for kind in kinds or [*CONTROLS, *KINDS]]
    one = partial(make, out=out, sizes=sizes or SIZES, turn_deg=turn_deg)
    if workers < 2:
        return sum(one(job) for job in jobs)
    with Pool(workers) as pool:
        return sum(pool.imap_unordered(one, jobs, chunksize=8))


def make(job, out, sizes, turn_deg):
    """All sizes of a kind; the number of folders."""
    case, kind = job
    if kind in CONTROLS:
        source = session(case, 0 if kind == "rewritten" else turn_deg)
        folder = write_folder(out, case, kind, "whole", Changed(source, "nothing"))
        if kind == "unchanged":
            shutil.copyfile(case / "touch.mcap", folder / "touch.mcap")
        return 1
    function, all_sizes = KINDS[kind]
    wanted = [(name, size) for name, size in all_sizes.items() if name in sizes]
    for name, size in wanted:
        source = session(case, turn_deg)
        # one noise for all sizes
        source.facts["rng"] = np.random.default_rng(zlib.crc32(f"{case.name} {kind}".encode()))
        write_folder(out, case, kind, name, function(source, size), size)
    return len(wanted)


@cache
def session(case, turn_deg):
    """The recording of a case, with the stylus turned besides."""
    meta = json.loads((case / "meta.json").read_text())
    recording = read(case / "touch.mcap")
    contacts = np.load(case / "oracle.npz")["contacts"]
    middle = (contacts.min(axis=0) + contacts.max(axis=0)) / 2
    recording.facts.update(duration_s=float(recording.pose.time_s.max()), middle_mm=middle, meta=meta)
    return turned_by_hand(recording, turn_deg, np.random.default_rng(1)) if turn_deg else recording


def write_folder(out, case, kind, size, changed, value=None):
    folder = out / f"{case.name}__{kind}__{size}"
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "touch.mcap", changed.recording)
    facts = changed.recording.facts
    meta = facts["meta"]
    scene = {"tip": {"radius_mm": meta["ball_radius_mm"], "stiffness_n_per_mm": meta["tip_stiffness_N_per_mm"]}}
    for part, keys in changed.told.items():
        scene.setdefault(part, {}).update(keys)
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene, sort_keys=False))
    change = {
        "case": case.name,
        "kind": kind,
        "size": size,
        "value": value,
        "accepted": CAUSES_OF.get(kind, ()),
        "numbers": changed.numbers,
        "about_mm": facts["middle_mm"].tolist(),
        "what": changed.what,
    }
    (folder / "change.json").write_text(json.dumps(change, indent=1) + "\n")
    if changed.scan_scale != 1:
        (folder / "scan.ply").write_bytes(scaled_scan((case / "scan.ply").read_bytes(), changed.scan_scale))
    return folder


def scaled_scan(file, scale):
    """A binary PLY whose vertices come first and have three floats each, with these times a factor."""
    head, _, body = file.partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    vertices = np.frombuffer(body, "<f4", 3 * count) * np.float32(scale)
    return head + b"end_header\n" + vertices.astype("<f4").tobytes() + body[12 * count :]
