"""Sensors, node and viewer on three computers, as in the paper, over a network that loses packets and breaks down."""

import json
import sys
import time
from pathlib import Path

from ros_domains import domains
from ros_network import Hub
from ros_process import Node, Process
from test_ros_node import scene_for, stamps

LOSS = 0.02
# longer than CycloneDDS asks others to wait for it, which is 10 s
DOWN_S = 15


class Viewer(Process):
    """tests/python/ros_viewer.py on a computer."""

    def __init__(self, domain, wrapper):
        super().__init__(sys.executable, Path(__file__).with_name("ros_viewer.py"), domain, domain=domain, wrapper=wrapper)
        self.wait_for(lambda: "ready" in self.out)

    def seen(self):
        """Its contents by now."""
        answers = len(self.out)
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        self.wait_for(lambda: len(self.out) > answers)
        return json.loads(self.out[-1])


def test_the_node_survives_losses_and_a_breakdown_and_reports_them(demo_folder, tmp_path, touchup, touchup_bin):
    domain = next(domains)
    scene = scene_for(demo_folder, tmp_path)
    with (
        Hub(["sensors", "node", "viewer"], LOSS) as hub,
        Node(touchup_bin, tmp_path, "--scene", scene, domain=domain, wrapper=hub.wrapper("node")) as node,
        Viewer(domain, hub.wrapper("viewer")) as viewer,
    ):
        recording = demo_folder / "touch.mcap"
        with Process(
            touchup_bin, "replay", recording, "--json", "--speed", 3, domain=domain, wrapper=hub.wrapper("sensors")
        ) as player:
            node.wait_for(lambda: int(viewer.seen()["values"].get("accepted", 0)) > 5000, 60)
            hub.is_down = True
            # varies its downtime
            time.sleep(DOWN_S)
            hub.is_down = False
            player.wait_for(lambda: player.process.poll() is not None or player.out, 120)
            assert player.wait() == 0, player.text()
            played = json.loads(player.out[-1])
        # it went on by itself
        states = viewer.seen()["states"]
        held = [number for number, state in enumerate(states) if "holds" in state]
        assert any("runs" in state for state in states[held[0] :]), states

        # a subscriber from the start ends with the same whole mesh as a new one
        with Viewer(domain, hub.wrapper("node")) as late:

            def both_have_all():
                time.sleep(0.5)
                tiles = late.seen()["tiles"]
                return tiles and sorted(map(int, tiles)) == list(range(len(tiles))) and tiles == viewer.seen()["tiles"]

            node.wait_for(both_have_all, 60)
        assert node.end() == 4, node.text()
        report = node.report()
    assert hub.dropped > 0

    # the node reports lost messages
    sent = played["wrenches"]
    lost = report["lost"][0]
    assert lost > 0
    taken = report["accepted"] + sum(n for reason, n in report["refused"].items() if not reason.startswith("pose_"))
    # a busy computer counts dropped messages for poses and wrenches together
    assert 0.99 * sent - report["dropped"][0] <= taken + lost <= sent
    assert any(f"{lost} wrenches lost" in line for line in node.err)
    # and the received samples give the result, as ever
    assert set(stamps(node.session / "recording", "/stylus/wrench")) <= set(stamps(recording, "/stylus/wrench"))
    done = touchup("refine", "--resume", node.session, "--out", tmp_path / "resumed.ply")
    assert done.returncode in (0, 4), done.stderr
    assert (tmp_path / "resumed.ply").read_bytes() == (node.session / "refined.ply").read_bytes()


def test_a_viewer_that_is_killed_does_not_hold_the_others_up_for_good(demo_folder, tmp_path, touchup_bin):
    domain = next(domains)
    scene = scene_for(demo_folder, tmp_path)
    with (
        Hub(["node", "killed", "viewer"], 0) as hub,
        # as many tiles as two viewers in Python take in on the cores that the node has too
        Node(
            touchup_bin, tmp_path, "--scene", scene, domain=domain, ros=["-p", "view_rate_hz:=2.0"], wrapper=hub.wrapper("node")
        ) as node,
        Viewer(domain, hub.wrapper("killed")) as killed,
        Viewer(domain, hub.wrapper("viewer")) as viewer,
    ):
        recording = demo_folder / "touch.mcap"
        node.wait_for(lambda: killed.seen()["tiles"] and viewer.seen()["tiles"], 60)
        with Process(touchup_bin, "replay", recording, "--speed", 4, domain=domain, wrapper=hub.wrapper("node")) as player:
            first = viewer.seen()["tiles"]
            node.wait_for(lambda: viewer.seen()["tiles"] != first, 60)
            killed.process.kill()
            before = viewer.seen()["tiles"]
            assert player.wait() == 0, player.text()
        # given up in the end
        with Viewer(domain, hub.wrapper("node")) as late:
            node.wait_for(lambda: late.seen()["tiles"] and late.seen()["tiles"] == viewer.seen()["tiles"] != before, 120)
        node.end()
