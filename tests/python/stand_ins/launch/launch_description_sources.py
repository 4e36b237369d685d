"""Other launch files."""

import runpy


class PythonLaunchDescriptionSource:
    """A launch file in Python, loaded on demand."""

    def __init__(self, launch_file_path):
        self.path = launch_file_path

    def get_launch_description(self):
        """Result of its function."""
        return runpy.run_path(self.path)["generate_launch_description"]()
