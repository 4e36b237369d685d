"""Taking one touch out on the operator's page, beside what refine makes of the recording without its wrenches."""

import json

import numpy
import pytest
from part_of_recording import copy_part, ns
from ros_player import play_in_step
from test_page import cookie_of, page_of, saved_at_rest
from test_ros_node import CYCLONE
from web_page import PageNode, Socket


# where no wrench comes for 4096 poses of 1 kHz, the wrenches before are not paired any more: then a recording without a longer touch
# lacks more than that
LONGEST_NS = 3_500_000_000


def lasts_ns(touch):
    return ns(touch["until"]) - ns(touch["touch"])


def without(recording, touch, out):
    """Copies a recording without the wrenches from a touch's first sample until its last; how many those were."""

    def is_kept(topic, stamp_ns):
        return not (topic.endswith("/wrench") and ns(touch["touch"]) <= stamp_ns < ns(touch["until"]))

    return copy_part(recording, out, is_kept)


def on_screen(camera, points):
    """Pixels of the picture at places of the part, m."""
    view = numpy.array(camera["view"]).reshape(4, 4).T
    projection = numpy.array(camera["projection"]).reshape(4, 4).T
    x, y, _, w = projection @ view @ numpy.c_[points, numpy.ones(len(points))].T
    return numpy.c_[(x / w + 1) * camera["width"] / 2, (1 - y / w) * camera["height"] / 2]


def touched_place(page, follower, seed):
    """A place of the picture where a touched vertex is seen, and nothing lies over it; with that vertex, m."""
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
    """Of places of the part, which are drawn in the colour of a touch that may go."""
    pixels = on_screen(page.evaluate("touchup.camera()"), points)
    seen = numpy.array([page.evaluate("([x, y]) => touchup.pixel(x, y)", [x, y])[:3] for x, y in pixels.tolist()])
    return (seen[:, 0] > 150) & (seen[:, 1:].max(1) < 90)


def tap(page, x, y):
    page.locator("canvas").first.click(position={"x": x, "y": y})


@pytest.fixture
def node(touchup_bin, demo_folder, tmp_path):
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", "--web-links", ros=CYCLONE) as node:
        # all has come when the mesh is saved first
        play_in_step(node, demo_folder / "touch.mcap", node.domain)
        yield node


def test_a_touch_behind_a_tapped_place_is_shown_and_goes_and_comes_and_leaves_nothing(browser, node, touchup, demo_folder, tmp_path):
    page = page_of(browser, node)
    saved_at_rest(page, node)
    seen = node.session / "seen.ply"
    before = seen.read_bytes()
    # the line that says that no samples come any more moves the picture when it appears
    page.locator(".remedy").wait_for()
    page.evaluate("touchup.idle()")
    with Socket(node.url, cookie=cookie_of(page)) as follower:
        follower.take_until(lambda: follower.version >= page.evaluate("touchup.version()"))
        for seed in range(50):
            x, y, place = touched_place(page, follower, seed)
            # what the node says of it, by another way than the page
            point = {"header": {"frame_id": "object"}, "point": dict(zip("xyz", place, strict=True))}
            asked = {"point": point, "preview": True}
            found = follower.call("~/take_out_touch", **asked)["response"]
            # a stroke and no tap, so that its line is long
            if found["success"] and found["contacts"] > 50 and lasts_ns(found) < LONGEST_NS:
                break
    assert found["success"] and found["contacts"] > 50 and lasts_ns(found) < LONGEST_NS, found
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

    # who only looks may open the menu of a place, and is offered nothing
    looking = page_of(browser, node, role="look")
    looking.locator(".remedy").wait_for()
    looking.evaluate("touchup.idle()")
    tap(looking, x, y)
    looking.get_by_role("dialog").wait_for()
    with Socket(node.url, cookie=cookie_of(looking)) as onlooker:
        assert "may look and not operate" in onlooker.call("~/take_out_touch", **asked)["error"]
    assert looking.get_by_role("button", name="Take out this touch").is_hidden()
    looking.context.close()

    def take_out():
        tap(page, x, y)
        out.click()
        page.get_by_text("The touch is out").wait_for()
        saved_at_rest(page, node)

    take_out()
    assert seen.read_bytes() != before
    page.get_by_role("button", name="Put it back").click()
    page.get_by_text("The touch counts again").wait_for()
    saved_at_rest(page, node)
    assert seen.read_bytes() == before
    take_out()
    after = seen.read_bytes()
    assert page.wrong == []
    page.context.close()
    assert node.end() in (0, 4), node.text()

    # the same as of what was recorded without its wrenches; and as of the session that is left
    left_out = without(node.session / "recording", found, tmp_path / "without.mcap")
    assert left_out > found["contacts"]
    files = ["--scan", demo_folder / "scan.ply", "--bag", tmp_path / "without.mcap", "--scene", node.session / "scene.yaml"]
    done = touchup("refine", *files, "--out", tmp_path / "without.ply", "--features-out", tmp_path / "without.json", "--json")
    assert done.returncode == 0, done.stderr
    expected = (tmp_path / "without.ply").read_bytes()
    assert after == expected and (node.session / "refined.ply").read_bytes() == expected
    assert json.loads((node.session / "features.json").read_text()) == json.loads((tmp_path / "without.json").read_text())
    done = touchup("refine", "--resume", node.session, "--out", tmp_path / "again.ply", "--json")
    assert (tmp_path / "again.ply").read_bytes() == expected
    # wrenches without a pose beside them are no samples
    assert found["contacts"] < json.loads(done.stdout)["refused"]["taken_out"] <= left_out

