"""The module under which others import it."""

from . import PackageNotFoundError, get_package_share_directory

__all__ = ["PackageNotFoundError", "get_package_share_directory"]
