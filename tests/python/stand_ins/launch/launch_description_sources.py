"""Other launch files."""

import runpy


class PythonLaunchDescriptionSource:
    """A launch file in Python, loaded when it is needed."""

    def __init__(self, launch_file_path):
        self.path = launch_file_path

    def get_launch_description(self):
        """What its function returns."""
        return runpy.run_path(self.path)["generate_launch_description"]()
