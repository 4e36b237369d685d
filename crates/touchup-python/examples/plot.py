"""Plots a refinement: the deviation before and after, and what each vertex of the result rests on.

    pip install touchup[plot] trimesh && python plot.py
"""

import matplotlib.pyplot as plt
import numpy as np
import touchup
import trimesh

SCENE = {"tip": {"radius_mm": 1.5, "stiffness_n_per_mm": 20}, "scan": {"noise_mm": 0.3}}
SUPPORT = {touchup.SCAN: "scan", touchup.TOUCHED: "touched", touchup.GUESSED: "guessed", touchup.UNREACHABLE: "unreachable"}


def main():
    ring = trimesh.creation.annulus(r_min=4, r_max=11, height=5, sections=96)  # mm
    touched = touchup.simulate(ring, unit="mm", seed=3, scan_noise_mm=0.3)
    refined = touchup.refine(touched.scan, touched.recording, SCENE)
    truth = touchup.Mesh.of(ring, "mm")

    figure, (histogram, rests_on, known) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    bins = np.linspace(-1, 1, 81)
    for name, mesh in {"scan": touched.scan, "refined": refined.mesh}.items():
        histogram.hist(touchup.compare(mesh, truth).deviation * 1e3, bins, density=True, alpha=0.6, label=name)
    histogram.set(xlabel="deviation from the part, mm", ylabel="density, 1/mm")
    histogram.legend()

    x, y, _ = refined.mesh.vertices.T * 1e3
    for number, name in SUPPORT.items():
        of = refined.mesh.support == number
        rests_on.scatter(x[of], y[of], s=2, label=name)
    rests_on.set(xlabel="x, mm", ylabel="y, mm", aspect="equal", title="what a vertex rests on")
    rests_on.legend(markerscale=4)

    of = refined.mesh.support == touchup.TOUCHED
    points = known.scatter(x[of], y[of], c=refined.mesh.sigma[of] * 1e3, s=2)
    figure.colorbar(points, label="±, mm")
    known.set(xlabel="x, mm", ylabel="y, mm", aspect="equal", title="how well it is known")

    figure.savefig("refined.png", dpi=120)
    print("wrote refined.png")


if __name__ == "__main__":
    main()
