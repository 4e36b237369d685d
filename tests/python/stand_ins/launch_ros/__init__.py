"""Stands in for ROS 2's `launch_ros`, as the package `launch` beside it does for `launch`."""
