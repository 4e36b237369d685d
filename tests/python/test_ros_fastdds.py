"""The port on DDS against Fast DDS at its default buffers, which puts the bytes of ROS 2 nodes with rmw_fastrtps on the wire."""

import subprocess
from pathlib import Path

import numpy
import pytest
from ros_domains import domains
from ros_echo import Echo
from ros_fastdds import FastDds
from ros_tables import code, table

PARAMETERS = {code(row["name"])[0]: row for row in table("name", "type", "default")}
TOO_LARGE = "an answer does not fit into one packet"


@pytest.fixture(scope="module")
def fast_dds(tmp_path_factory):
    return FastDds(tmp_path_factory.mktemp("fastdds"))


@pytest.fixture
def domain():
    return next(domains)


class Services:
    """Clients of the services of parameters, made at the first request."""

    def __init__(self, fast_dds, echo, domain, wrapper=()):
        self.make = lambda name, kind: fast_dds.client(echo, domain, f"/touchup/{name}", f"rcl_interfaces/srv/{kind}", wrapper)
        self.clients = {}

    def __getattr__(self, name):
        if name not in self.clients:
            self.clients[name] = self.make(name, "".join(word.title() for word in name.split("_")))
        return self.clients[name]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for client in self.clients.values():
            client.__exit__()


def smallest_packet():
    """Of all networks of this machine that are not down, and of Ethernet."""
    devices = [device for device in Path("/sys/class/net").iterdir() if (device / "operstate").read_text().strip() != "down"]
    return min(1500, *(int((device / "mtu").read_text()) for device in devices))


def parameters_are_listed_dumped_and_described(fast_dds, echo, domain, wrapper=(), packet=None):
    """As `ros2 param list`, `dump` and `describe` ask, of all at once; an answer that does not fit fails with words. `packet`: the smallest
    of the networks of the node, if not this one's.
    """
    # the answers have the sizes of docs/ros.md; IP splits a list larger by up to 64 bytes
    room = (packet or smallest_packet()) - 192
    is_dumped, is_described, has_words = room + 64 >= 1168, room + 64 >= 1124, room >= 1280
    with Services(fast_dds, echo, domain, wrapper) as services:
        names = services.list_parameters(prefixes=[], depth=0).result.names
        assert set(names) == {*PARAMETERS, "use_sim_time"}
        kinds = {"bool": 1, "double": 3, "string": 4}
        types = dict(zip(names, services.get_parameter_types(names=names).types, strict=True))
        assert {name: types[name] for name in PARAMETERS} == {name: kinds[row["type"]] for name, row in PARAMETERS.items()}
        parts = [names] if is_dumped else [names[0::2], names[1::2]]
        values = {name: value for part in parts for name, value in zip(part, services.get_parameters(names=part).values, strict=True)}
        print("get_parameters of", len(parts[0]), "names:", services.get_parameters.bytes, "bytes")
        assert values["flag_kind"].string_value == "hole" and values["view_rate_hz"].double_value == 20.0
        assert not echo.has(TOO_LARGE)

        # one by one with its description
        described = {}
        for name, row in PARAMETERS.items():
            (described[name],) = services.describe_parameters(names=[name]).descriptors
            assert (described[name].name, described[name].description) == (name, row["what"].replace("`", ""))
        assert not echo.has(TOO_LARGE)
        # all at once without, or not at all
        at_once = {one.name: one for one in services.describe_parameters(names=names).descriptors}
        print("describe_parameters of all:", services.describe_parameters.bytes, "bytes")
        assert list(at_once) == (names if is_described else []) and not any(one.description for one in at_once.values())
        # the words to choose from, if there is room for them
        words = "none, sim, ur, ros2_control" if has_words or not is_described else ""
        described |= at_once
        assert (described["stale_ms"].floating_point_range[0].to_value, described["robot"].additional_constraints) == (10_000.0, words)
        assert described["scan"].read_only and not described["stale_ms"].read_only
        echo.wait_for(lambda: echo.has(TOO_LARGE, '"~/describe_parameters"', "bytes", "service_mapping:=cyclone", "r2r"))

        # more than fits: well formed, empty, and reported
        assert not echo.has(TOO_LARGE, '"~/get_parameters"')
        assert len(services.get_parameters(names=(2 if is_dumped else 1) * names).values) == 0
        echo.wait_for(lambda: echo.has(TOO_LARGE, '"~/get_parameters"', "fewer names"))
        # and the next call gets its answer as ever
        assert len(services.get_parameters(names=parts[-1]).values) == len(parts[-1])

        # the results arrive even if the reasons do not fit
        store = fast_dds.store
        lists = [numpy.array([], dtype=kind) for kind in ("uint8", "bool", "int64", "float64")]
        value = store.types["rcl_interfaces/msg/ParameterValue"](4, False, 0, 0.0, "a" * 500, *lists, [])
        wrong = store.types["rcl_interfaces/msg/Parameter"]("flag_kind", value)
        results = services.set_parameters(parameters=[wrong] * 5).results
        assert [(result.successful, result.reason) for result in results] == [(False, "")] * 5
        (result,) = services.set_parameters(parameters=[wrong]).results
        assert not result.successful and result.reason.startswith('flag_kind is "aaa')


