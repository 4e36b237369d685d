"""An arm moves for the page only during a hold of its button: the beats of a socket, and the button in a browser. The arm is simulated."""

import json
import re
import threading
import time

import numpy
import pytest
from browser import opened
from conftest import ROOT
from running import DEADLINE_S
from web_page import PageNode, Socket

# of Feature and ProbeResult
HOLE, PLANNED, ARM_NOT_READY, STOPPED_IN_PLACE = 1, 4, 25, 50
# of the plate of the demo, m: the through hole in its top
THROUGH = {"x": 0.016, "y": 0.036, "z": 0.012}
# within this time after the last beat the arm stands
STANDS_WITHIN_S = 0.2
# as the page does
BEAT_S = 0.02
# between two markers a tip at rest seems to move by less than this: the noise of the simulated arm
NOISE_M = 100e-6
# with which it brakes, m/s²
BRAKING = 5.0


@pytest.fixture
def node(touchup_bin, demo_folder, tmp_path):
    """A node with a simulated arm that may move."""
    scene = tmp_path / "scene.yaml"
    scene.write_text((ROOT / "config/probe.yaml").read_text().replace("scan.ply", str(demo_folder / "scan.ply")))
    words = ["robot:=sim", "source:=probe", "allow_motion:=true", f"sim_part:={demo_folder / 'truth.ply'}"]
    ros = [word for parameter in words for word in ("-p", parameter)]
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", "--scene", scene, ros=ros) as node:
        yield node


class Beats:
    """The beats of a held button, from a thread of their own."""

    def __init__(self, page):
        self.page, self.is_held, self.last = page, True, 0.0
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while self.is_held:
            self.page.beat()
            self.last = time.time()
            time.sleep(BEAT_S)

    def let_go(self):
        self.is_held = False
        self.thread.join()
        return self.last


def flagged(page):
    """The number of the hole, once the arm is ready."""
    page.take_until(lambda: page.call("~/arm_state")["response"]["success"])
    answer = page.call("~/flag_feature", kind=HOLE, point={"header": {"frame_id": "object"}, "point": THROUGH})
    return answer["response"]["id"]


def arm_of(node, condition):
    """Waits until the arm is so."""
    with Socket(node.url) as watching:
        watching.take_until(lambda: condition(watching.newest.get("state", {"arm": {"motion": "", "stays_because": ""}})["arm"]))


def order(node, hole, beats_s=0.0, moves=None):
    """Orders a probing by held beats, and lets go after some time (from the arm's motion on, if that is an event), or at its end; returns
    the time of that, and the result of the order.

    By a page of its own, which reads all arrivals and looks at its answer alone, so that no beat is late.
    """
    with Socket(node.url) as page:
        beats = Beats(page)
        time.sleep(0.1)
        page.socket.send('{"id": "order", "call": "~/probe_feature", "request": {"id": %d}}' % hole)
        begun, answer = time.monotonic(), None
        while moves and not moves.is_set() and not answer and time.monotonic() < begun + DEADLINE_S:
            answer = answer_until(page, time.monotonic() + BEAT_S)
        answer = answer or answer_until(page, time.monotonic() + beats_s)
        let_go = beats.let_go()
        answer = answer or answer_until(page, time.monotonic() + DEADLINE_S)
        return let_go, answer["response"]["result"]


def answer_until(page, until):
    """The answer of an order; `None`: none has come."""
    while (left := until - time.monotonic()) > 0:
        try:
            message = page.socket.recv(left)
        except TimeoutError:
            return None
        if isinstance(message, str) and '"order"' in message and (said := json.loads(message)).get("id") == "order":
            return said
    return None


def test_an_order_is_taken_while_the_button_is_held_and_the_arm_stays_when_it_is_let_go_until_it_is_recovered(node):
    with Socket(node.url) as page:
        hole = flagged(page)
        planned = page.call("~/probe_feature", id=hole, settings={"dry_run": True})
        assert planned["response"]["result"]["code"] == PLANNED
        page.take_until(lambda: page.newest.get("path", {}).get("poses"))
        assert "while the button is held" in page.call("~/probe_feature", id=hole)["error"]
        assert "while the button is held" in page.call("~/probe_all")["error"]
        _, result = order(node, hole)
        assert result["code"] == STOPPED_IN_PLACE and "let go" in result["message"], result
        page.take_until(lambda: page.newest["state"]["arm"]["stays_because"])
        # nothing moves by beats alone
        _, refused = order(node, hole)
        assert refused["code"] == ARM_NOT_READY and "~/recover" in refused["message"], refused
        assert page.call("~/recover")["response"]["success"]
        page.take_until(lambda: not page.newest["state"]["arm"]["stays_because"])


