"""The port on DDS against CycloneDDS, which puts the bytes of ROS 2 nodes with rmw_cyclonedds on the wire.

The other end is the example ros_echo: wrench in, mismatch out, tiles latched, calls answered.
"""

import itertools
import time

import pytest
from cyclonedds.pub import DataWriter
from ros_cyclone import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    CancelGoalRequest,
    CancelGoalResponse,
    Clock,
    DescribeParametersRequest,
    DescribeParametersResponse,
    DetectFeaturesRequest,
    DetectFeaturesResponse,
    FeatureArray,
    FeedbackMessage,
    GetParametersRequest,
    GetParametersResponse,
    GetParameterTypesRequest,
    GetParameterTypesResponse,
    GetResultRequest,
    GetResultResponse,
    GoalInfo,
    HapticMismatch,
    Header,
    HeaderAlone,
    ListParametersRequest,
    ListParametersResponse,
    Marker,
    Parameter,
    Peer,
    Point,
    Pose,
    PoseStamped,
    ProbeFeatureRequest,
    ProbeFeatureResponse,
    ProbeResult,
    ProbeSettings,
    ProbeTouch,
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
from ros_domains import domains
from ros_echo import Echo
from ros_tables import code, table

CALLER = 0x1122334455667788
# a lost answer is long overdue then
AGAIN_S = 2.0
SETTINGS = ProbeSettings(1, 0.1, 0.95, 0, 9, 60.0, 2.0, 0.01, 0.1, 0.02, True)
CYCLONE = ("--ros-args", "-p", "service_mapping:=cyclone")


@pytest.fixture
def domain():
    return next(domains)


def wrench(number):
    force, torque = Vector3(1.5, -2.5, number + 0.25), Vector3(0.1, 0.2, 0.3)
    return WrenchStamped(Header(Time(number, 500), "sensor"), Wrench(force, torque))


def meet(echo, topic, ours):
    """Waits until both sides know each other: our reader or writer, and the one of the node."""
    matched = ours.get_matched_subscriptions if isinstance(ours, DataWriter) else ours.get_matched_publications
    echo.wait_for(matched)
    echo.wait_for(lambda: echo.has("Matched", f'"{topic}"', "count: 1"))
    return ours


def next_of(echo, reader):
    """The next message that comes."""
    found = []
    echo.wait_for(lambda: found.extend(reader.take(1)) or found)
    return found[0]


class Client:
    """Calls a service: the first time until an answer, then once.

    A reader that knows a writer without a heartbeat takes anything before the first one for older than itself: if that answer is lost, no
    other comes.
    """

    def __init__(self, echo, peer, name, request, response):
        self.echo, self.request, self.calls = echo, request, 0
        self.writer, self.reader = peer.client(name, request, response)
        echo.wait_for(lambda: self.writer.get_matched_subscriptions() and self.reader.get_matched_publications())
        for what in ("a caller is heard", "a caller can be answered"):
            echo.wait_for(lambda what=what: echo.has(what, f'"{name}"'))

    def __call__(self, *fields):
        self.calls += 1
        asked, answers = 0.0, []

        def is_answered():
            nonlocal asked
            if not asked or (self.calls == 1 and time.monotonic() > asked + AGAIN_S):
                asked = time.monotonic()
                self.writer.write(self.request(CALLER, self.calls, *fields))
            # the first one may have several answers
            answers.extend(answer for answer in self.reader.take(10) if answer.seq == self.calls)
            return answers

        self.echo.wait_for(is_answered)
        assert answers[0].guid == CALLER
        return answers[0]


