"""The launch files and the frames that they start, for each combination of their arguments.

`launch` and `launch_ros` come with ROS alone: stand_ins/ has the parts of them that the files use, with the keywords of the real ones and
no others. xacro is the real one, and Debian's check_urdf reads its output.
"""

import itertools
import math
import os
import runpy
import shutil
import subprocess
import sys
import xml.etree.ElementTree as tree
from pathlib import Path

import numpy
import pytest
import yaml
from conftest import ROOT
from ros_tables import code, table

STAND_INS = ROOT / "tests/python/stand_ins"
SOURCES = ("stylus", "probe")
COMBINATIONS = list(itertools.product(("none", "sim", "ur"), SOURCES))


@pytest.fixture(scope="module", autouse=True)
def installation(tmp_path_factory):
    """touchup as if installed, ur_description, and the stand-ins, found as in a sourced shell."""
    prefix = tmp_path_factory.mktemp("prefix")
    share = prefix / "share/touchup"
    share.mkdir(parents=True)
    for folder in ("launch", "config", "urdf"):
        (share / folder).symlink_to(ROOT / folder)
    (prefix / "share/rviz2").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(STAND_INS))
        patch.setenv("PYTHONPATH", str(STAND_INS))
        patch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")
        patch.setenv("AMENT_PREFIX_PATH", f"{prefix}:{STAND_INS}")
        yield share


def launched(file, **arguments):
    """Nodes that a launch file starts, by name; the radius of the ball is 1.5 mm unless an argument gives another."""
    return visited(file, **arguments)[0]


def visited(file, **arguments):
    """Nodes that a launch file starts, by name, and the lines that it writes."""
    from launch import LaunchContext, visit

    description = runpy.run_path(str(ROOT / "launch" / file))["generate_launch_description"]()
    declared = {entity.name for entity in description.entities if hasattr(entity, "default_value")}
    assert set(arguments) <= declared
    context = LaunchContext({"tip_radius_mm": "1.5", **arguments})
    visit(description.entities, context)
    assert len({node.name for node in context.nodes}) == len(context.nodes), "two nodes of one name"
    return {node.name: node for node in context.nodes}, context.lines


