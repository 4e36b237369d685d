"""A cell: the node, the frames of its scene, and RViz if installed.

    ros2 launch touchup cell.launch.py scan:=part.ply tip_radius_mm:=1.5
    ros2 launch touchup cell.launch.py scan:=part.ply robot:=ur ur_type:=ur5e source:=probe scene:=cell.yaml

The hand stylus, or the arm of somebody else with the probe, publishes wrench and pose; with robot:=sim or robot:=ur the
node does. Everything runs in `namespace`. The frames depend on source, robot, scene and radius of the ball, so these come from here, the
radius from the scene or `tip_radius_mm`. Other parameters come from the file `params` unless they are given here.
"""

import os
import shlex

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


NO_RADIUS = "the radius of the ball is not known: give tip_radius_mm:=R, or a scene:=FILE that names it (`touchup init` writes one)"


def path(*below):
    """Absolute path of a file installed with touchup."""
    return os.path.join(get_package_share_directory("touchup"), *below)


def is_installed(package):
    """Whether this installation of ROS has the package."""
    try:
        get_package_share_directory(package)
    except PackageNotFoundError:
        return False
    return True


def absolute(given):
    """The path as seen from here, whatever the folder in which a process starts; empty stays empty."""
    return os.path.abspath(os.path.expanduser(given)) if given else ""


def text(value):
    """A parameter that is text, even if it looks like a number."""
    return ParameterValue(value, value_type=str)


def frames(name, arguments, common):
    """Publishes the frames of urdf/NAME.xacro, and the description as NAME_description."""
    command = " ".join(shlex.quote(word) for word in ["xacro", path("urdf", f"{name}.xacro"), *arguments])
    return Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        name=f"{name}_state_publisher",
        namespace=common["namespace"],
        parameters=[{"robot_description": text(Command(command)), "use_sim_time": common["use_sim_time"]}],
        remappings=[("robot_description", f"{name}_description")],
    )


def actions(context):
    """Actions of the arguments."""
    given = lambda name: LaunchConfiguration(name).perform(context)  # noqa: E731
    # an empty namespace is refused where none is not
    common = {"namespace": given("namespace") or None, "use_sim_time": given("use_sim_time") == "true"}
    robot, source = given("robot"), given("source")
    # the frames are made of the scene and the radius that the node refines by
    scene, tip_radius_mm = absolute(given("scene")), given("tip_radius_mm")
    if not scene and not tip_radius_mm:
        raise RuntimeError(NO_RADIUS)
    told = {"scene": scene, "tip_radius_mm": tip_radius_mm}
    told = [f"{name}:={value}" for name, value in told.items() if value]

    parameters = {"source": text(source), "robot": text(robot), "use_sim_time": common["use_sim_time"]}
    if given("scan"):
        parameters["scan"] = text(absolute(given("scan")))
    if given("mesh_unit"):
        parameters["mesh_unit"] = text(given("mesh_unit"))
    if given("sim_part"):
        parameters["sim_part"] = text(absolute(given("sim_part")))
    if tip_radius_mm:
        parameters["tip_radius_mm"] = float(tip_radius_mm)
    if given("allow_motion"):
        parameters["allow_motion"] = given("allow_motion") == "true"
    started = [
        Node(
            package="touchup",
            executable="touchup",
            name="touchup",
            namespace=common["namespace"],
            arguments=["node", "--scene", scene] if scene else ["node"],
            parameters=[absolute(given("params")) or path("config", "node.yaml"), parameters],
            output="screen",
            # it saves when it ends
            sigterm_timeout="30",
            on_exit=Shutdown(reason="the node of touchup ended"),
        )
    ]

    place = [f"{name}:={given(name)}" for name in ("ur_type", "robot_xyz", "robot_rpy", "tcp_xyz", "tcp_rpy") if given(name)]
    started.append(frames("cell", [f"robot:={robot}", *told, *place], common))
    # a UR arm holds the probe in its own tree
    tools = {source, "probe"} if robot != "none" else {source}
    held = {"probe"} if robot == "ur" else set()
    started += [frames(tool, told, common) for tool in sorted(tools - held)]

    if given("rviz") == "auto" and not is_installed("rviz2"):
        started.append(LogInfo(msg="touchup: rviz2 is not installed, no viewer is started (apt install ros-$ROS_DISTRO-rviz2)"))
    elif given("rviz") != "false":
        started.append(
            Node(
                package="rviz2",
                executable="rviz2",
                name="rviz",
                namespace=common["namespace"],
                arguments=["-d", path("config", "touchup.rviz")],
                parameters=[{"use_sim_time": common["use_sim_time"]}],
            )
        )
    return started


def generate_launch_description():
    """The arguments and their actions."""
    argument = DeclareLaunchArgument
    yes_no = ["true", "false"]
    return LaunchDescription(
        [
            argument("robot", default_value="none", choices=["none", "sim", "ur"], description="Kind of arm."),
            argument("sim_part", default_value="", description="True part for robot:=sim, a mesh."),
            argument(
                "allow_motion", default_value="", choices=["", *yes_no], description="Permission to move the arm; empty: as in params."
            ),
            argument("source", default_value="stylus", choices=["stylus", "probe"], description="Touching tool."),
            argument("scan", default_value="", description="Mesh to refine: PLY, STL or OBJ."),
            argument("mesh_unit", default_value="", choices=["", "m", "mm", "inch"], description="Unit of the file of scan."),
            argument("scene", default_value="", description="Scene, YAML; empty: config/default.yaml."),
            argument("tip_radius_mm", default_value="", description="Radius of the ball, mm; required if no scene names it."),
            argument("params", default_value="", description="Parameters of the node; empty: config/node.yaml."),
            argument("rviz", default_value="auto", choices=["auto", *yes_no], description="Start RViz; auto: if installed."),
            argument("namespace", default_value="", description="Namespace of the node and of RViz."),
            argument("use_sim_time", default_value="false", choices=yes_no, description="Time from /clock."),
            argument("ur_type", default_value="ur5e", description="Model of the arm with robot:=ur, as in ur_description."),
            argument("robot_xyz", default_value="", description="Position of its base_link in the cell, m; empty: 0 0 0."),
            argument("robot_rpy", default_value="", description="Orientation of its base_link in the cell, rad; empty: 0 0 0."),
            argument("tcp_xyz", default_value="", description="Position of its tool centre point from tool0, m; empty: 0 0 0."),
            argument("tcp_rpy", default_value="", description="Orientation of that point, rad; empty: pi 0 0, z from tip to handle."),
            OpaqueFunction(function=actions),
        ]
    )
