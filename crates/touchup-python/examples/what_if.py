"""What if one parameter were another one: which vertices and features move by more than their ±.

    pip install touchup trimesh && python what_if.py
"""

import numpy as np
import touchup
import trimesh

CHANGED = ("tip", "radius_mm", 1.52)  # section, key, and what it might be instead
SCENE = {"tip": {"radius_mm": 1.5, "stiffness_n_per_mm": 20}, "scan": {"noise_mm": 0.3}}


def changed(scene, section, key, value):
    """The scene with another value of one key."""
    return {**scene, section: {**scene.get(section, {}), key: value}}


def moved_vertices(before, after):
    """Of each vertex of `before` how far the other surface is from it, m, and whether that is more than twice both ±."""
    away = touchup.compare(before.mesh, after.mesh).deviation
    return away, np.abs(away) > 2 * np.sqrt(2) * before.mesh.sigma


def moved_features(before, after):
    """Numbers of features of both that differ: (feature, number, before, after, ±), mm or degrees."""
    others = {feature["id"]: feature for feature in after.features["features"]}
    for feature in before.features["features"]:
        other = others.get(feature["id"])
        for name, std in feature.get("std", {}).items():
            values = [of.get(name) if of else None for of in (feature, other)]
            if all(isinstance(value, float) for value in values):
                yield feature["kind"], feature["id"], name, *values, np.hypot(std, other.get("std", {}).get(name, std))


def main():
    ring = trimesh.creation.annulus(r_min=4, r_max=11, height=5, sections=96)  # mm
    touched = touchup.simulate(ring, unit="mm", seed=3, scan_noise_mm=0.3)
    before = touchup.refine(touched.scan, touched.recording, SCENE)
    after = touchup.refine(touched.scan, touched.recording, changed(SCENE, *CHANGED))

    away, is_moved = moved_vertices(before, after)
    touches = before.mesh.support == touchup.TOUCHED
    print(f"{'.'.join(CHANGED[:2])}: {SCENE[CHANGED[0]][CHANGED[1]]} -> {CHANGED[2]}")
    print(f"touched vertices: median shift {np.median(away[touches]) * 1e3:+.4f} mm, {is_moved[touches].mean():.0%} by more than their ±")
    for kind, number, name, old, new, std in moved_features(before, after):
        mark = "moved" if abs(new - old) > 2 * std else "within ±"
        print(f"{kind:6} {number:3} {name:12} {old:9.4f} -> {new:9.4f} ± {std:.4f}  {mark}")


if __name__ == "__main__":
    main()
