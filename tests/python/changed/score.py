"""What `touchup doctor` says of each folder, against what changed in it."""

import json
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial.transform import Rotation

from .causes import ANY, CAUSES_OF, CONTROLS
from .kind import numbers_of


def score_all(folders, cases, checker, workers):
    """A line for each folder: a dictionary."""
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(lambda folder: score(folder, cases, checker), folders))


def score(folder, cases, checker):
    change = json.loads((folder / "change.json").read_text())
    own_scan = folder / "scan.ply"
    scan = own_scan if own_scan.exists() else cases / change["case"] / "scan.ply"
    command = [checker, "doctor", scan, folder / "touch.mcap", "--scene", folder / "scene.yaml", "--json"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    line = {"folder": folder.name, **{key: change[key] for key in ("case", "kind", "size", "what")}}
    try:
        diagnosis = json.loads(done.stdout)
    except json.JSONDecodeError:
        return line | {"error": done.stderr.strip() or f"exit code {done.returncode}", "causes": [], "numbers": {}} | judged(change, [])
    findings = diagnosis["findings"]
    found = {number["name"]: (number["value"], number["sigma"]) for finding in reversed(findings[:1]) for number in finding["numbers"]}
    found |= clock_numbers(diagnosis.get("wrench_offset"))
    said = [f"{'sure' if finding['is_sure'] else 'doubt'} {finding['cause']}: {finding['measured']}" for finding in findings]
    return line | {"causes": [finding["cause"] for finding in findings], "said": said, "numbers": compared(change, found)} | judged(change, findings)


def judged(change, findings):
    """Of the table of causes as it is now."""
    accepted = CAUSES_OF.get(change["kind"], ())
    first = findings[0]["cause"] if findings else None
    return {
        "is_control": change["kind"] in CONTROLS,
        "is_named": bool(findings),
        "is_sure": any(finding["is_sure"] for finding in findings),
        "is_right": bool(findings) and (accepted == ANY or first in accepted),
    }


def clock_numbers(offset):
    """Found offset of the wrench clock, and with a drift that at first."""
    if not offset:
        return {}
    whole = (offset["wrench_offset_ms"], offset["sigma_ms"])
    if not offset.get("wrench_drift_sigma_ppm"):
        return {"wrench_offset_ms": whole}
    return {"wrench_offset_at_first_ms": whole, "wrench_drift_ppm": (offset["wrench_drift_ppm"], offset["wrench_drift_sigma_ppm"])}


def compared(change, found):
    """Found, true and standard uncertainty of each number that has both; a time has no uncertainty."""
    true = at_pivot(change, found)
    return {name: {"found": found[name][0], "true": true[name], "sigma": found[name][1]} for name in true if name in found}


def at_pivot(change, found):
    """The true numbers, with the shift of the point about which the program turns, before it turns."""
    true, about = dict(change["numbers"]), [f"about_{axis}_mm" for axis in "xyz"]
    if "shift_x_mm" not in true or about[0] not in found or "turn_x_deg" not in found:
        return true
    lever = np.array([found[name][0] for name in about]) - change["about_mm"]
    turn = Rotation.from_rotvec(np.radians([true[f"turn_{axis}_deg"] for axis in "xyz"]))
    shift = np.array([true[f"shift_{axis}_mm"] for axis in "xyz"]) + turn.apply(lever) - lever
    return true | numbers_of("shift", turn.inv().apply(shift), "mm")