def features_are_on_the_topic(fast_dds, echo, domain, wrapper=()):
    features = fast_dds.listener(echo, domain, "/features", "touchup_msgs/msg/FeatureArray", wrapper)
    detect = fast_dds.client(echo, domain, "/touchup/detect_features", "touchup_msgs/srv/DetectFeatures", wrapper)
    with features, detect:
        answer = detect(kinds=numpy.array([], dtype="uint8"))
        print("detect_features:", detect.bytes, "bytes")
        assert (answer.success, answer.message, answer.count, list(answer.ids)) == (True, "300 slots", 300, list(range(128)))
        published = features.next()
        assert published.mesh_version >= answer.mesh_version
        assert [feature.id for feature in published.features] == list(range(300))


def what_was_probed_is_on_topics(fast_dds, echo, domain, wrapper=()):
    results = fast_dds.listener(echo, domain, "/probe_results", "touchup_msgs/msg/ProbeResult", wrapper)
    touches = fast_dds.listener(echo, domain, "/probe_touches", "touchup_msgs/msg/ProbeTouch", wrapper)
    probe = fast_dds.client(echo, domain, "/touchup/probe_feature", "touchup_msgs/srv/ProbeFeature", wrapper)
    with results, touches, probe:
        settings = fast_dds.store.types["touchup_msgs/msg/ProbeSettings"](1, 0.1, 0.95, 0, 9, 60.0, 2.0, 0.01, 0.1, 0.02, True)
        result = probe(id=9, settings=settings).result
        print("probe_feature:", probe.bytes, "bytes")
        assert (result.id, result.message, result.touch_count, len(result.feature.points)) == (9, "reached", 20, 2)
        assert results.next().message == "reached"
        received = [touches.next() for _ in range(20)]
        assert [(touch.id, touch.index, len(touch.curve_force)) for touch in received] == [(9, index, 2000) for index in range(20)]


def the_result_of_a_goal_comes(fast_dds, echo, domain, wrapper=()):
    types = fast_dds.store.types
    goal = types["unique_identifier_msgs/msg/UUID"](numpy.arange(16, dtype="uint8"))
    settings = types["touchup_msgs/msg/ProbeSettings"](1, 0.1, 0.95, 0, 9, 60.0, 2.0, 0.01, 0.1, 0.02, True)
    action = "/touchup/probe/_action"
    send = fast_dds.client(echo, domain, f"{action}/send_goal", "touchup_msgs/action/Probe_SendGoal", wrapper)
    get = fast_dds.client(echo, domain, f"{action}/get_result", "touchup_msgs/action/Probe_GetResult", wrapper)
    with send, get:
        wanted = types["touchup_msgs/action/Probe_Goal"](numpy.array([7, 8], dtype="uint32"), settings)
        assert send(goal_id=goal, goal=wanted).accepted
        answer = get(goal_id=goal)
        print("get_result:", get.bytes, "bytes")
        assert (answer.status, answer.result.code, list(answer.result.ids)) == (4, 4, list(range(128)))
        assert list(answer.result.codes) == [4] * 128


