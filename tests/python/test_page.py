"""The operator page in a real browser: its picture against rays cast onto the saved mesh, live changes, lost connections, roles, holding a
button for an arm to move, and the findings of axe-core.
"""

import io
import json
import re
import time

import numpy
import pytest
import trimesh
import zxingcpp
from browser import DESKTOP, LANDSCAPE, PORTRAIT, first_hits, opened, picture, rays, rays_of, wait_until
from conftest import ROOT
from PIL import Image
from ros_player import play_in_step
from ros_process import Process
from running import DEADLINE_S
from test_ros_node import CYCLONE
from test_web import links, newest_link
from web_page import PageNode, Socket

# the part is 0.07 m from 700 px wide
HALF_A_PIXEL_M = 5e-5
AXE = ROOT / "web/node_modules/axe-core/axe.min.js"


@pytest.fixture(scope="module")
def touched(touchup_bin, demo_folder, begun, tmp_path_factory):
    """A node after the beginning of the demo, at rest."""
    folder = tmp_path_factory.mktemp("touched")
    with PageNode(touchup_bin, folder, demo_folder / "scan.ply", "--web-links", ros=CYCLONE) as node:
        # all of it arrives, under any load of the machine
        play_in_step(node, begun, node.domain)
        yield node


def page_of(browser, node, role="operate", **options):
    """A page that is let in by a new link."""
    link = newest_link(node, role)
    count = len(links(node, role))
    page = opened(browser, node.url.rstrip("/") + link, **options)
    node.wait_for(lambda: len(links(node, role)) > count)
    return page


def call(page, service, /, **request):
    """Calls a service over a socket of the page's own origin; the answer."""
    return page.evaluate(
        """([name, request]) => new Promise((resolve, reject) => {
            const socket = new WebSocket(location.origin.replace("http", "ws") + "/ws", "touchup.v1");
            socket.onopen = () => socket.send(JSON.stringify({ id: "test", call: name, request }));
            socket.onerror = () => reject(new Error("no socket"));
            socket.onmessage = ({ data }) => {
                const answer = typeof data === "string" ? JSON.parse(data) : {};
                if (answer.id === "test") { socket.close(); resolve(answer); }
            };
        })""",
        [service, request],
    )


def saved_at_rest(page, node):
    """Saves the mesh as seen.ply at rest, when every follower has the same; returns the answer."""

    def save():
        return call(page, "~/save_mesh", name="seen.ply", overwrite=True)["response"]

    node.wait_for(lambda: save()["mesh_version"] > 0)
    saved = save()
    wait_until(page, f"touchup.version() >= {saved['mesh_version']}")
    return saved


def cookie_of(page):
    (cookie,) = page.context.cookies()
    return f"{cookie['name']}={cookie['value']}"


