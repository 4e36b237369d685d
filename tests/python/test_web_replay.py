"""The replay of a session on the operator page: against a page's view of the session itself and its saved files, its controls, the number
of its viewers and their permissions, and its page in a browser.
"""

import contextlib
import json
import shutil
import time
from pathlib import Path
from urllib.parse import quote

import numpy
import pytest
import trimesh
from browser import LANDSCAPE, wait_until
from part_of_recording import copy_part, ns
from ros_process import Process
from scipy.spatial import cKDTree
from test_page import page_of
from test_web import ask, let_in
from web_page import DEADLINE_S, PageNode, Socket
from websockets.exceptions import ConnectionClosed, InvalidStatus

pytestmark = pytest.mark.full
# support of a vertex that rests on a touch
TOUCHED = 1
# of the demo's touches are in the session, twice
HALF_NS = 12 * 10**9
# until then the hand of the demo follows the edges without lifting the stylus for long
BEGIN_NS = 16 * 10**9
# setpriority: steps behind the node
STEPS_BEHIND = 5


class ReplaySocket(Socket):
    """The socket of a page that replays a session."""

    def __init__(self, node, session, **options):
        super().__init__(node.url, path=f"/ws?replay={quote(session, safe='')}", **options)

    @property
    def state(self):
        return self.newest.get("replay", {"is_ready": False, "error": None})

    def set(self, **request):
        answer = self.call("~/replay", **request)
        assert answer.get("response", {}).get("success"), answer

    def ready(self):
        self.take_until(lambda: self.state["is_ready"] and self.faces)
        return self

    def refused(self):
        """Why there is no replay."""
        with pytest.raises(ConnectionClosed):
            self.take_until(lambda: False)
        return self.state["error"]

    def run_to_the_end(self):
        self.set(at_s=1e9)
        self.take_until(lambda: self.state["is_at_end"])


def triangles(page):
    """The triangles of a page in an order independent of numbering and rotation: of the three orders of each the least, bit by bit. A
    change of the mesh makes them once: made for each message, they would fall behind the messages.
    """
    state = page.session, page.version
    if page.known_triangles is None or page.known_triangles[0] != state:
        corners = numpy.array([[page.vertices[vertex] for vertex in face] for face in page.faces.values()], dtype=numpy.float32)
        turned = [numpy.roll(corners.view(numpy.uint32), -at, axis=1).reshape(-1, 9).tolist() for at in range(3)]
        page.known_triangles = state, sorted(map(min, *turned))
    return page.known_triangles[1]


def touched_places(page):
    return [page.vertices[vertex] for vertex, support in page.support.items() if support == TOUCHED and vertex in page.vertices]


def sampled_ns(page):
    """Stamp of the newest sample; None before the first."""
    mismatch = page.newest.get("mismatch")
    return mismatch and ns(mismatch["header"]["stamp"])


def rest(page, for_s=2):
    """Takes messages up until the mesh has stayed unchanged for a while."""
    version, since = page.version, time.monotonic()
    while time.monotonic() - since < for_s:
        page.take()
        if page.version != version:
            version, since = page.version, time.monotonic()


def touch_that(page, begins_right):
    """A touch whose beginning (ns) is as wanted, by the vertices that rest on it."""
    places = touched_places(page)
    for at in numpy.random.default_rng(5).permutation(len(places))[:200]:
        point = {"header": {"frame_id": "object"}, "point": dict(zip("xyz", places[at], strict=True))}
        found = page.call("~/take_out_touch", point=point, preview=True)["response"]
        if found["success"] and begins_right(ns(found["touch"])) and found["contacts"] > 20:
            return found["touch"]
    raise AssertionError("no touch begins then")


def take_until(pages, condition):
    """Takes messages of several pages up until the condition holds: the node leaves behind a page that reads nothing for long."""
    until = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < until, [page.newest for page in pages]
        for page in pages:
            with contextlib.suppress(TimeoutError):
                page.take(0.05)


def played(touchup_bin, recording, domain, page):
    """Plays a recording to its end while a page follows."""
    with Process(touchup_bin, "replay", recording, "--speed", 8, domain=domain) as player:
        take_until([page], lambda: player.process.poll() is not None)
        assert player.wait() == 0, player.text()


def halved(recording, folder):
    """24 s of a recording in two halves: a touch that begins between two changes of strokes would discard the redoable ones."""
    times = []
    copy_part(recording, folder / "none.mcap", lambda _, stamp_ns: times.append(stamp_ns))
    begin = min(times) + BEGIN_NS
    middle, end = begin + HALF_NS, begin + 2 * HALF_NS
    copy_part(recording, folder / "first.mcap", lambda _, stamp_ns: begin <= stamp_ns < middle)
    copy_part(recording, folder / "second.mcap", lambda _, stamp_ns: middle <= stamp_ns < end)
    return folder / "first.mcap", folder / "second.mcap"


