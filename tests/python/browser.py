"""Debian's chromium, driven by playwright, on the operator's page."""

import io
import time

import numpy
from PIL import Image
from running import DEADLINE_S

# WebGL by software, in a process of its own; nothing goes to other hosts
ARGUMENTS = (
    "--no-sandbox --use-gl=angle --use-angle=swiftshader --no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--disable-quic"
).split()
DESKTOP, LANDSCAPE, PORTRAIT = (1600, 1000), (1180, 820), (820, 1180)


def opened(browser, url, size=DESKTOP, language="en", deadline_ms=60_000, **options):
    """The page, once it shows a mesh; its messages are in `said`, and its errors fail the test that calls `check`."""
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, locale=language, **options)
    page = context.new_page()
    page.set_default_timeout(deadline_ms)
    page.wrong = []
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.goto(url)
    wait_until(page, "window.touchup !== undefined && touchup.faceCount() > 0")
    return page


def wait_until(page, expression, deadline_s=DEADLINE_S):
    """Waits until it holds in the page, whose policy lets no text become code, as playwright's own would have to."""
    until = time.monotonic() + deadline_s
    while not page.evaluate(expression):
        assert time.monotonic() < until, (expression, page.wrong)
        time.sleep(0.02)


def picture(page):
    """Pixels of the canvas on the screen, red, green and blue of each, and the canvas' place in it."""
    page.evaluate("touchup.idle()")
    shot = numpy.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)
    box = page.locator("canvas").first.bounding_box()
    return shot, box


def rays(page, points, box):
    """Rays in the frame of the part through points of the canvas, m: origins and directions."""
    return rays_of(page.evaluate("touchup.camera()"), points, box)


def rays_of(camera, points, box):
    """The same through a camera as the page describes it."""
    view = numpy.array(camera["view"]).reshape(4, 4).T
    projection = numpy.array(camera["projection"]).reshape(4, 4).T
    x = 2 * points[:, 0] / box["width"] - 1
    y = 1 - 2 * points[:, 1] / box["height"]
    back = numpy.linalg.inv(projection @ view)

    def at(depth):
        place = back @ numpy.array([x, y, numpy.full(len(x), depth), numpy.ones(len(x))])
        return (place[:3] / place[3]).T

    near, far = at(-1.0), at(1.0)
    return near, (far - near) / numpy.linalg.norm(far - near, axis=1, keepdims=True)


def first_hits(origins, directions, triangles):
    """For each ray the first triangle that it meets, -1: none (Moeller and Trumbore)."""
    a, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    hits = numpy.full(len(origins), -1)
    for ray, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        across = numpy.cross(direction, ac)
        determinant = (ab * across).sum(1)
        with numpy.errstate(divide="ignore", invalid="ignore"):
            u = ((origin - a) * across).sum(1) / determinant
            behind = numpy.cross(origin - a, ab)
            v = (behind * direction).sum(1) / determinant
            distance = (behind * ac).sum(1) / determinant
        meets = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
        if meets.any():
            hits[ray] = numpy.where(meets, distance, numpy.inf).argmin()
    return hits