def a_long_text_is_cut_and_reported(fast_dds, echo, domain, wrapper=()):
    with fast_dds.client(echo, domain, "/touchup/undo", "touchup_msgs/srv/Undo", wrapper) as undo:
        for strokes in range(1, 101):
            answer = undo(strokes=strokes)
            assert (answer.success, answer.message, answer.strokes) == (True, "echo" * strokes, strokes)
            assert answer.mesh_version == 1 << 40
        assert not echo.has(TOO_LARGE)
        for strokes in [1000, 12_000]:
            answer = undo(strokes=strokes)
            assert (answer.success, answer.strokes, answer.mesh_version) == (True, strokes, 1 << 40)
            assert answer.message.startswith("echo" * 200) and answer.message.endswith(" …")
        echo.wait_for(lambda: echo.has(TOO_LARGE, '"~/undo"', "4028"))


def test_who_comes_late_gets_every_tile_at_default_buffers(fast_dds, domain):
    with Echo(domain, "400"), fast_dds.start("tiles", domain, 400) as peer:
        assert "ok 400 tiles" in peer.finish()


def test_parameters_are_listed_dumped_and_described(fast_dds, domain):
    with Echo(domain) as echo:
        parameters_are_listed_dumped_and_described(fast_dds, echo, domain)


def test_features_are_on_the_topic_that_the_answer_names(fast_dds, domain):
    with Echo(domain) as echo:
        features_are_on_the_topic(fast_dds, echo, domain)


def test_what_was_probed_is_on_topics(fast_dds, domain):
    with Echo(domain) as echo:
        what_was_probed_is_on_topics(fast_dds, echo, domain)


def test_the_result_of_a_goal_comes(fast_dds, domain):
    with Echo(domain) as echo:
        the_result_of_a_goal_comes(fast_dds, echo, domain)


def test_a_long_text_is_cut_and_reported(fast_dds, domain):
    with Echo(domain) as echo:
        a_long_text_is_cut_and_reported(fast_dds, echo, domain)


def test_every_wrench_comes_back_in_its_turn(fast_dds, domain):
    with Echo(domain) as echo:
        with fast_dds.start("echo", domain, 3000) as peer:
            peer.wait_for(lambda: "matched" in peer.out)
            for topic in ["/stylus/wrench", "/mismatch"]:
                echo.wait_for(lambda topic=topic: echo.has("Matched", f'"{topic}"', "count: 1"))
            peer.write()
            assert "ok 3000 echoes" in peer.finish()
    assert echo.has("dropped [0, 0] lost [0, 0] unsent [0, 0]")


def test_the_wrong_mapping_is_reported(fast_dds, domain):
    with Echo(domain, "--ros-args", "-p", "service_mapping:=cyclone") as echo:
        with fast_dds.start("call", domain, "/touchup/undo", "touchup_msgs::srv::dds_::Undo"):
            echo.wait_for(lambda: echo.has("WARN", "/touchup/undo", "-p service_mapping:=enhanced"))


def test_loopback_is_network_enough(fast_dds, domain):
    """In a network namespace of its own, with lo alone."""
    inside = ["unshare", "--user", "--map-root-user", "--net"]
    if subprocess.run([*inside, "true"], capture_output=True).returncode:
        pytest.skip("needs network namespaces: sysctl kernel.unprivileged_userns_clone=1, or root")
    with Echo(domain, wrapper=[*inside, "sh", "-c", 'ip link set lo up && exec "$0" "$@"']) as echo:
        joined = ["nsenter", "--target", str(echo.process.pid), "--user", "--preserve-credentials", "--net"]
        with fast_dds.client(echo, domain, "/touchup/undo", "touchup_msgs/srv/Undo", joined) as undo:
            assert undo(strokes=3).message == "echo" * 3
