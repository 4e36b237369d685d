"""Judges found features against the true ones of a part.

A found feature matches a true one if its axis is within 20°, its middle no farther from the true axis than 0.25 sizes (or 0.8 mm), its
place along the axis within the true extent (2 mm room), and its size within a factor of 1.6. The middle of a slot without a length may be
anywhere along the true one: its ends were not touched. Kinds do not matter for that: the judge counts
wrong kinds apart.  Errors are those of numbers with a stated standard deviation.
"""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

# judged kinds; edges, corners, planes do not count here
KINDS = ("hole", "slot", "pocket", "boss", "notch")
# a number of the file and the name of its standard deviation
STATED = {"diameter_mm": "diameter", "width_mm": "width", "length_mm": "length", "depth_mm": "depth"}
# touched share of a wall from which on its feature counts as required
TOUCHED = 0.4


@dataclass
class Verdict:
    required: list = field(default_factory=list)
    missed: list = field(default_factory=list)
    wrong_kind: list = field(default_factory=list)
    false: list = field(default_factory=list)
    found: int = 0
    # kind of feature and number → list of (error, stated deviation)
    errors: dict = field(default_factory=lambda: defaultdict(list))
    # lower bounds that are above the truth, and all
    bounds: list = field(default_factory=lambda: [0, 0])
    # touched edges without a true one, and all
    edges: list = field(default_factory=lambda: [0, 0])
    # (true feature, found feature)
    pairs: list = field(default_factory=list)


def size_of(kind, sizes):
    return sizes.get("width_mm") or sizes.get("diameter_mm") or 0.0


def is_of(found, true):
    axis = np.array(found.get("axis", [0, 0, 1]), float)
    cosine = abs(axis @ true.axis)
    if cosine < np.cos(np.radians(20)):
        return False
    off = np.array(found["center_mm"]) - true.center_mm
    direction = true.sizes.get("direction")
    if direction is not None and found["kind"] == "slot" and "length_mm" not in found:
        half = true.sizes["length_mm"] / 2
        off -= np.clip(off @ direction, -half, half) * direction
    along = off @ true.axis
    aside = np.linalg.norm(off - along * true.axis)
    size, other = size_of(true.kind, true.sizes), size_of(found["kind"], found)
    if not other or not 1 / 1.6 < other / size < 1.6:
        return False
    room = max(0.8, 0.25 * size)
    if true.kind in ("slot", "pocket"):
        room = max(room, 0.25 * true.sizes["length_mm"])
    depth = true.sizes.get("depth_mm") or 0.0
    if true.kind == "boss":
        return aside < room and -2.0 < along < depth + 2.0
    return aside < room and -depth - 2.0 < along < 2.0


def judge(found, part_features, is_required):
    """The verdict on found features, as dictionaries of the features file.

    - is_required: for each true feature whether a program has to find it.
    """
    verdict = Verdict()
    found = [feature for feature in found if feature["kind"] in KINDS]
    left = list(range(len(found)))

    def nearness(at, true):
        off = np.array(found[at]["center_mm"]) - true.center_mm
        size = size_of(true.kind, true.sizes)
        return np.linalg.norm(off) + 3 * abs(np.log(size_of("", found[at]) / size)) * size / 2 + (found[at]["kind"] != true.kind)

    pairs = [(nearness(at, true), at, k) for k, true in enumerate(part_features) for at in left if is_of(found[at], true)]
    of_true, of_found = {}, {}
    for _, at, k in sorted(pairs):
        if k not in of_true and at not in of_found:
            of_true[k], of_found[at] = at, k
    for k, true in enumerate(part_features):
        if is_required[k]:
            verdict.required.append(true)
            if k not in of_true:
                verdict.missed.append(true)
        if k in of_true:
            one = found[of_true[k]]
            verdict.pairs.append((true, one))
            if not true.is_optional:
                verdict.found += 1
                if one["kind"] != true.kind:
                    verdict.wrong_kind.append((true, one))
            note_errors(verdict, one, true)
    # a second feature on a true one is false; a slot or pocket seen in an optional one is not
    for at in left:
        if at in of_found:
            continue
        over = [true for true in part_features if is_of(found[at], true)]
        if not any(true.is_optional for true in over):
            verdict.false.append(found[at])
    return verdict


def note_errors(verdict, one, true):
    if one["kind"] != true.kind:
        return
    std = one.get("std", {})
    for name in STATED:
        value, truth = one.get(name), true.sizes.get(name)
        if value is None or truth is None or name == "depth_mm" and true.is_optional:
            continue
        if name == "depth_mm" and one.get("depth_is_at_least"):
            verdict.bounds[1] += 1
            verdict.bounds[0] += value > truth + 0.05
        elif name in std:
            verdict.errors[true.kind, name].append((value - truth, std[name]))
        else:
            verdict.errors[true.kind, name + " (no std)"].append((value - truth, np.nan))
    off = np.array(one["center_mm"]) - true.center_mm
    off -= (off @ true.axis) * true.axis
    if true.kind in ("hole", "boss") and "center_mm" in std:
        for axis in np.linalg.svd(np.atleast_2d(true.axis))[2][1:]:
            verdict.errors[true.kind, "center_mm"].append((off @ axis, std["center_mm"] / 2**0.5))


def described(feature):
    """One line about a true or a found feature."""
    if isinstance(feature, dict):
        names = [name for name in (*STATED, "through") if feature.get(name) is not None]
        sizes = " ".join(f"{name.removesuffix('_mm')} {feature[name]:.2f}" if name != "through" else f"through {feature[name]}" for name in names)
        return f"{feature['kind']} at {np.round(feature['center_mm'], 1)} along {np.round(feature.get('axis', []), 2)}: {sizes}, {feature.get('fitted_to')}"
    sizes = {name: value if isinstance(value, (bool, type(None))) else round(float(value), 2) for name, value in feature.sizes.items() if name != "direction"}
    return f"{feature.kind} {feature.remark} at {np.round(feature.center_mm, 1)} along {np.round(feature.axis, 2)}: {sizes}"