def checked(urdf):
    """Root of a description, after check_urdf has read it."""
    if not shutil.which("check_urdf"):
        pytest.skip("needs check_urdf: apt-get install liburdfdom-tools")
    done = subprocess.run(["check_urdf", "/dev/stdin"], input=urdf, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "Successfully Parsed" in done.stdout, done.stdout + done.stderr
    return tree.fromstring(urdf)


def xacro(name, **arguments):
    """A description of urdf/, as the program of that name makes it, in this process; the launch files start the program."""
    from xacro import process_file

    return process_file(str(ROOT / "urdf" / f"{name}.xacro"), mappings={key: str(value) for key, value in arguments.items()}).toxml()


def poses(root):
    """Pose of each frame in the root of its tree, 4 x 4, computed independently: the product of three turns."""
    joints = {joint.find("child").get("link"): joint for joint in root.iter("joint")}

    def turn(axis, angle):
        c, s = math.cos(angle), math.sin(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turned = numpy.eye(4)
        turned[i, i], turned[i, j], turned[j, i], turned[j, j] = c, -s, s, c
        return turned

    def pose(frame):
        if frame not in joints:
            return numpy.eye(4)
        origin = joints[frame].find("origin")
        given = {} if origin is None else origin.attrib
        roll, pitch, yaw = map(float, given.get("rpy", "0 0 0").split())
        local = turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)
        local[:3, 3] = [float(x) for x in given.get("xyz", "0 0 0").split()]
        return pose(joints[frame].find("parent").get("link")) @ local

    return {link.get("name"): pose(link.get("name")) for link in root.iter("link")}


def rotation(x, y, z, w):
    """Matrix of a quaternion, by the two cross products q v q*."""
    v, norm = numpy.array([x, y, z]), x * x + y * y + z * z + w * w
    turned = lambda p: p + 2 / norm * numpy.cross(v, numpy.cross(v, p) + w * p)  # noqa: E731
    return numpy.array([turned(p) for p in numpy.eye(3)]).T


@pytest.mark.parametrize(("robot", "source"), COMBINATIONS)
def test_each_frame_of_the_table_is_there_once(robot, source):
    nodes = launched("cell.launch.py", robot=robot, source=source)
    frames = []
    for node in nodes.values():
        if node.package == "robot_state_publisher":
            frames += [link.get("name") for link in checked(node.parameters["robot_description"]).iter("link")]
    assert len(set(frames)) == len(frames)
    tools = {source, "probe"} if robot != "none" else {source}
    listed = {code(row["frame"])[0] for row in table("frame", "in")}
    wanted = {frame for frame in listed if frame.split("_")[0] in tools or frame in ("cell", "table", "object")}
    arm = set(frames) - listed
    assert set(frames) - arm == wanted
    assert ({"base_link", "tool0"} <= arm) if robot == "ur" else not arm


# tools in a tree of their own; a UR arm holds the probe in its
TOOLS = [{"stylus"}, {"probe"}, {"stylus", "probe"}, {"probe"}, {"stylus"}, set()]


@pytest.mark.parametrize(("robot", "source", "tools"), [(*pair, tools) for pair, tools in zip(COMBINATIONS, TOOLS, strict=True)])
def test_a_cell_starts_the_node_its_frames_and_rviz(robot, source, tools):
    nodes = launched("cell.launch.py", robot=robot, source=source, scan="part.ply")
    assert set(nodes) == {"touchup", "rviz", "cell_state_publisher"} | {f"{tool}_state_publisher" for tool in tools}

    node = nodes["touchup"]
    assert (node.package, node.executable, node.arguments) == ("touchup", "touchup", ["node"])
    told = {"scan": str(Path("part.ply").absolute()), "tip_radius_mm": 1.5}
    assert node.parameters == {"robot": robot, "source": source, "use_sim_time": False, **told}
    assert [Path(file).name for file in node.files] == ["node.yaml"] and Path(node.files[0]).is_file()
    known = yaml.safe_load((ROOT / "config/node.yaml").read_text())["/**"]["ros__parameters"]
    assert set(node.parameters) <= {*known, "use_sim_time"}
    # it ends everything when it ends, and has time to save
    assert type(node.on_exit).__name__ == "Shutdown" and node.sigterm_timeout >= 30
    words = node.command_line()
    assert words[words.index("--ros-args") :][:3] == ["--ros-args", "-r", "__node:=touchup"]
    assert nodes["rviz"].arguments[0] == "-d" and Path(nodes["rviz"].arguments[1]).samefile(ROOT / "config/touchup.rviz")


def test_without_a_viewer_everything_else_starts(installation):
    viewer = installation.parent / "rviz2"
    viewer.rmdir()
    try:
        nodes, lines = visited("cell.launch.py", scan="part.ply")
        assert set(nodes) == {"touchup", "cell_state_publisher", "stylus_state_publisher"}
        assert len(lines) == 1 and "rviz2 is not installed" in lines[0]
        # a request for it gets the error of ROS
        assert "rviz" in launched("cell.launch.py", scan="part.ply", rviz="true")
    finally:
        viewer.mkdir()
    assert visited("cell.launch.py", scan="part.ply")[1] == []


def test_everything_is_in_the_namespace_and_keeps_one_clock():
    for file, arguments in (("cell.launch.py", {"use_sim_time": "true"}), ("replay.launch.py", {"recording": "a", "scan": "b"})):
        for name, node in launched(file, namespace="bench", **arguments).items():
            assert node.namespace == "bench" and "__ns:=/bench" in node.command_line(), name
            assert node.parameters.get("use_sim_time", False) is (file == "cell.launch.py"), name
    assert all("__ns" not in " ".join(node.command_line()) for node in launched("cell.launch.py").values())


def test_descriptions_do_not_share_a_topic():
    nodes = launched("cell.launch.py", robot="sim", source="stylus").values()
    targets = [target for node in nodes for _, target in node.remappings]
    assert sorted(targets) == ["cell_description", "probe_description", "stylus_description"]


@pytest.mark.parametrize("wrong", [{"robot": "abb"}, {"source": "finger"}, {"rviz": "yes"}, {"mesh_unit": "cm"}])
def test_a_wrong_value_is_refused(wrong):
    with pytest.raises(RuntimeError, match="is not valid"):
        launched("cell.launch.py", **wrong)


@pytest.mark.parametrize("file", ["cell.launch.py", "replay.launch.py"])
def test_the_radius_of_the_ball_is_told_to_node_and_frames(file, tmp_path):
    scene = tmp_path / "cell.yaml"
    scene.write_text("tip: { radius_mm: 2.5 }\n")
    recording = {"recording": "touch.mcap", "scan": "scan.ply"} if file.startswith("replay") else {}
    with pytest.raises(RuntimeError, match="the radius of the ball is not known: give tip_radius_mm:="):
        launched(file, tip_radius_mm="", **recording)
    # the scene tells it, the argument does, or the argument over the scene
    for told, parameter, radius in [
        ({"scene": str(scene), "tip_radius_mm": ""}, None, "0.0025"),
        ({"tip_radius_mm": "3"}, 3.0, "0.003"),
        ({"scene": str(scene), "tip_radius_mm": "3"}, 3.0, "0.003"),
    ]:
        nodes = launched(file, **told, **recording)
        assert nodes["touchup"].parameters.get("tip_radius_mm") == parameter
        assert nodes["touchup"].arguments == (["node", "--scene", str(scene)] if "scene" in told else ["node"])
        stylus = tree.fromstring(nodes["stylus_state_publisher"].parameters["robot_description"])
        assert {sphere.get("radius") for sphere in stylus.iter("sphere")} == {radius}


def test_text_stays_text(tmp_path):
    """A folder named 1 or null is a folder."""
    nodes = launched("cell.launch.py", scan=str(tmp_path / "1"), mesh_unit="m", rviz="false")
    assert "rviz" not in nodes
    assert nodes["touchup"].parameters["scan"] == str(tmp_path / "1") and nodes["touchup"].parameters["mesh_unit"] == "m"


def test_a_replay_starts_the_same_and_the_player():
    nodes = launched("replay.launch.py", recording="touch.mcap", scan="scan.ply", source="stylus")
    assert set(nodes) == {"touchup", "cell_state_publisher", "stylus_state_publisher", "rviz", "replay"}
    assert nodes["replay"].arguments == ["replay", str(Path("touch.mcap").absolute()), "--source", "stylus"]
    # the result follows the end of the recording
    assert nodes["replay"].on_exit is None
    fast = launched("replay.launch.py", recording="touch.mcap", scan="scan.ply", speed="10")
    assert fast["replay"].arguments[4:] == ["--speed", "10"]
    with pytest.raises(RuntimeError, match="recording"):
        launched("replay.launch.py", scan="scan.ply")


def test_a_simulated_arm_has_its_part_and_moves_only_when_allowed():
    nodes = launched("cell.launch.py", robot="sim", source="probe", sim_part="truth.ply", allow_motion="true")
    parameters = nodes["touchup"].parameters
    assert (parameters["sim_part"], parameters["allow_motion"]) == (str(Path("truth.ply").absolute()), True)
    assert launched("cell.launch.py", robot="sim", source="probe", allow_motion="false")["touchup"].parameters["allow_motion"] is False
    assert not {"sim_part", "allow_motion"} & set(launched("cell.launch.py", robot="sim", source="probe")["touchup"].parameters)


def test_a_misspelled_keyword_is_refused():
    from launch_ros.actions import Node

    with pytest.raises(TypeError, match="node_executable"):
        Node(package="touchup", node_executable="touchup")


def test_a_scene_in_a_folder_with_a_space(tmp_path):
    folder = tmp_path / "my scenes"
    folder.mkdir()
    (folder / "cell.yaml").write_text("scan_to_space: { position_mm: [100, 0, 0] }\n")
    nodes = launched("cell.launch.py", scene=str(folder / "cell.yaml"))
    assert nodes["touchup"].arguments == ["node", "--scene", str(folder / "cell.yaml")]
    cell = tree.fromstring(nodes["cell_state_publisher"].parameters["robot_description"])
    assert poses(cell)["object"][:3, 3].tolist() == [0.1, 0, 0]


# a usual one, half turns, pitch of exactly and almost 90 degrees both ways, one that is not normalised
QUATERNIONS = [
    (0.011681, -0.008619, 0.563369, 0.826078),
    (1, 0, 0, 0),
    (0, 1, 0, 0),
    (0, 0, 1, 0),
    (0.5, 0.5, -0.5, 0.5),
    (0.1, 0.7, -0.1, 0.7),
    (0, math.sqrt(0.5), 0, math.sqrt(0.5)),
    (0.3, -math.sqrt(0.5 - 0.09), 0.3, math.sqrt(0.5 - 0.09)),
    (0, 0.70710, 0, 0.70711),
    (3, -1, 2, 5),
]


@pytest.mark.parametrize("quaternion", QUATERNIONS, ids=str)
def test_frames_are_where_the_scene_says(quaternion, tmp_path):
    scene = {
        "scan_to_space": {"position_mm": [411.905, -87.212, 153.419], "orientation_xyzw": list(quaternion)},
        "tip": {"radius_mm": 2.5, "offset_mm": [1, -2, -120]},
        "compensation": {"sensor_position_mm": [0, 0, 80], "sensor_orientation_xyzw": list(quaternion)},
        "refine": None,
    }
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(scene))
    cell = poses(checked(xacro("cell", scene=path)))
    # 1e-6: a pitch within that of 90 degrees counts as upright
    assert numpy.allclose(cell["object"][:3, :3], rotation(*quaternion), atol=2e-6)
    assert numpy.allclose(cell["object"][:3, 3], [0.411905, -0.087212, 0.153419], atol=1e-12)
    for tool in SOURCES:
        root = checked(xacro(tool, scene=path))
        assert {sphere.get("radius") for sphere in root.iter("sphere")} == {"0.0025"}
        tip, sensor = poses(root)[f"{tool}_tip"], poses(root)[f"{tool}_sensor"]
        assert numpy.allclose(tip[:3, 3], [0.001, -0.002, -0.120]) and numpy.allclose(tip[:3, :3], numpy.eye(3))
        assert numpy.allclose(sensor[:3, :3], rotation(*quaternion), atol=2e-6)
        assert numpy.allclose(sensor[:3, 3], [0.001, -0.002, -0.040])


SHORT = {"empty": "", "named": "tip:\nscan_to_space:\n", "exponent": "tip: { radius_mm: 2e-1 }\n"}


@pytest.mark.parametrize("scene", SHORT.values(), ids=SHORT.keys())
def test_a_scene_that_says_little_places_all_at_the_origin(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(scene)
    for name in ("cell", *SOURCES):
        for frame, pose in poses(checked(xacro(name, scene=path))).items():
            assert frame == "table" or numpy.allclose(pose, numpy.eye(4)), frame


def test_a_ur_arm_holds_the_probe_tip_down():
    """With all joints at zero the stand-in's flange is the cell's origin, z up: the probe's z goes the other way."""
    arm = poses(checked(xacro("cell", robot="ur", tcp_xyz="0 0 0.12", robot_xyz="0.5 0 0")))
    assert numpy.allclose(arm["probe_tip"][:3, 3], [0.5, 0, 0.12])
    assert numpy.allclose(arm["probe_tip"][:3, 2], -arm["tool0"][:3, 2])