def test_a_wrench_comes_back_as_mismatch(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        writer = meet(echo, "/stylus/wrench", peer.writer("/stylus/wrench", WrenchStamped, BEST_EFFORT))
        reader = meet(echo, "/mismatch", peer.reader("/mismatch", HapticMismatch, BEST_EFFORT))
        writer.write(wrench(7))
        back = next_of(echo, reader)
        assert back.header == wrench(7).header and back.actual_force == wrench(7).wrench.force


def test_a_pose_arrives_with_every_field(domain):
    with Echo(domain) as echo:
        writer = meet(echo, "/stylus/pose", Peer(domain).writer("/stylus/pose", PoseStamped, BEST_EFFORT))
        pose = Pose(Point(1.5, 2.5, 3.5), Quaternion(0.5, -0.5, 0.5, 0.5))
        writer.write(PoseStamped(Header(Time(-3, 999_999_999), "tracker"), pose))
        echo.wait_for(lambda: echo.has("Pose("))
        assert echo.has("stamp_ns: -2000000001", '"tracker"', "[1.5, 2.5, 3.5]", "[0.5, -0.5, 0.5, 0.5]")


def test_a_pose_that_is_no_rotation_is_refused_by_its_reason(domain):
    with Echo(domain) as echo:
        writer = meet(echo, "/stylus/pose", Peer(domain).writer("/stylus/pose", PoseStamped, BEST_EFFORT))
        writer.write(PoseStamped(Header(Time(3, 0), "tracker"), Pose(Point(1.5, 2.5, 3.5), Quaternion(0.1, 0.2, 0.3, 0.9))))
        echo.wait_for(lambda: echo.has("Refused(0", "quaternion"))


def test_names_are_remapped(domain):
    with Echo(domain, "--ros-args", "-r", "__ns:=/bench", "-r", "stylus/wrench:=/ft/wrench") as echo:
        peer = Peer(domain)
        writer = meet(echo, "/ft/wrench", peer.writer("/ft/wrench", WrenchStamped, BEST_EFFORT))
        reader = meet(echo, "/bench/mismatch", peer.reader("/bench/mismatch", HapticMismatch, BEST_EFFORT))
        writer.write(wrench(1))
        assert next_of(echo, reader).header == wrench(1).header


def test_another_domain_is_not_seen(domain):
    other = next(domains)
    with Echo(domain) as echo, Echo(other) as elsewhere:
        foreign = meet(elsewhere, "/stylus/wrench", Peer(other).writer("/stylus/wrench", WrenchStamped, BEST_EFFORT))
        peer = Peer(domain)
        writer = meet(echo, "/stylus/wrench", peer.writer("/stylus/wrench", WrenchStamped, BEST_EFFORT))
        reader = meet(echo, "/mismatch", peer.reader("/mismatch", HapticMismatch, BEST_EFFORT))
        foreign.write(wrench(1))
        writer.write(wrench(2))
        assert next_of(echo, reader).header == wrench(2).header


def test_who_comes_late_gets_every_tile(domain):
    tiles = 200
    with Echo(domain, str(tiles)) as echo:
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
    """For an answer of any size: the last is in fragments."""
    with Echo(domain, *CYCLONE) as echo:
        undo = Client(echo, Peer(domain), "/touchup/undo", UndoRequest, UndoResponse)
        for strokes in [1, 42, 12_000]:
            answer = undo(strokes)
            assert (answer.success, answer.message) == (True, "echo" * strokes)
            assert (answer.strokes, answer.mesh_version) == (strokes, 1 << 40)
        assert not echo.has("does not fit")


def test_parameters_are_read_and_set_and_refused(domain):
    with Echo(domain, *CYCLONE, "-p", "view_rate_hz:=12.5") as echo:
        peer = Peer(domain)
        get = Client(echo, peer, "/touchup/get_parameters", GetParametersRequest, GetParametersResponse)
        set_them = Client(echo, peer, "/touchup/set_parameters", SetParametersRequest, SetParametersResponse)
        values = get(["view_rate_hz", "robot", "allow_motion", "nonsense"]).values
        assert [value.type for value in values] == [3, 4, 1, 0]
        assert (values[0].double_value, values[1].string_value) == (12.5, "none")

        wanted = [("view_rate_hz", 30.0), ("view_rate_hz", 1000.0), ("robot", "ur"), ("view_rat_hz", 1.0)]
        results = set_them([Parameter(name, parameter_value(value)) for name, value in wanted]).results
        assert [result.successful for result in results] == [True, False, False, False]
        assert results[1].reason == "view_rate_hz is 1000.0: it may be 0.1 to 100"
        assert results[2].reason == "robot cannot be set while the node runs: start it again with -p robot:=ur"
        assert results[3].reason == 'there is no parameter "view_rat_hz": did you mean "view_rate_hz"?'
        assert get(["view_rate_hz"]).values[0].double_value == 30.0


def test_all_parameters_are_listed_dumped_and_described_whole(domain):
    """As `ros2 param list`, `dump` and `describe` ask, of all at once, for answers of any length."""
    rows = {code(row["name"])[0]: row for row in table("name", "type", "default")}
    path = "/a/folder/" * 200 + "part.ply"
    with Echo(domain, *CYCLONE, "-p", f"scan:={path}") as echo:
        peer = Peer(domain)
        names = Client(echo, peer, "/touchup/list_parameters", ListParametersRequest, ListParametersResponse)([], 0).result.names
        assert set(names) == {*rows, "use_sim_time"}
        types = Client(echo, peer, "/touchup/get_parameter_types", GetParameterTypesRequest, GetParameterTypesResponse)
        kinds = {"bool": 1, "double": 3, "string": 4}
        assert dict(zip(names, types(names).types, strict=True)) == {
            **{name: kinds[row["type"]] for name, row in rows.items()},
            "use_sim_time": 1,
        }
        get = Client(echo, peer, "/touchup/get_parameters", GetParametersRequest, GetParametersResponse)
        assert dict(zip(names, get(names).values, strict=True))["scan"].string_value == path
        assert [value.type for value in get(["nonsense"] * 500).values] == [0] * 500
        describe = Client(echo, peer, "/touchup/describe_parameters", DescribeParametersRequest, DescribeParametersResponse)
        described = {one.name: one for one in describe(names).descriptors}
        for name, row in rows.items():
            assert described[name].description == row["what"].replace("`", ""), name
            assert described[name].read_only == (row["live"] == "no"), name
        rate = described["view_rate_hz"].floating_point_range[0]
        assert (rate.from_value, rate.to_value) == (0.1, 100.0)
        assert not echo.has("does not fit")


def test_features_are_on_the_topic_that_the_answer_names(domain):
    with Echo(domain, *CYCLONE) as echo:
        peer = Peer(domain)
        features = meet(echo, "/features", peer.reader("/features", FeatureArray, LATCHED))
        detect = Client(echo, peer, "/touchup/detect_features", DetectFeaturesRequest, DetectFeaturesResponse)
        answer = detect([])
        assert (answer.success, answer.message, answer.count, answer.ids) == (True, "300 slots", 300, list(range(128)))
        published = next_of(echo, features)
        assert published.mesh_version >= answer.mesh_version
        assert [feature.id for feature in published.features] == list(range(answer.count))


def test_what_was_probed_is_on_topics_touch_by_touch(domain):
    with Echo(domain, *CYCLONE) as echo:
        peer = Peer(domain)
        results = meet(echo, "/probe_results", peer.reader("/probe_results", ProbeResult, RELIABLE))
        touches = meet(echo, "/probe_touches", peer.reader("/probe_touches", ProbeTouch, RELIABLE))
        probe = Client(echo, peer, "/touchup/probe_feature", ProbeFeatureRequest, ProbeFeatureResponse)
        result = probe(9, SETTINGS).result
        assert (result.id, result.touch_count, len(result.feature.points)) == (9, 20, 2)
        # NaN is in it
        assert str(next_of(echo, results)) == str(result)
        received = [next_of(echo, touches) for _ in range(result.touch_count)]
        assert [(touch.id, touch.index) for touch in received] == [(9, index) for index in range(20)]
        assert all(len(touch.curve_time) == len(touch.curve_lateral_force) == 2000 for touch in received)


def test_the_wrong_mapping_is_reported(domain):
    with Echo(domain) as echo:
        client = Peer(domain).client("/touchup/undo", UndoRequest, UndoResponse)
        echo.wait_for(lambda: echo.has("WARN", "/touchup/undo", "-p service_mapping:=cyclone"))
        assert client


def test_an_incompatible_subscriber_is_reported(domain):
    with Echo(domain) as echo:
        reader = Peer(domain).reader("/mismatch", HapticMismatch, RELIABLE)
        echo.wait_for(lambda: echo.has("WARN", "/mismatch", "it wants reliable, offered is best effort"))
        echo.wait_for(lambda: echo.has("Matched", "/mismatch", "it wants reliable, offered is best effort"))
        assert reader


def test_another_type_on_our_topic_is_reported(domain):
    with Echo(domain) as echo:
        writer = Peer(domain).writer("/stylus/wrench", PoseStamped, BEST_EFFORT)
        echo.wait_for(lambda: echo.has("WARN", "/stylus/wrench", "publishes geometry_msgs/msg/PoseStamped, not geometry_msgs/msg/WrenchStamped"))
        assert writer


def test_it_is_counted_when_a_listener_comes_and_goes(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        reader = peer.reader("/mesh", Marker, LATCHED)
        echo.wait_for(lambda: echo.has("Matched", '"/mesh"', "count: 1"))
        del reader, peer
        echo.wait_for(lambda: echo.has("Matched", '"/mesh"', "count: 0"))


def test_an_unreadable_message_is_reported_and_the_next_is_taken(domain):
    with Echo(domain) as echo:
        peer = Peer(domain)
        short = meet(echo, "/stylus/wrench", peer.writer("/stylus/wrench", HeaderAlone, BEST_EFFORT))
        header = Header(Time(1, 2), "sensor")
        short.write(HeaderAlone(header))
        echo.wait_for(lambda: echo.has("Unreadable", '"stylus/wrench"'))
        writer = meet(echo, "/stylus/pose", peer.writer("/stylus/pose", PoseStamped, BEST_EFFORT))
        writer.write(PoseStamped(header, Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1))))
        echo.wait_for(lambda: echo.has("Pose("))


