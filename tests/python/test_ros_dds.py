"""The port on DDS against CycloneDDS: what ROS 2 nodes with rmw_cyclonedds put on the wire.

The other end is the example ros_echo: wrench in, mismatch out, tiles latched, calls answered.
"""

import itertools
import time

import pytest
from ros_cyclone import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    CancelGoalRequest,
    CancelGoalResponse,
    Clock,
    FeedbackMessage,
    GetParametersRequest,
    GetParametersResponse,
    GetResultRequest,
    GetResultResponse,
    GoalInfo,
    HapticMismatch,
    Header,
    HeaderAlone,
    Marker,
    Parameter,
    Peer,
    Point,
    Pose,
    PoseStamped,
    ProbeSettings,
    Quaternion,
    SendGoalRequest,
    SendGoalResponse,
    SetParametersRequest,
    SetParametersResponse,
    Time,
    UndoRequest,
    UndoResponse,
    Vector3,
    Wrench,
    WrenchStamped,
    parameter_value,
)
from ros_echo import Echo, domains

@pytest.fixture
def domain():
    return next(domains)


def wrench(number):
    force, torque = Vector3(1.5, -2.5, number + 0.25), Vector3(0.1, 0.2, 0.3)
    return WrenchStamped(Header(Time(number, 500), "sensor"), Wrench(force, torque))


def until_answered(echo, write, take):
    """Sends again until something comes back: the first messages go before both sides know each other."""
    found = []

    def once():
        write()
        time.sleep(0.05)
        found.extend(take() or [])
        return found

    echo.wait_for(once)
    return found


def call(echo, client, request):
    """Asks until it is answered: a first answer may go before its reader is matched."""
    writer, reader = client
    numbers = itertools.count(1)

    def ask():
        request.seq = next(numbers)
        writer.write(request)

    return until_answered(echo, ask, lambda: reader.take(10))[0]


