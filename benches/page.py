"""Cost of the operator page in a browser on a large scan, a wavy plate under a sliding ball: time until the first part and the whole of the
mesh are in the picture, work of the main thread on a frame while the camera turns and while the mesh changes, and delay from a sample to
its edit in the page.

    TOUCHUP_BIN=target/release/touchup target/python/bin/python benches/page.py [--faces 1000000] [--seconds 20] [--json]

A release build with feature `web`, and the environment of tests/all.sh. The processor draws WebGL: the work of the page's main thread is
that beside a GPU, the delay of the picture is not, so the window is small. A quiet machine, or compare within one run.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy
import trimesh

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/python"))

from browser import ARGUMENTS, wait_until  # noqa: E402
from playwright.sync_api import sync_playwright  # noqa: E402
from ros_cyclone import (  # noqa: E402
    BEST_EFFORT,
    Header,
    Peer,
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Time,
    Vector3,
    Wrench,
    WrenchStamped,
)
from web_page import PageNode, Socket  # noqa: E402

SIDE_MM, WAVE_MM, HEIGHT_MM = 300.0, 40.0, 2.0
RADIUS_MM, STIFFNESS_N_PER_MM, FORCE_N = 1.5, 20.0, 2.0
# depth of the part below the scan: every contact moves vertices
DEPTH_MM = 0.05
RATE_HZ, SPEED_MM_PER_S, LINE_MM, WIDTH_MM = 500, 50.0, 0.7, 20.0
WINDOW = (640, 480)

# at each drawing of the page: the time, the mesh's version, and its number of faces
WATCH = """
(() => {
    const seen = { first_ms: null, whole_ms: null, edits: [], blocked: [] };
    window.pageBench = seen;
    let newest = 0;
    const look = () => {
        const page = window.touchup;
        if (page !== undefined && page.faceCount() > 0) {
            seen.first_ms ??= performance.now();
            if (page.version() > 0) seen.whole_ms ??= performance.now();
            if (page.version() !== newest) {
                newest = page.version();
                seen.edits.push([performance.timeOrigin + performance.now(), newest]);
            }
        }
        requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
    new PerformanceObserver((list) => seen.blocked.push(...list.getEntries().map((entry) => [entry.startTime, entry.duration])))
        .observe({ type: "longtask", buffered: true });
})();
"""


def height_mm(x, y):
    turn = 2 * numpy.pi / WAVE_MM
    return HEIGHT_MM * numpy.sin(turn * x) * numpy.cos(turn * y)


def write_plate(path, faces):
    """A structured grid of about `faces` triangles, mm."""
    cells = max(round((faces / 2) ** 0.5), 1)
    x, y = numpy.meshgrid(*[numpy.linspace(0, SIDE_MM, cells + 1)] * 2, indexing="ij")
    vertices = numpy.stack([x, y, height_mm(x, y)], axis=-1).reshape(-1, 3)
    near = (numpy.arange(cells)[:, None] * (cells + 1) + numpy.arange(cells)).ravel()
    across, along = near + cells + 1, near + 1
    triangles = numpy.concatenate([numpy.c_[near, across, across + 1], numpy.c_[near, across + 1, along]])
    trimesh.Trimesh(vertices, triangles, process=False).export(path)
    return len(triangles)


def ball(i):
    """Reported place of the ball and measured force, mm and N, at sample `i` of a raster over the middle of the plate."""
    way = i / RATE_HZ * SPEED_MM_PER_S
    line, along = divmod(way, WIDTH_MM)
    x = SIDE_MM / 2 - WIDTH_MM / 2 + (along if line % 2 == 0 else WIDTH_MM - along)
    y = SIDE_MM / 2 - WIDTH_MM / 2 + line * LINE_MM % WIDTH_MM
    step = 1e-4
    slope = [(height_mm(x + step, y) - height_mm(x - step, y)) / (2 * step), (height_mm(x, y + step) - height_mm(x, y - step)) / (2 * step)]
    normal = numpy.array([-slope[0], -slope[1], 1.0])
    normal /= numpy.linalg.norm(normal)
    contact = numpy.array([x, y, height_mm(x, y)]) - DEPTH_MM * normal
    return contact + normal * (RADIUS_MM - FORCE_N / STIFFNESS_N_PER_MM), FORCE_N * normal


def slide(domain, seconds):
    """Publishes samples in real time, each with the stamp of its sending."""
    peer = Peer(domain)
    poses = peer.writer("/stylus/pose", PoseStamped, BEST_EFFORT)
    wrenches = peer.writer("/stylus/wrench", WrenchStamped, BEST_EFFORT)
    time.sleep(2)
    begun = time.monotonic()
    for i in range(round(seconds * RATE_HZ)):
        time.sleep(max(begun + i / RATE_HZ - time.monotonic(), 0))
        place, force = ball(i)
        now = time.time_ns()
        header = Header(Time(now // 10**9, now % 10**9), "object")
        poses.write(PoseStamped(header, Pose(Point(*(place / 1e3).tolist()), Quaternion(0.0, 0.0, 0.0, 1.0))))
        wrenches.write(WrenchStamped(header, Wrench(Vector3(*force.tolist()), Vector3(0.0, 0.0, 0.0))))


class Follower(Socket):
    """Keeps of the mesh only the sending time of the newest sample of each version."""

    def __init__(self, url):
        self.stamps_ms = {}
        super().__init__(url)

    def take_patch(self, patch):
        if patch.base_version > 0 and patch.part + 1 == patch.part_count:
            self.stamps_ms[patch.version] = patch.header.stamp.sec * 1e3 + patch.header.stamp.nanosec / 1e6

    def follow(self, is_over):
        while not is_over.is_set():
            self.take()


def turn_camera(page, frames=60):
    width, height = WINDOW
    page.mouse.move(width / 2, height / 2)
    page.mouse.down()
    for i in range(frames):
        page.mouse.move(width / 2 + 3 * i, height / 2 + i)
        time.sleep(1 / 30)
    page.mouse.up()
    return page.evaluate("touchup.frameTimes()")[-frames:]


def quantiles(values):
    if not len(values):
        return None
    return {"count": len(values), "median": float(numpy.median(values)), "p95": float(numpy.quantile(values, 0.95)), "max": float(max(values))}


def delays_ms(edits, stamps_ms):
    """Delay from the sending of a version's newest sample to the page, for each version with both times."""
    return [at_ms - stamps_ms[version] for at_ms, version in edits if version in stamps_ms]


def measure(program, folder, faces, seconds):
    scan = folder / "scan.ply"
    found = {"faces": write_plate(scan, faces)}
    with sync_playwright() as playwright, PageNode(program, folder, scan) as node:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_context(viewport=dict(zip(("width", "height"), WINDOW, strict=True))).new_page()
        page.set_default_timeout(60_000)
        page.add_init_script(WATCH)
        page.goto(node.url)
        wait_until(page, "window.pageBench !== undefined && pageBench.whole_ms !== null")
        page.evaluate("touchup.idle()")
        seen = page.evaluate("pageBench")
        found["first_part_ms"], found["whole_mesh_ms"] = seen["first_ms"], seen["whole_ms"]
        found["longest_task_at_load_ms"] = max((duration for _, duration in seen["blocked"]), default=0.0)
        found["frame_while_turned_ms"] = quantiles(turn_camera(page))

        is_over = threading.Event()
        follower = Follower(node.url)
        following = threading.Thread(target=follower.follow, args=(is_over,), daemon=True)
        sending = threading.Thread(target=slide, args=(node.domain, seconds), daemon=True)
        for thread in (following, sending):
            thread.start()
        page.evaluate("pageBench.edits.length = pageBench.blocked.length = 0")
        while sending.is_alive():
            time.sleep(0.5)
        seen = page.evaluate("pageBench")
        is_over.set()
        found["frame_while_edited_ms"] = quantiles(page.evaluate("touchup.frameTimes()")[-len(seen["edits"]) or None :])
        found["longest_task_while_edited_ms"] = max((duration for _, duration in seen["blocked"]), default=0.0)
        found["sample_to_page_ms"] = quantiles(delays_ms(seen["edits"], follower.stamps_ms))
        browser.close()
    return found


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--faces", type=int, default=1_000_000, help="triangles of the scan")
    arguments.add_argument("--seconds", type=float, default=20.0, help="duration of touching")
    arguments.add_argument("--json", action="store_true", help="one JSON object")
    given = arguments.parse_args()
    program = os.environ.get("TOUCHUP_BIN", ROOT / "target/release/touchup")
    with tempfile.TemporaryDirectory() as folder:
        found = measure(program, Path(folder), given.faces, given.seconds)
    if given.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        words = ", ".join(f"{key} {part:.4g}" for key, part in value.items()) if isinstance(value, dict) else f"{value:.4g}" if value else value
        print(f"{name:30} {words}")


if __name__ == "__main__":
    main()
