"""Stands in for ROS 2's `launch`, which only ROS installs: enough of it to load a launch file and to see the processes that it would start.
Constructors take the keywords of the real ones and no others, so that a misspelled one raises.
"""

from launch.context import LaunchContext, visit


class LaunchDescription:
    """Result of a launch file."""

    def __init__(self, initial_entities=None, *, deprecated_reason=None):
        self.entities = list(initial_entities or [])


__all__ = ["LaunchContext", "LaunchDescription", "visit"]
