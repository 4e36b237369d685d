"""Probing by `touchup node` with an arm, over CycloneDDS: by the service and by the action, cancelling, and markers.

Once with the simulated arm, once with the real ur-rtde against the stand-in for a controller. The drawing of the plate gives the expected
endings.
"""

import contextlib
import itertools
import math
import os
import re
import socket
import subprocess
import time

import pytest
from conftest import ROOT
from ros_cyclone import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    CancelGoalRequest,
    CancelGoalResponse,
    FeedbackMessage,
    FlagFeatureRequest,
    FlagFeatureResponse,
    GetResultRequest,
    GetResultResponse,
    GoalInfo,
    Header,
    MarkerArray,
    Peer,
    Point,
    PointStamped,
    PoseStamped,
    ProbeFeatureRequest,
    ProbeFeatureResponse,
    ProbeResult,
    ProbeSettings,
    ProbeTouch,
    SendGoalRequest,
    SendGoalResponse,
    Time,
    TriggerRequest,
    TriggerResponse,
    WrenchStamped,
)
from ros_domains import domains
from ros_process import Node
from running import Running

HOLE, SLOT = 1, 2
# of ProbeResult
REACHED, CANCELLED, NO_SUCH_FEATURE, BUSY, NOT_READY, STOPPED_IN_PLACE = 1, 6, 22, 24, 25, 50
# of the plate of the demo, mm: centre of the through hole in its top, and its diameter; the blind one
THROUGH, BLIND = ((16.0, 36.0, 12.0), 8.0), ((32.0, 34.0, 12.0), 6.0)
CONFIGURED = ProbeSettings(0, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
DRY = ProbeSettings(0, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, True)
PLANNED = 4
# a probing takes half a minute; a longer wait is a fault
DEADLINE_S = 300


def free_address():
    """A loopback address with free ports of a controller; ur-rtde has fixed ones."""
    for number in range(2, 250):
        address = f"127.0.1.{number}"
        with contextlib.ExitStack() as sockets:
            try:
                for port in (30004, 29999, 30003):
                    sockets.enter_context(socket.socket()).bind((address, port))
            except OSError:
                continue
        return address
    raise AssertionError("no loopback address is free")


@contextlib.contextmanager
def controller():
    """The stand-in for a controller; its address. Its clock waits for the client, whose configuration must allow this."""
    address = free_address()
    command = [os.environ["TOUCHUP_UR_CONTROLLER"], address, "--start-mm", "20,30,60"]
    with Running(command) as process:
        process.wait_for(lambda: "ready" in process.out)
        yield address
        # it ends with its stdin
        process.process.stdin.close()
        process.wait()


def site_packages(program):
    """Folder of ur-rtde after `touchup ur setup`."""
    done = subprocess.run([program, "ur", "setup", ROOT / "target/tmp/ur"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().removeprefix("site_packages: ")


@contextlib.contextmanager
def running(robot, demo_folder, folder, program):
    """A running node whose arm may move."""
    scene = (ROOT / "config/probe.yaml").read_text().replace("scan.ply", str(demo_folder / "scan.ply"))
    ros = [f"robot:={robot}", "source:=probe", "allow_motion:=true", "service_mapping:=cyclone"]
    with contextlib.ExitStack() as others:
        if robot == "sim":
            ros.append(f"sim_part:={demo_folder / 'truth.ply'}")
        else:
            program, address = os.environ["TOUCHUP_UR_BIN"], others.enter_context(controller())
            named = f"robot:\n  host: {address}\n  site_packages: {site_packages(program)}\n"
            scene = scene.replace("robot:\n", named)
        path = folder / "scene.yaml"
        path.write_text(scene)
        domain = next(domains)
        parameters = [word for parameter in ros for word in ("-p", parameter)]
        environment = {"TOUCHUP_UR_LOCK_STEP": "1"}
        with Node(program, folder, "--scene", path, domain=domain, ros=parameters, environment=environment) as node:
            yield Cell(node, domain, robot)
            assert node.end() in (0, 4), node.text()
            report = node.report()
            # states of the arm take no network to the node
            assert report["lost"] == report["dropped"] == [0, 0] and report["unrecorded"] == 0, report


# the slow proofs install ur-rtde for it
ROBOTS = ["sim", "ur"] if os.environ.get("TOUCHUP_FULL") else ["sim"]


@pytest.fixture(params=ROBOTS)
def cell(request, demo_folder, tmp_path, touchup_bin):
    """A running node."""
    if request.param == "ur" and "TOUCHUP_UR_BIN" not in os.environ:
        pytest.skip("a UR arm needs touchup built with --features ur, which needs the shared library of Python")
    with running(request.param, demo_folder, tmp_path, touchup_bin) as cell:
        yield cell


# services whose requests the arm works at, one at a time
ORDERS = ("probe_feature", "probe/_action/send_goal")


class Cell:
    """The node as another one sees it."""

    def __init__(self, node, domain, robot):
        self.robot = robot
        self.node, self.peer, self.numbers = node, Peer(domain), itertools.count(1)
        self.clients = {}
        self.wait_for(lambda: self.trigger("arm_state").success)

    def wait_for(self, condition, deadline_s=DEADLINE_S):
        self.node.wait_for(condition, deadline_s)

    def ask(self, name, kinds, *fields, harmless=None):
        """Asks once. Before the first time it repeats something harmless until an answer: then both sides know each other."""
        if name not in self.clients:
            self.clients[name] = self.peer.client(f"/touchup/{name}", *kinds)
            self.repeat(self.clients[name], kinds[0], fields if harmless is None else harmless)
            if harmless is None:
                return self.found
            # the last of several repeated orders may still run
            if name in ORDERS:
                self.wait_for(lambda: "works at an order" not in self.trigger("arm_state").message)
        writer, reader = self.clients[name]
        number = next(self.numbers)
        writer.write(kinds[0](1, number, *fields))
        answers = []

        def has_come():
            answers.extend(answer for answer in reader.take(10) if answer.seq == number)
            return answers

        self.wait_for(has_come)
        return answers[0]

    def repeat(self, client, request, fields):
        writer, reader = client

        def once():
            writer.write(request(1, next(self.numbers), *fields))
            time.sleep(0.1)
            found = reader.take(10)
            self.found = found[-1] if found else None
            return found

        self.wait_for(once)

    def trigger(self, name):
        return self.ask(name, (TriggerRequest, TriggerResponse), 0)

    def flag(self, kind, place_mm):
        point = PointStamped(Header(Time(0, 0), "object"), Point(*(x / 1e3 for x in place_mm)))
        kinds = (FlagFeatureRequest, FlagFeatureResponse)
        # no radius can be negative
        answer = self.ask("flag_feature", kinds, kind, point, 3e-3, harmless=(kind, point, -1.0))
        assert answer.success, answer.message
        return answer.id

    def probe(self, number, settings=CONFIGURED):
        kinds = (ProbeFeatureRequest, ProbeFeatureResponse)
        return self.ask("probe_feature", kinds, number, settings, harmless=(999, CONFIGURED)).result

    def send_goal(self, name, ids):
        kinds = (SendGoalRequest, SendGoalResponse)
        unknown = (list(range(16)), [999], CONFIGURED)
        return self.ask("probe/_action/send_goal", kinds, name, ids, CONFIGURED, harmless=unknown).accepted

    def result(self, name):
        kinds = (GetResultRequest, GetResultResponse)
        return self.ask("probe/_action/get_result", kinds, name, harmless=([7] * 16,))

    def cancel(self, name):
        kinds, unknown = (CancelGoalRequest, CancelGoalResponse), GoalInfo([7] * 16, Time(0, 0))
        return self.ask("probe/_action/cancel_goal", kinds, GoalInfo(name, Time(0, 0)), harmless=(unknown,)).return_code


def assert_is(result, hole):
    (x, y, _), diameter = hole
    found = result.feature
    off, wide = math.hypot(found.center.x * 1e3 - x, found.center.y * 1e3 - y), found.diameter * 1e3 - diameter
    summary = f"{result.touch_count} touches, {result.duration:.0f} s, {result.max_force:.2f} N; off {off:.4f}, {wide:+.4f} mm"
    print(summary)
    assert result.code == REACHED, result.message
    assert found.status == 3 and off < 0.05 and abs(wide) < 0.05, summary
    assert result.touch_count < 40 and result.max_force < 4.5, summary


@pytest.mark.full
def test_flagged_holes_are_probed_by_service_and_action(cell):
    (x, y, z), _ = THROUGH
    through, blind = cell.flag(HOLE, (x + 1.5, y - 1.2, z)), cell.flag(HOLE, (31.0, 35.5, 12.0))
    assert cell.probe(999).code == NO_SUCH_FEATURE
    dry = cell.probe(through, DRY)
    assert dry.code == PLANNED and dry.touch_count == 0, dry.message
    assert_is(cell.probe(through), THROUGH)

    feedback = cell.peer.reader("/touchup/probe/_action/feedback", FeedbackMessage, RELIABLE)
    followed = cell.peer.reader("/probe_results", ProbeResult, RELIABLE)
    touches = cell.peer.reader("/probe_touches", ProbeTouch, RELIABLE)
    name = [20] * 16
    assert cell.send_goal(name, [blind])
    ended = cell.result(name)
    assert (ended.ids, ended.codes) == ([blind], [ended.code])
    found = []

    def is_reported():
        found.extend(result for result in followed.take(10) if result.id == blind)
        return found

    cell.wait_for(is_reported)
    assert_is(found[0], BLIND)
    received = []

    def are_reported():
        received.extend(touch for touch in touches.take(100) if touch.id == blind)
        return len(received) >= found[0].touch_count

    cell.wait_for(are_reported)
    assert [touch.index for touch in received] == list(range(found[0].touch_count))
    messages = [message for message in feedback.take(1000) if list(message.goal_id) == name]
    assert len({message.touch for message in messages}) > 5 and {message.id for message in messages} == {blind}
    assert all(message.feature_count == 1 and message.touch <= message.touch_count for message in messages)
    # the target is +- 0.02 mm at 95 %
    assert messages[-1].uncertainty < 0.0103e-3, messages[-1]
    everything = cell.trigger("probe_all")
    assert not everything.success and "nothing is flagged" in everything.message

    shown = cell.peer.reader("/feature_markers", MarkerArray, LATCHED)
    diameters = []

    def is_shown():
        texts = [marker.text for array in shown.take(10) for marker in array.markers]
        diameters.extend(float(number) for text in texts for number in re.findall(r"Ø([0-9.]+)", text))
        return all(any(abs(shown - diameter) < 0.05 for shown in diameters) for diameter in (8.0, 6.0))

    cell.wait_for(is_shown)


def test_others_see_the_states_of_the_arm_as_pairs_of_pose_and_wrench(cell):
    kinds = {"pose": PoseStamped, "wrench": WrenchStamped}
    readers = {name: cell.peer.reader(f"/probe/{name}", kind, BEST_EFFORT) for name, kind in kinds.items()}
    headers = {name: {} for name in kinds}

    def are_seen():
        for name, reader in readers.items():
            messages = [message.header for message in reader.take(1000)]
            headers[name].update(((header.stamp.sec, header.stamp.nanosec), header.frame_id) for header in messages)
        return len(headers["pose"].keys() & headers["wrench"].keys()) > 100

    cell.wait_for(are_seen)
    assert {*headers["pose"].values(), *headers["wrench"].values()} == {"cell", "probe"}


def has_touched(cell, feedback, name, least):
    """Waits until a goal has come to its so many-th touch."""
    messages = []

    def has_come():
        messages.extend(message for message in feedback.take(100) if list(message.goal_id) == name)
        return any(message.touch >= least for message in messages)

    cell.wait_for(has_come)


def test_a_cancelled_goal_stops_the_next_is_taken_up_and_after_a_stop_nothing_is_until_the_arm_is_recovered(cell):
    (x, y, z), _ = THROUGH
    through, blind = cell.flag(HOLE, (x + 0.5, y, z)), cell.flag(HOLE, (32.0, 33.0, 12.0))
    dry = cell.probe(through, DRY)
    assert dry.code == PLANNED and dry.touch_count == 0, dry.message
    feedback = cell.peer.reader("/touchup/probe/_action/feedback", FeedbackMessage, RELIABLE)
    name = [40] * 16
    assert cell.cancel([41] * 16) == 2, "this goal is unknown"
    # both sides know each other before any motion: recovering an arm without a stop changes nothing. The first call repeats until its
    # answer, and may find the arm at work at the one before
    cell.wait_for(lambda: cell.trigger("recover").success)
    assert cell.send_goal(name, [through, blind])
    has_touched(cell, feedback, name, 3)
    assert cell.probe(blind).code == BUSY
    assert "works at an order" in cell.trigger("arm_state").message
    assert cell.cancel(name) == 0
    response = cell.result(name)
    assert (response.status, response.code, response.ids) == (5, CANCELLED, [through]), response.message
    assert cell.trigger("arm_state").success

    name = [60] * 16
    assert cell.send_goal(name, [through])
    has_touched(cell, feedback, name, 1)
    stopped = cell.trigger("stop")
    assert stopped.success, stopped.message
    response = cell.result(name)
    assert (response.code, response.ids) == (STOPPED_IN_PLACE, [through]), response.message
    assert "~/stop was called" in response.message, response.message
    assert not cell.trigger("arm_state").success
    assert cell.probe(through).code == NOT_READY
    assert cell.trigger("recover").success
    assert cell.trigger("arm_state").success