@pytest.fixture(scope="module")
def recorded(touchup_bin, demo_folder, tmp_path_factory):
    """An ended session: with undo and redo of strokes during the touches, and one removal; in the end with another removal, and one undo.
    Returns its folder, and the triangles of a page at rest.
    """
    folder = tmp_path_factory.mktemp("recorded")
    halves = halved(demo_folder / "touch.mcap", folder)
    with PageNode(touchup_bin, folder, demo_folder / "scan.ply") as node, Socket(node.url) as page:
        played(touchup_bin, halves[0], node.domain, page)
        assert page.call("~/undo", strokes=2)["response"]["strokes"] == 2
        assert page.call("~/redo", strokes=1)["response"]["strokes"] == 1
        changed_ns = sampled_ns(page)

        def saved():
            return page.call("~/save_mesh", overwrite=True)["response"]["mesh_version"]

        def at_rest():
            page.take_until(saved)
            version = saved()
            page.take_until(lambda: page.version >= version)

        def take_out(begins_right):
            at_rest()
            out = page.call("~/take_out_touch", touch=touch_that(page, begins_right))["response"]
            assert out["success"], out

        # long before the undone strokes
        take_out(lambda begun_ns: begun_ns < changed_ns - 5 * 10**9)
        played(touchup_bin, halves[1], node.domain, page)
        at_rest()
        take_out(lambda begun_ns: changed_ns + 10**9 < begun_ns < sampled_ns(page) - 3 * 10**9)
        at_rest()
        assert page.call("~/undo", strokes=1)["response"]["strokes"] == 1
        at_rest()
        seen = triangles(page)
        assert node.end() in (0, 4), node.text()
    changes = [json.loads(line)["change"] for line in (node.session / "strokes.jsonl").read_text().splitlines()]
    assert changes == ["undo", "undo", "redo", "take_out", "take_out", "undo"]
    return node.session, seen


def with_session(node, recorded, *names):
    """Copies of the session beside the one that a node has."""
    for name in names:
        shutil.copytree(recorded[0], node.session.parent / name)


@pytest.fixture(scope="module")
def node(touchup_bin, demo_folder, recorded, tmp_path_factory):
    """A node whose page everybody on this machine may use, with three copies of the session."""
    with PageNode(touchup_bin, tmp_path_factory.mktemp("open"), demo_folder / "scan.ply") as node:
        with_session(node, recorded, "one", "two", "three")
        yield node


def threads(node, name):
    """Steps by which the threads of a name stand behind others."""
    found = []
    for task in Path(f"/proc/{node.process.pid}/task").iterdir():
        try:
            if (task / "comm").read_text().strip() == name:
                found.append(int((task / "stat").read_text().rsplit(")", 1)[1].split()[16]))
        except (FileNotFoundError, ProcessLookupError):
            continue
    return found


def files_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_replay_ends_bit_by_bit_with_the_mesh_of_the_session_and_leaves_it_as_it_was(node, recorded):
    session, seen = recorded
    before = files_of(node.session.parent / "one")
    with ReplaySocket(node, "one") as page:
        page.ready()
        assert page.newest["state"]["session"] == "one" and page.newest["state"]["role"] == "look"
        assert page.state["damage"] is None
        # with a rest of 2 s between the halves
        assert 23 < page.state["end_s"] < 28
        page.run_to_the_end()
        page.take_until(lambda: len(page.faces) == len(seen) and triangles(page) == seen)
        assert page.newest["features"]["features"] and page.newest["tip"]["markers"] and page.newest["mismatch"]
        assert page.counts.get("diagnostics") is None and page.newest["annotations"]["features"] == {}
        # and so it is in the file
        mesh = trimesh.load(session / "refined.ply", process=False)
        assert len(page.faces) == len(mesh.faces)
        corners = numpy.array([[page.vertices[vertex] for vertex in face] for face in page.faces.values()])
        ours, theirs = (numpy.asarray(places).mean(axis=1) for places in (corners * 1e3, mesh.triangles))
        distances, nearest = cKDTree(theirs).query(ours)
        assert distances.max() < 1e-3 and len(set(nearest)) == len(theirs)
    assert files_of(node.session.parent / "one") == before