def test_a_wrench_comes_back_as_mismatch(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        writer = peer.writer("/stylus/wrench", WrenchStamped, BEST_EFFORT)
        reader = peer.reader("/mismatch", HapticMismatch, BEST_EFFORT)
        numbers = itertools.count(7)
        back = until_answered(echo, lambda: writer.write(wrench(next(numbers))), lambda: reader.take(10))[0]
        sent = wrench(back.header.stamp.sec)
        assert back.header == sent.header and back.actual_force == sent.wrench.force


def test_a_pose_arrives_with_every_field(domain):
    with Echo(domain) as echo:
        writer = Peer(domain).writer("/stylus/pose", PoseStamped, BEST_EFFORT)
        pose = Pose(Point(1.5, 2.5, 3.5), Quaternion(0.1, 0.2, 0.3, 0.9))
        sent = PoseStamped(Header(Time(-3, 999_999_999), "tracker"), pose)
        until_answered(echo, lambda: writer.write(sent), lambda: echo.has("Pose(") and [1])
        assert echo.has("sec: -3, nanosec: 999999999", '"tracker"', "x: 1.5, y: 2.5, z: 3.5", "y: 0.2, z: 0.3, w: 0.9")


def test_names_are_remapped(domain):
    with Echo(domain, "--ros-args", "-r", "__ns:=/bench", "-r", "stylus/wrench:=/ft/wrench") as echo:
        peer = Peer(domain)
        writer = peer.writer("/ft/wrench", WrenchStamped, BEST_EFFORT)
        reader = peer.reader("/bench/mismatch", HapticMismatch, BEST_EFFORT)
        assert until_answered(echo, lambda: writer.write(wrench(1)), lambda: reader.take(10))


def test_another_domain_is_not_seen(domain):
    with Echo(domain) as echo:
        writer = Peer(next(domains)).writer("/stylus/wrench", WrenchStamped, BEST_EFFORT)
        reader = Peer(domain).reader("/mismatch", HapticMismatch, BEST_EFFORT)
        echo.wait_for(lambda: echo.has("Matched", "/mismatch", "count: 1"))
        for _ in range(20):
            writer.write(wrench(1))
            time.sleep(0.05)
        assert not reader.take(10)


def test_who_comes_late_gets_every_tile(domain):
    tiles = 200
    with Echo(domain, str(tiles)) as echo:
        time.sleep(1)
        reader = Peer(domain).reader("/mesh", Marker, LATCHED)
        got = {}

        def all_there():
            got.update((marker.id, marker) for marker in reader.take(100))
            return len(got) == tiles

        echo.wait_for(all_there)
        for number, marker in got.items():
            assert (marker.ns, marker.type, len(marker.points), len(marker.colors)) == ("mesh", 11, 1500, 1500)
            assert all(point.y == number for point in marker.points)
            assert [point.x for point in marker.points] == list(range(1500))


def test_a_service_answers_in_the_mapping_of_cyclone(domain):
    with Echo(domain, "--ros-args", "-p", "service_mapping:=cyclone") as echo:
        client = Peer(domain).client("/touchup/undo", UndoRequest, UndoResponse)
        # the last in fragments
        for strokes in [1, 42, 12_000]:
            answer = call(echo, client, UndoRequest(0x1122334455667788, 0, strokes))
            assert (answer.guid, answer.success, answer.message) == (0x1122334455667788, True, "echo" * strokes)
            assert (answer.strokes, answer.mesh_version) == (strokes, 1 << 40)
            # those that were asked for again
            time.sleep(0.5)
            client[1].take(100)


def test_parameters_are_read_and_set_and_refused(domain):
    with Echo(domain, "--ros-args", "-p", "service_mapping:=cyclone", "-p", "view_rate_hz:=12.5") as echo:
        peer = Peer(domain)
        getter = peer.client("/touchup/get_parameters", GetParametersRequest, GetParametersResponse)
        setter = peer.client("/touchup/set_parameters", SetParametersRequest, SetParametersResponse)
        names = ["view_rate_hz", "robot", "allow_motion", "nonsense"]
        values = call(echo, getter, GetParametersRequest(1, 0, names)).values
        assert [value.type for value in values] == [3, 4, 1, 0]
        assert (values[0].double_value, values[1].string_value) == (12.5, "none")

        wanted = [("view_rate_hz", 30.0), ("view_rate_hz", 1000.0), ("robot", "ur"), ("view_rat_hz", 1.0)]
        request = SetParametersRequest(1, 0, [Parameter(name, parameter_value(value)) for name, value in wanted])
        results = call(echo, setter, request).results
        assert [result.successful for result in results] == [True, False, False, False]
        assert results[1].reason == "view_rate_hz is 1000.0: it may be 0.1 to 100"
        assert results[2].reason == "robot cannot be set while the node runs: start it again with -p robot:=ur"
        assert results[3].reason == 'there is no parameter "view_rat_hz": did you mean "view_rate_hz"?'
        assert call(echo, getter, GetParametersRequest(1, 0, ["view_rate_hz"])).values[0].double_value == 30.0


def test_the_wrong_mapping_is_told(domain):
    with Echo(domain) as echo:
        client = Peer(domain).client("/touchup/undo", UndoRequest, UndoResponse)
        echo.wait_for(lambda: echo.has("WARN", "/touchup/undo", "-p service_mapping:=cyclone"))
        assert client


def test_a_listener_that_wants_more_is_told(domain):
    with Echo(domain) as echo:
        reader = Peer(domain).reader("/mismatch", HapticMismatch, RELIABLE)
        echo.wait_for(lambda: echo.has("WARN", "/mismatch", "it wants reliable, offered is best effort"))
        echo.wait_for(lambda: echo.has("Matched", "/mismatch", "it wants reliable, offered is best effort"))
        assert reader


def test_another_type_on_our_topic_is_told(domain):
    with Echo(domain) as echo:
        writer = Peer(domain).writer("/stylus/wrench", PoseStamped, BEST_EFFORT)
        echo.wait_for(lambda: echo.has("WARN", "/stylus/wrench", "PoseStamped_", "here it is", "WrenchStamped_"))
        assert writer


def test_it_is_counted_when_a_listener_comes_and_goes(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        reader = peer.reader("/mesh", Marker, LATCHED)
        echo.wait_for(lambda: echo.has("Matched", '"/mesh"', "count: 1"))
        del reader, peer
        echo.wait_for(lambda: echo.has("Matched", '"/mesh"', "count: 0"))


def test_a_message_that_cannot_be_read_is_told_and_the_next_is_taken(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        short = peer.writer("/stylus/wrench", HeaderAlone, BEST_EFFORT)
        header = Header(Time(1, 2), "sensor")
        told = ("Unreadable", '"stylus/wrench"')
        until_answered(echo, lambda: short.write(HeaderAlone(header)), lambda: echo.has(*told) and [1])
        writer = peer.writer("/stylus/pose", PoseStamped, BEST_EFFORT)
        pose = PoseStamped(header, Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1)))
        until_answered(echo, lambda: writer.write(pose), lambda: echo.has("Pose(") and [1])


def test_an_action_is_taken_up_goes_on_and_ends(domain):
    with Echo(domain, "--ros-args", "-p", "service_mapping:=cyclone") as echo:
        peer, action = Peer(domain), "/touchup/probe/_action"
        send_goal = peer.client(f"{action}/send_goal", SendGoalRequest, SendGoalResponse)
        get_result = peer.client(f"{action}/get_result", GetResultRequest, GetResultResponse)
        cancel_goal = peer.client(f"{action}/cancel_goal", CancelGoalRequest, CancelGoalResponse)
        feedback = peer.reader(f"{action}/feedback", FeedbackMessage, RELIABLE)
        # until the services are matched: nobody knows this goal
        unknown, done = list(range(16)), list(range(16, 32))
        assert call(echo, get_result, GetResultRequest(1, 0, unknown)).status == 0
        assert call(echo, cancel_goal, CancelGoalRequest(1, 0, GoalInfo(unknown, Time(0, 0)))).return_code == 2

        settings = ProbeSettings(1, 0.1, 0.95, 0, 9, 60.0, 2.0, 0.01, 0.1, 0.02, True)
        # a goal without features is refused by the echo, and may be sent again
        assert not call(echo, send_goal, SendGoalRequest(1, 0, done, [], settings)).accepted
        accepted = call(echo, send_goal, SendGoalRequest(1, 0, done, [7, 8], settings))
        assert accepted.accepted and accepted.stamp.sec > 1_700_000_000
        result = call(echo, get_result, GetResultRequest(1, 0, done))
        assert (result.status, result.code, result.results) == (4, 4, [])
        got = feedback.take(10)
        assert [(list(message.goal_id), message.touch) for message in got] == [(done, 0), (done, 1), (done, 2)]
        assert call(echo, cancel_goal, CancelGoalRequest(1, 0, GoalInfo(done, Time(0, 0)))).return_code == 3


def test_the_clock_of_a_simulation_arrives(domain):
    with Echo(domain, "--ros-args", "-p", "use_sim_time:=true") as echo:
        writer = Peer(domain).writer("/clock", Clock, BEST_EFFORT)
        until_answered(echo, lambda: writer.write(Clock(Time(12, 34))), lambda: echo.has("Clock(") and [1])
        assert echo.has("sec: 12, nanosec: 34")
