"""Own data as arrays: a noisy scan of a ball is touched all over, and its error falls.

    pip install touchup && python own_arrays.py
"""

import numpy as np
import touchup

RADIUS, NOISE = 20e-3, 0.2e-3  # of the ball and of its scan, m
TIP, STIFFNESS, FORCE = 1.5e-3, 2e4, 2.5  # radius of the stylus' ball, m; N/m; how hard it presses, N


def on_unit_ball(turns, down):
    """Points at `turns` around z and `down` (0 to 1) from pole to pole: (N, 3)."""
    around, polar = turns * 2 * np.pi, down * np.pi
    return np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)


def ball(around=60, rings=30):
    """Vertices and faces of a ball: rings between two poles, counter-clockwise seen from outside."""
    i, ring = np.meshgrid(np.arange(around), np.arange(1, rings))
    vertices = np.vstack([on_unit_ball(np.zeros(1), np.zeros(1)), on_unit_ball(i / around, ring / rings).reshape(-1, 3)])
    vertices = np.vstack([vertices, on_unit_ball(np.zeros(1), np.ones(1))])
    at = 1 + np.arange((rings - 1) * around).reshape(rings - 1, around)
    right, last = np.roll(at, -1, axis=1), len(vertices) - 1
    a, b, c, d = at[:-1].ravel(), right[:-1].ravel(), at[1:].ravel(), right[1:].ravel()
    top = np.stack([np.zeros(around, int), at[0], right[0]], axis=1)
    bottom = np.stack([np.full(around, last), right[-1], at[-1]], axis=1)
    return vertices * RADIUS, np.vstack([top, np.stack([a, c, b], 1), np.stack([b, c, d], 1), bottom])


def main():
    vertices, faces = ball()
    scan = vertices + np.random.default_rng(1).normal(scale=NOISE, size=vertices.shape)

    # one minute at 1 kHz: a spiral from pole to pole, pressed along the normal; the tip bends by FORCE / STIFFNESS
    share = np.linspace(0, 1, 60_000)
    normal = on_unit_ball(60 * share, share)
    position = normal * (RADIUS + TIP - FORCE / STIFFNESS)
    samples = touchup.Samples(np.arange(len(share)) * 1_000_000, position, normal * FORCE)

    scene = {"tip": {"radius_mm": TIP * 1e3, "stiffness_n_per_mm": STIFFNESS / 1e3}, "scan": {"noise_mm": NOISE * 1e3}, "patch": False}
    refiner = touchup.Refiner((scan, faces), scene, wrench_frame="object")
    refiner.push_many(samples)

    def error_mm(vertices):
        return np.abs(np.linalg.norm(vertices, axis=1) - RADIUS).mean() * 1e3

    refined = refiner.finish().mesh
    print(f"mean error {error_mm(scan):.3f} mm -> {error_mm(refined.vertices):.3f} mm by {len(samples)} samples")
    refined.write("ball.ply")


if __name__ == "__main__":
    main()