def test_the_picture_is_that_of_the_saved_mesh_in_its_colours(browser, touched):
    page = page_of(browser, touched)
    saved = saved_at_rest(page, touched)
    page.get_by_role("button", name="Whole part").click()
    # the line that says that no samples come any more moves the picture when it appears
    page.locator(".remedy").wait_for()
    # overlays of the picture do not belong to the mesh
    page.evaluate("document.querySelectorAll('.picture > :not(canvas)').forEach((each) => (each.style.display = 'none'))")
    shot, box = picture(page)
    mesh = trimesh.load(touched.session / "seen.ply", process=False)
    assert page.evaluate("touchup.faceCount()") == len(mesh.faces)

    random = numpy.random.default_rng(7)
    points = random.uniform([20, 20], [box["width"] - 20, box["height"] - 20], (1500, 2)).round() + 0.5
    hits = first_hits(*rays(page, points, box), mesh.triangles * 1e-3)
    at = (points + [box["x"], box["y"]]).astype(int)
    seen = shot[at[:, 1], at[:, 0]]
    background = shot[int(box["y"] + box["height"] // 2), int(box["x"] + 3)]
    is_seen = (numpy.abs(seen - background) > 8).any(1)
    assert (hits >= 0).sum() > 200 and (hits < 0).sum() > 200
    assert (is_seen == (hits >= 0)).mean() > 0.985

    # one colour for each kind of support, as another follower has it: faces all of whose corners are of one kind
    with Socket(touched.url, cookie=cookie_of(page)) as follower:
        follower.take_until(lambda: follower.version >= saved["mesh_version"])
        places = numpy.array([[follower.vertices[vertex] for vertex in face] for face in follower.faces.values()])
        support = numpy.array([[follower.support[vertex] for vertex in face] for face in follower.faces.values()])
    corners = support[first_hits(*rays(page, points, box), places)]
    is_one = (hits >= 0) & (corners.min(1) == corners.max(1))
    red, green, blue = seen.T
    shown = numpy.select([green > 1.3 * numpy.maximum(red, blue), blue > 1.25 * red, red > 1.3 * blue], [1, 2, 3], 0)
    same = shown[is_one] == corners[is_one, 0]
    assert set(corners[is_one, 0]) >= {0, 1}, "scan and touched are in the picture"
    assert same.mean() > 0.95, same.mean()
    assert page.wrong == []
    page.context.close()


def test_a_pick_is_the_first_face_that_a_ray_meets(browser, touched):
    page = page_of(browser, touched)
    saved_at_rest(page, touched)
    page.evaluate("touchup.idle()")
    mesh = trimesh.load(touched.session / "seen.ply", process=False)
    shares = numpy.random.default_rng(3).uniform([0.3, 0.3], [0.7, 0.7], (40, 2))
    # in one turn of the page: a line that appears above the picture moves all of it
    box, camera, picks = page.evaluate(
        """(shares) => {
            const box = document.querySelector("canvas").getBoundingClientRect();
            const picks = shares.map(([x, y]) => touchup.pick(x * box.width, y * box.height));
            return [{ x: box.x, y: box.y, width: box.width, height: box.height }, touchup.camera(), picks];
        }""",
        shares.tolist(),
    )
    origins, directions = rays_of(camera, shares * [box["width"], box["height"]], box)
    hits = first_hits(origins, directions, mesh.triangles * 1e-3)
    for picked, hit, origin, direction in zip(picks, hits, origins, directions, strict=True):
        assert (picked is None) == (hit < 0)
        if picked:
            # on the ray, to half a pixel, and in the plane of the triangle
            place = numpy.array(picked["point"])
            assert numpy.linalg.norm(numpy.cross(place - origin, direction)) < HALF_A_PIXEL_M
            assert abs((place - mesh.triangles[hit][0] * 1e-3) @ mesh.face_normals[hit]) < HALF_A_PIXEL_M
    page.context.close()


def test_holes_and_bosses_are_listed_with_value_and_expanded_uncertainty_as_the_node_has_them(browser, touched):
    page = page_of(browser, touched)
    until = time.monotonic() + DEADLINE_S
    with Socket(touched.url, cookie=cookie_of(page)) as follower:
        follower.take_until(lambda: follower.newest.get("features", {}).get("features"))
        while True:
            follower.take()
            # kinds 1 and 4: hole and boss; U = 2 u, mm
            asked = [one for one in follower.newest["features"]["features"] if one["kind"] in (1, 4) and one["diameter_std"]]
            known = {one["id"]: (1e3 * one["diameter"], 2e3 * one["diameter_std"]) for one in asked}
            rows = page.locator("button.feature").evaluate_all("(rows) => rows.map((row) => row.innerText)")
            shown = {}
            for row in rows:
                if read := re.search(r"^\s*(\d+)\s.*Ø\s(\d+\.\d+)\s±\s(\d+\.\d+)", row, re.S):
                    digits = [len(number.partition(".")[2]) for number in (read[2], read[3])]
                    assert digits[0] == digits[1], row
                    shown[int(read[1])] = (float(read[2]), float(read[3]), 10.0 ** -digits[0])
            # to the last shown digit, with the uncertainty rounded up
            both = [(*shown[one], *known[one]) for one in shown.keys() & known.keys()]
            near = [abs(value - true) < 0.51 * last and -1e-6 < u - true_u < last for value, u, last, true, true_u in both]
            # features come one after the other: the boss of the plate of the demo is among them
            is_there = any(abs(value - 10.0) < 0.03 for value, *_ in shown.values())
            if is_there and shown.keys() == known.keys() and all(near):
                break
            assert time.monotonic() < until, (shown, known)
    page.context.close()


def test_every_size_theme_and_language_has_no_serious_fault_for_who_sees_or_hears_otherwise(browser, touched, tmp_path):
    if not AXE.is_file():
        pytest.skip("axe-core is not there: web/check installs it")
    for size, scheme, language in [(DESKTOP, "light", "en"), (LANDSCAPE, "dark", "de"), (PORTRAIT, "light", "es")]:
        page = page_of(browser, touched, size=size, language=language, color_scheme=scheme, bypass_csp=True)
        page.evaluate("touchup.idle()")
        page.screenshot(path=tmp_path / f"{language}.png")
        page.add_script_tag(path=AXE)
        found = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")["violations"]
        serious = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
        assert serious == [], (language, serious)
        assert page.evaluate("document.documentElement.lang") == language
        # nothing is wider than the window
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.context.close()


def test_who_only_looks_sees_the_same_and_changes_nothing(browser, touched):
    one, other = page_of(browser, touched, role="look"), page_of(browser, touched)
    assert one.evaluate("touchup.faceCount()") == other.evaluate("touchup.faceCount()")
    assert one.get_by_role("button", name="Undo").is_disabled() and other.get_by_role("button", name="Undo").is_enabled()
    other.get_by_role("button", name="Pause").click()
    one.get_by_text("paused").first.wait_for()
    other.get_by_role("button", name="Continue").click()
    one.get_by_text("paused").first.wait_for(state="detached")
    for page in (one, other):
        assert page.wrong == []
        page.context.close()


def test_the_code_of_a_link_that_a_camera_reads_lets_its_role_in(browser, touched):
    page = page_of(browser, touched)
    page.get_by_role("button", name="Another device").click()
    page.get_by_role("button", name="Link to look").click()
    code = page.get_by_role("img", name="QR code of the link")
    code.wait_for()
    (read,) = zxingcpp.read_barcodes(Image.open(io.BytesIO(code.screenshot())))
    assert read.format == zxingcpp.BarcodeFormat.QRCode and read.text == page.locator("output.link").inner_text()
    other = opened(browser, read.text)
    assert other.get_by_role("button", name="Undo").is_disabled() and other.wrong == []
    other.context.close()
    page.context.close()


def on_screen(camera, points):
    """Pixels of the picture at places of the part, m."""
    view = numpy.array(camera["view"]).reshape(4, 4).T
    projection = numpy.array(camera["projection"]).reshape(4, 4).T
    x, y, _, w = projection @ view @ numpy.c_[points, numpy.ones(len(points))].T
    return numpy.c_[(x / w + 1) * camera["width"] / 2, (1 - y / w) * camera["height"] / 2]


def touched_place(page, follower, seed):
    """A place of the picture that shows a touched vertex without an overlay; with that vertex, m."""
    touched = [vertex for vertex, support in follower.support.items() if support == 1]
    places = numpy.array([follower.vertices[vertex] for vertex in touched])
    order = numpy.random.default_rng(seed).permutation(len(places))
    for place, (x, y) in zip(places[order], on_screen(page.evaluate("touchup.camera()"), places)[order], strict=True):
        picked = page.evaluate("([x, y]) => touchup.pick(x, y)", [x, y])
        box = page.locator("canvas").first.bounding_box()
        is_free = page.evaluate("([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS'", [box["x"] + x, box["y"] + y])
        if picked and is_free and numpy.linalg.norm(place - picked["point"]) < 2e-4:
            return x, y, picked["point"]
    raise AssertionError("no touched vertex is seen")


def is_red(page, points):
    """Whether each place of the part has the colour of a removable touch in the picture."""
    pixels = on_screen(page.evaluate("touchup.camera()"), points)
    seen = numpy.array([page.evaluate("([x, y]) => touchup.pixel(x, y)", [x, y])[:3] for x, y in pixels.tolist()])
    return (seen[:, 0] > 150) & (seen[:, 1:].max(1) < 90)


def tap(page, x, y):
    page.locator("canvas").first.click(position={"x": x, "y": y})


def test_a_touch_behind_a_tapped_place_is_shown_and_goes_and_comes(browser, touched):
    page = page_of(browser, touched)
    saved_at_rest(page, touched)
    seen = touched.session / "seen.ply"
    before = seen.read_bytes()
    # the line that says that no samples come any more moves the picture when it appears
    page.locator(".remedy").wait_for()
    page.evaluate("touchup.idle()")
    with Socket(touched.url, cookie=cookie_of(page)) as follower:
        follower.take_until(lambda: follower.version >= page.evaluate("touchup.version()"))
        for seed in range(50):
            x, y, place = touched_place(page, follower, seed)
            # the node's answer, by another way than the page
            point = {"header": {"frame_id": "object"}, "point": dict(zip("xyz", place, strict=True))}
            asked = {"point": point, "preview": True}
            found = follower.call("~/take_out_touch", **asked)["response"]
            # a stroke and no tap, so that its line is long
            if found["success"] and found["contacts"] > 50:
                break
    assert found["success"] and found["contacts"] > 50, found
    contacts = numpy.array([[point[axis] for axis in "xyz"] for point in found["points"]])
    assert not is_red(page, contacts).any()
    tap(page, x, y)
    out = page.get_by_role("button", name="Take out this touch")
    out.wait_for()
    assert f"its contacts: {found['contacts']}" in page.get_by_role("dialog").inner_text()
    page.evaluate("touchup.idle()")
    assert is_red(page, contacts).mean() > 0.8
    page.keyboard.press("Escape")
    assert out.is_hidden()
    page.evaluate("touchup.idle()")
    assert not is_red(page, contacts).any()

    # an onlooker may open the menu of a place, and gets no offer
    looking = page_of(browser, touched, role="look")
    looking.locator(".remedy").wait_for()
    looking.evaluate("touchup.idle()")
    tap(looking, x, y)
    looking.get_by_role("dialog").wait_for()
    with Socket(touched.url, cookie=cookie_of(looking)) as onlooker:
        assert "may look and not operate" in onlooker.call("~/take_out_touch", **asked)["error"]
    assert looking.get_by_role("button", name="Take out this touch").is_hidden()
    looking.context.close()

    tap(page, x, y)
    out.click()
    page.get_by_text("The touch is out").wait_for()
    saved_at_rest(page, touched)
    assert seen.read_bytes() != before
    page.get_by_role("button", name="Put it back").click()
    page.get_by_text("The touch counts again").wait_for()
    saved_at_rest(page, touched)
    assert seen.read_bytes() == before
    assert page.wrong == []
    page.context.close()


def test_changes_come_while_it_is_touched_and_a_page_that_was_away_catches_up(browser, touchup_bin, demo_folder, tmp_path):
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply") as node:
        page = opened(browser, node.url)
        before = page.evaluate("touchup.version()")
        with Process(touchup_bin, "replay", demo_folder / "touch.mcap", domain=node.domain) as player:
            wait_until(page, f"touchup.version() > {before} && touchup.tip() !== null")
            page.context.set_offline(True)
            away = page.evaluate("touchup.version()")
            with Socket(node.url) as other:
                # the node goes on meanwhile
                other.take_until(lambda: other.version > away + 100)
                gone_on = other.version
            page.context.set_offline(False)
            wait_until(page, f"touchup.version() >= {gone_on}")
            player.process.kill()
        # the node ends and another one begins at the same address
        assert node.end() in (0, 4), node.text()
        page.get_by_text("trying again").first.wait_for()
        port = node.url.rsplit(":", 1)[1]
        folder = tmp_path / "again"
        folder.mkdir()
        with PageNode(touchup_bin, folder, demo_folder / "scan.ply", address=f"127.0.0.1:{port}") as again:
            wait_until(page, f"touchup.session() === {json.dumps(again.session.name)}")
            assert page.wrong == []
        page.context.close()