@pytest.mark.full
def test_the_arm_stands_within_200_ms_of_the_last_beat_and_probes_to_the_end_while_the_button_is_held(node):
    with Socket(node.url) as page:
        hole = flagged(page)
    places, until, moves = [], [float("inf")], threading.Event()

    def watch():
        with Socket(node.url) as watching:
            while time.monotonic() < until[0]:
                watching.take()
                for marker in watching.newest.get("tip", {}).get("markers", [])[:1]:
                    place = marker["pose"]["position"]
                    stamp = marker["header"]["stamp"]
                    at = stamp["sec"] + 1e-9 * stamp["nanosec"]
                    places.append((at, numpy.array([place["x"], place["y"], place["z"]]), time.time()))
                    if len(places) > 1 and numpy.linalg.norm(places[-1][1] - places[-2][1]) > NOISE_M:
                        moves.set()

    watcher = threading.Thread(target=watch)
    watcher.start()
    # on its way through free air
    let_go, result = order(node, hole, moves=moves)
    until[0] = time.monotonic() + 2
    watcher.join()
    assert result["code"] == STOPPED_IN_PLACE
    stands = stood_at(places) - let_go
    print(f"The arm stood {1e3 * stands:.0f} ms after the last beat, by its stamps and how far it went since a marker.")
    # before the last beat: one before it was late, and the arm stopped for that
    assert 0.0 < stands < STANDS_WITHIN_S, stands
    recover(node)
    _, done = order(node, hole, beats_s=120.0)
    assert done["code"] in (1, 2) and abs(done["feature"]["diameter"] - 8e-3) < 50e-6, done


@pytest.mark.full
def test_an_arm_that_was_stopped_among_its_touches_goes_out_by_the_way_that_it_came(node):
    with Socket(node.url) as page:
        hole = flagged(page)
    _, result = order(node, hole, beats_s=12.0)
    assert result["code"] == STOPPED_IN_PLACE and result["touch_count"] > 2, result
    recover(node)
    with Socket(node.url) as page:
        planned = page.call("~/probe_feature", id=hole, settings={"dry_run": True})["response"]["result"]
        assert planned["code"] == PLANNED, planned
    _, result = order(node, hole, beats_s=20.0)
    assert result["touch_count"] > 0, result


def stood_at(places):
    """Time at which a tip on a straight path stood, by its places with their stamps and times of sight: after the last of them with motion
    it went on at the same speed, and then braked. A simulated arm on a busy machine is behind real time by no more than the least time from
    a stamp to its sight.
    """
    places = [places[0], *(now for now, before in zip(places[1:], places) if now[0] > before[0])]
    steps = [(now[0] - before[0], numpy.linalg.norm(now[1] - before[1])) for now, before in zip(places[1:], places)]
    last = max(number for number, (_, way) in enumerate(steps) if way > NOISE_M)
    speed = max(way / span for span, way in steps[last - 3 : last])
    assert speed > 0.02, "it was on its way through free air"
    behind = min(seen - at for at, _, seen in places[last - 3 : last + 2])
    # braking takes v / a and half the way that this time takes at full speed
    span, way = steps[last]
    return places[last][0] + behind + min(way / speed + speed / (2 * BRAKING), span + speed / BRAKING)


def recover(node):
    with Socket(node.url) as page:
        assert page.call("~/recover")["response"]["success"]


def test_a_button_in_the_page_moves_the_arm_while_it_is_held(browser, node):
    with Socket(node.url) as flagging:
        hole = flagged(flagging)
    page = opened(browser, node.url)
    page.locator("button.feature", has=page.locator(".number", has_text=re.compile(f"^{hole}$"))).click()
    page.get_by_role("button", name="Show the plan").click()
    page.get_by_role("button", name="Approve the plan").click(timeout=120_000)
    button = page.get_by_role("button", name="Hold to run")
    button.scroll_into_view_if_needed()
    button.hover()
    page.mouse.down()
    arm_of(node, lambda arm: arm["motion"] != "rests" or arm["stays_because"])
    page.mouse.up()
    arm_of(node, lambda arm: "let go" in (arm["stays_because"] or ""))
    assert page.get_by_text("not an emergency stop").first.is_visible()
    page.get_by_role("button", name="let it move again").click()
    arm_of(node, lambda arm: not arm["stays_because"])
    assert page.wrong == []
    page.context.close()