def test_a_touch_that_was_taken_out_is_there_until_then(node, recorded):
    kept = node.session.parent / "kept"
    shutil.copytree(recorded[0], kept)
    lines = (kept / "strokes.jsonl").read_text().splitlines(keepends=True)
    (kept / "strokes.jsonl").write_text("".join(line for line in lines if "take_out" not in line))

    # the first removal came between the halves
    before_s = HALF_NS / 1e9 - 2
    with ReplaySocket(node, "one") as one, ReplaySocket(node, "kept") as kept:
        for page in (one, kept):
            page.ready().set(is_paused=True, at_s=before_s)
        take_until([one, kept], lambda: all(page.state.get("target_s") is None and page.state.get("at_s", 0) >= before_s - 0.1 for page in (one, kept)))
        take_until([one, kept], lambda: len(one.faces) == len(kept.faces) and triangles(one) == triangles(kept))
        assert len(touched_places(one)) > 100


def test_what_was_undone_in_the_session_makes_the_difference(node, recorded):
    _, seen = recorded
    folder = node.session.parent / "redone"
    shutil.copytree(recorded[0], folder)
    (folder / "strokes.jsonl").unlink()
    with ReplaySocket(node, "redone") as page:
        page.ready().run_to_the_end()
        rest(page)
        assert triangles(page) != seen


def test_it_plays_pauses_and_goes_back_by_beginning_again(node):
    with ReplaySocket(node, "one") as page:
        page.ready()
        page.set(speed=4)
        page.take_until(lambda: page.state["at_s"] > 2)
        page.set(is_paused=True)
        page.take_until(lambda: page.state["is_paused"])
        held = page.state["at_s"]
        time.sleep(0.5)
        page.set(speed=1)
        page.take_until(lambda: page.state["speed"] == 1)
        assert page.state["at_s"] < held + 0.5
        # it runs ahead, and stays there
        page.set(at_s=18)
        page.take_until(lambda: page.state["target_s"] == 18)
        page.take_until(lambda: page.state["target_s"] is None)
        assert 17.9 <= page.state["at_s"] <= 18.1 and page.state["is_paused"] and page.session == "one#1"
        rest(page)
        late = len(touched_places(page))
        # another page of the same session sees the same place
        with ReplaySocket(node, "one") as other:
            page.set(at_s=6)
            take_until([page, other], lambda: page.session == "one#2" and page.state["target_s"] is None and page.state["at_s"] >= 5.9)
            take_until([page, other], lambda: other.session == "one#2" and other.state.get("at_s") == page.state["at_s"])
            rest(page)
            assert len(touched_places(page)) < late
            for request, words in [({"speed": 0}, "it may be 0.1 to 100"), ({"at_s": -1}, "it may be 0 or more"), ({"to": 1}, "unknown field")]:
                assert words in page.call("~/replay", **request)["error"]
            assert page.newest["state"]["clients"] == 2


def test_nothing_of_a_replay_acts_on_a_session_or_an_arm(node):
    before = files_of(node.session.parent / "two")
    with Socket(node.url) as live, ReplaySocket(node, "two") as page:
        live.take_until(lambda: live.faces)
        page.ready()
        page.take_until(lambda: page.state["at_s"] > 1)
        for service in [
            "~/undo", "~/redo", "~/take_out_touch", "~/reset", "~/save_mesh", "~/pause", "~/stop", "~/recover", "~/probe_all", "~/probe_feature",
            "~/flag_feature", "~/annotate_feature", "~/invite", "~/set_parameter", "~/arm_state", "~/nothing",
        ]:
            assert "nothing can be changed" in page.call(service)["error"], service
        page.beat()
        assert "no service" in live.call("~/replay", speed=2)["error"]
        page.take_until(lambda: page.version > 100)
        state = live.call("~/arm_state")["response"]
        assert not state["success"] and live.newest["state"]["session"] == node.session.name
        assert not live.newest["state"]["is_paused"] and not live.newest.get("tip", {}).get("markers")
        # its threads stand behind those of the node
        assert sorted(threads(node, "haptic")) == [0, STEPS_BEHIND] and threads(node, "replay") == [STEPS_BEHIND]
    assert files_of(node.session.parent / "two") == before


def test_two_sessions_are_replayed_at_a_time_and_one_is_gone_with_its_last_page(node):
    node.wait_for(lambda: threads(node, "replay") == [])
    with ReplaySocket(node, "one") as one:
        one.ready()
        with ReplaySocket(node, "two") as two:
            two.ready()
            with ReplaySocket(node, "three") as three:
                assert "two sessions are being replayed already" in three.refused()
            # but others may look at one that there is
            with ReplaySocket(node, "two") as again:
                again.ready()
            assert len(threads(node, "replay")) == 2
        node.wait_for(lambda: len(threads(node, "replay")) == 1)
        with ReplaySocket(node, "three") as three:
            three.ready()
            one.take_until(lambda: one.state["at_s"] > 0.5)
    node.wait_for(lambda: threads(node, "replay") == [] and threads(node, "haptic") == [0])


