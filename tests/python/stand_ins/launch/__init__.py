"""Stands in for ROS 2's `launch`, which cannot be installed without ROS: enough of it to load a launch file and to see what it
would start. Constructors take the keywords of the real ones and no others, so that a misspelled one raises.
"""

from launch.context import LaunchContext, visit


class LaunchDescription:
    """What a launch file returns."""

    def __init__(self, initial_entities=None, *, deprecated_reason=None):
        self.entities = list(initial_entities or [])


__all__ = ["LaunchContext", "LaunchDescription", "visit"]
