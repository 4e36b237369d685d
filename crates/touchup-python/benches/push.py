"""Cost of a push from Python over that of the engine itself, on a wavy plate with a ball that slides in contact.

    python crates/touchup-python/benches/push.py [SAMPLES]

Of the installed wheel. The reference is a loop of Rust over the same arrays in the same process, `_push_in_rust`, which makes a sample of
each row and pushes it into the same refinement, including its checks. Times are of the processor. For single pushes they are the least of
several rounds in turn, since other load only adds to them; for `push_many`, with its small share, the median of the ratios of many pairs
with its standard error.
"""

import sys
import time

import numpy as np
import touchup

ROUNDS, PAIRS = 9, 80
SIDE, RADIUS, STIFFNESS, FORCE = 0.1, 1.5e-3, 2e4, 2.0
SCENE = {"tip": {"radius_mm": RADIUS * 1e3, "stiffness_n_per_mm": STIFFNESS / 1e3}, "scan": {"noise_mm": 0.1}}


def wavy_plate(squares=158):
    """About 50,000 faces, m."""
    x, y = np.meshgrid(*[np.linspace(0, SIDE, squares + 1)] * 2, indexing="ij")
    vertices = np.stack([x, y, 1e-4 * np.sin(x * 400) * np.cos(y * 400)], axis=-1).reshape(-1, 3)
    at = np.arange(len(vertices)).reshape(x.shape)
    a, b, c, d = (of.ravel() for of in (at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]))
    return touchup.Mesh(vertices, np.vstack([np.stack([a, b, c], 1), np.stack([b, d, c], 1)]))


def slide(count):
    """50 mm/s at 1 kHz, there and back, a little below the scan."""
    way = np.arange(count) * 50e-6
    width = 0.8 * SIDE
    x = 0.1 * SIDE + np.abs((way % (2 * width)) - width)
    y = 0.1 * SIDE + (way / 200) % width
    position = np.stack([x, y, np.full(count, RADIUS - FORCE / STIFFNESS - 5e-5)], axis=1)
    return touchup.Samples(np.arange(count) * 1_000_000, position, np.tile([0.0, 0.0, FORCE], (count, 1)))


def at_once(push, given):
    started = time.thread_time()
    push(given)
    return time.thread_time() - started


def pairs(mesh, samples, scene):
    """Excess time of `push_many` over the loop of Rust, %, with its standard error."""
    arrays, ratios = samples._arrays(), []
    for at in range(PAIRS):
        rust, many = touchup.Refiner(mesh, scene), touchup.Refiner(mesh, scene)
        ways = [lambda: at_once(rust._push_in_rust, arrays), lambda: at_once(many.push_many, samples)]
        first, second = (ways[turn]() for turn in ((0, 1) if at % 2 == 0 else (1, 0)))
        ratios.append(second / first if at % 2 == 0 else first / second)
    spread = 1.4826 * np.median(np.abs(ratios - np.median(ratios)))
    return (np.median(ratios) - 1) * 100, 1.2533 * spread / np.sqrt(PAIRS) * 100


def rounds(mesh, samples, scene):
    """The least time of each way, s."""
    arrays = samples._arrays()
    rows = list(zip(arrays[0].tolist(), *arrays[1:4]))
    tuples = [(stamp, *(tuple(vector.tolist()) for vector in vectors)) for stamp, *vectors in rows]

    def each(push, given):
        started = time.thread_time()
        for stamp, position, turn, force in given:
            push(stamp, position, turn, force)
        return time.thread_time() - started

    def loop_alone():
        started = time.thread_time()
        for _stamp, _position, _turn, _force in rows:
            pass
        return time.thread_time() - started

    ways = {
        "rust": lambda refiner: at_once(refiner._push_in_rust, arrays),
        "push, arrays": lambda refiner: each(refiner.push, rows),
        "push, tuples": lambda refiner: each(refiner.push, tuples),
        "empty loop": lambda refiner: loop_alone(),
    }
    least = dict.fromkeys(ways, np.inf)
    for _ in range(ROUNDS):
        for name, way in ways.items():
            least[name] = min(least[name], way(touchup.Refiner(mesh, scene)))
    return least


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    mesh, samples = wavy_plate(), slide(count)
    for what, scene in (("haptic update alone", {**SCENE, "patch": False}), ("with the patch", SCENE)):
        least = rounds(mesh, samples, scene)
        rust = least["rust"]
        print(f"{what}: {len(mesh.faces)} faces, {count} samples; the engine takes {rust / count * 1e6:.3f} us a sample")
        print("  push_many: {:+.2f} ± {:.2f} %".format(*pairs(mesh, samples, scene)))
        for name in ("push, arrays", "push, tuples"):
            print(f"  {name}: {(least[name] - rust) / count * 1e6:+.3f} us (of it the loop {least['empty loop'] / count * 1e6:.3f})")


if __name__ == "__main__":
    main()
