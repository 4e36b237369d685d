"""A recording played to the node, as if it were touched now: the node, the recording, and RViz.

    ros2 launch touchup replay.launch.py recording:=touch.mcap scan:=scan.ply scene:=cell.yaml

The node and RViz stay when the recording has ended, so that the result can be looked at and saved.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def player(context):
    """`touchup replay` in the namespace of the node."""
    given = lambda name: LaunchConfiguration(name).perform(context)  # noqa: E731
    recording = os.path.abspath(os.path.expanduser(given("recording")))
    speed = [] if given("speed") == "1" else ["--speed", given("speed")]
    return [
        Node(
            package="touchup",
            executable="touchup",
            name="replay",
            namespace=given("namespace") or None,
            arguments=["replay", recording, "--source", given("source"), *speed],
            output="screen",
        )
    ]


def generate_launch_description():
    """The cell without an arm, and the player."""
    cell = os.path.join(get_package_share_directory("touchup"), "launch", "cell.launch.py")
    passed_on = ("scan", "mesh_unit", "scene", "tip_radius_mm", "params", "source", "rviz", "namespace")
    argument = DeclareLaunchArgument
    return LaunchDescription(
        [
            argument("recording", description="A rosbag2 folder or file, MCAP or SQLite."),
            argument("speed", default_value="1", description="Speed, in multiples of the recorded one."),
            argument("scan", description="Touched mesh: PLY, STL or OBJ."),
            argument("mesh_unit", default_value="", choices=["", "m", "mm", "inch"], description="Unit of the file of scan."),
            argument("scene", default_value="", description="Scene, YAML; empty: config/default.yaml."),
            argument("tip_radius_mm", default_value="", description="Radius of the ball, mm; required if no scene names it."),
            argument("params", default_value="", description="Parameters of the node; empty: config/node.yaml."),
            argument("source", default_value="stylus", choices=["stylus", "probe"], description="Touching tool."),
            argument("rviz", default_value="auto", choices=["auto", "true", "false"], description="Start RViz; auto: if installed."),
            argument("namespace", default_value="", description="Namespace of the node, the player and RViz."),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(cell),
                launch_arguments={"robot": "none", **{name: LaunchConfiguration(name) for name in passed_on}}.items(),
            ),
            OpaqueFunction(function=player),
        ]
    )