def test_an_action_is_taken_up_goes_on_and_ends(domain):
    with Echo(domain, *CYCLONE) as echo:
        peer, action = Peer(domain), "/touchup/probe/_action"
        feedback = peer.reader(f"{action}/feedback", FeedbackMessage, RELIABLE)
        send_goal = Client(echo, peer, f"{action}/send_goal", SendGoalRequest, SendGoalResponse)
        get_result = Client(echo, peer, f"{action}/get_result", GetResultRequest, GetResultResponse)
        cancel_goal = Client(echo, peer, f"{action}/cancel_goal", CancelGoalRequest, CancelGoalResponse)
        # this goal is unknown
        unknown, done = list(range(16)), list(range(16, 32))
        assert get_result(unknown).status == 0
        assert cancel_goal(GoalInfo(unknown, Time(0, 0))).return_code == 2

        # as with the answers of a service: the reader skips everything before the first heartbeat
        others = itertools.count()
        echo.wait_for(lambda: send_goal([*divmod(next(others), 256), *range(14)], [7], SETTINGS).accepted and feedback.take(1))
        # the echo refuses a goal without features, so the test may repeat it
        assert not send_goal(done, [], SETTINGS).accepted
        accepted = send_goal(done, [7, 8], SETTINGS)
        assert accepted.accepted and accepted.stamp.sec > 1_700_000_000
        result = get_result(done)
        assert (result.status, result.code, result.ids, result.codes) == (4, 4, list(range(128)), [4] * 128)
        touches = (message.touch for message in iter(lambda: next_of(echo, feedback), None) if list(message.goal_id) == done)
        assert [next(touches) for _ in range(3)] == [0, 1, 2]
        assert cancel_goal(GoalInfo(done, Time(0, 0))).return_code == 3


def test_the_clock_of_a_simulation_arrives(domain):
    with Echo(domain, "--ros-args", "-p", "use_sim_time:=true") as echo:
        writer = meet(echo, "/clock", Peer(domain).writer("/clock", Clock, BEST_EFFORT))
        writer.write(Clock(Time(12, 34)))
        echo.wait_for(lambda: echo.has("Clock("))
        assert echo.has("sec: 12, nanosec: 34")