def test_what_cannot_be_replayed_is_refused_in_words(node, recorded):
    folder = node.session.parent
    (folder / "empty").mkdir()
    (folder / "linked").symlink_to(recorded[0])
    shutil.copytree(recorded[0], folder / "other")
    facts = json.loads((folder / "other/session.json").read_text())
    (folder / "other/session.json").write_text(json.dumps({**facts, "scan_crc32": facts["scan_crc32"] ^ 1}))
    shutil.copytree(recorded[0], folder / "untouched", ignore=shutil.ignore_patterns("recording"))
    for name, words in [
        ("missing", "no session of this name"),
        ("", "no session of this name"),
        ("../sessions/one", "no session of this name"),
        ("linked", "no session of this name"),
        ("empty", "is that the folder of a session"),
        ("other", "restore the scan"),
        ("untouched", "the recording cannot be replayed"),
    ]:
        with ReplaySocket(node, name) as page:
            assert words in page.refused(), name
    node.wait_for(lambda: threads(node, "replay") == [])


def test_who_only_looks_replays_too_and_who_is_not_let_in_does_not(touchup_bin, demo_folder, recorded, tmp_path):
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", "--web-links") as closed:
        with_session(closed, recorded, "one")
        with ReplaySocket(closed, "one", cookie=let_in(closed, "look")) as page:
            page.ready()
            page.set(speed=16)
            page.take_until(lambda: page.state["speed"] == 16)
        with pytest.raises(InvalidStatus) as refused, ReplaySocket(closed, "one"):
            pass
        assert refused.value.response.status_code == 401
        assert ask(closed.url, "/?replay=one")[0] == 200


def test_the_page_says_that_it_is_a_replay_and_offers_nothing_else(browser, touchup_bin, demo_folder, recorded, tmp_path):
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", "--web-links") as node:
        with_session(node, recorded, "one")
        page = page_of(browser, node, size=LANDSCAPE)
        page.get_by_role("button", name="Sessions").click()
        page.get_by_text("one", exact=True).click()
        page.get_by_role("link", name="Replay").locator("visible=true").click()
        page.get_by_text("Replay of one").wait_for()
        wait_until(page, "window.touchup !== undefined && touchup.session() === 'one#1' && touchup.tip() !== null")
        assert page.get_by_text("Nothing here acts on the session that runs, or on an arm.").is_visible()
        for name in ["Undo", "Redo", "Detect", "Save", "New session", "Report", "Hold to run", "Another device", "Approve the plan"]:
            assert page.get_by_role("button", name=name).count() == 0 or page.get_by_role("button", name=name).is_hidden(), name
        page.get_by_role("button", name="4 times").click()
        page.locator("button[aria-pressed=true]", has_text="4").wait_for()
        page.get_by_role("button", name="1 times").click()
        before = page.evaluate("touchup.version()")
        # behind the place to which it goes back
        wait_until(page, f"touchup.version() > {before} && document.querySelector('.replay-controls input').valueAsNumber > 4")
        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Continue").wait_for()
        page.screenshot(path=tmp_path / "replay.png")
        camera = page.evaluate("touchup.camera().view")
        slider = page.get_by_role("slider", name="Place in the recording")
        slider.fill("3")
        page.get_by_text("Touched again from the scan on").wait_for()
        page.screenshot(path=tmp_path / "ahead.png")
        page.get_by_text("Touched again from the scan on").wait_for(state="hidden")
        wait_until(page, "touchup.session() === 'one#2'")
        assert page.locator("output.replay-time").inner_text().startswith("0:03 / 0:2")
        assert page.evaluate("touchup.camera().view") == camera
        # a tap on the part offers nothing
        page.locator("canvas").first.click()
        assert page.get_by_role("dialog").count() == 0
        assert page.wrong == []
        page.get_by_role("link", name="To the session that runs").click()
        wait_until(page, f"window.touchup !== undefined && touchup.session() === {json.dumps(node.session.name)}")
        assert page.get_by_role("button", name="Undo").is_enabled()
        page.context.close()

        missing = page_of(browser, node, role="look")
        missing.goto(f"{node.url}/?replay=missing")
        missing.get_by_text("there is no session of this name").wait_for()
        assert missing.get_by_role("button", name="Pause").is_disabled()
        missing.screenshot(path=tmp_path / "missing.png")
        assert missing.wrong == []
        missing.context.close()
