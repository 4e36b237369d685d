"""Stands in for ament_index_python on a machine without ROS: looks packages up below AMENT_PREFIX_PATH.

Debian's rosidl and xacro's $(find) ask it for the folder of a package.
"""

import os
from pathlib import Path


class PackageNotFoundError(KeyError):
    """No prefix has this package."""


def get_package_share_directory(package_name, print_warning=True):
    """Folder share/NAME of the first prefix that has it."""
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        share = Path(prefix, "share", package_name)
        if share.is_dir():
            return str(share)
    raise PackageNotFoundError(package_name)
