"""Finds packages: under AMENT_PREFIX_PATH, in this Python's prefix, among the interfaces.

A package is installed under a prefix that has the file
``share/ament_index/resource_index/packages/<name>``. Interface packages that come with this
distribution have their ``msg`` and ``srv`` folders in their share directory.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from ros_standalone.interfaces.catalog import DEFINITIONS_PATH, package_names

_MARKER_FOLDER = os.path.join('share', 'ament_index', 'resource_index', 'packages')
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_-]*')


class PackageNotFoundError(KeyError):
    """There is no package of that name."""

    def __str__(self) -> str:
        return str(self.args[0])


def get_package_prefix(package_name: str) -> str:
    """The prefix under which a package is installed.

    Raises:
        PackageNotFoundError: There is no such package.
        ValueError: The name cannot be a package's.
    """
    prefix = _prefix(package_name)
    return os.path.dirname(DEFINITIONS_PATH) if prefix is None else prefix


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """The folder with a package's data files.

    Args:
        package_name: Name of the package.
        print_warning: Whether to say so on the error stream if the folder does not exist.

    Raises:
        PackageNotFoundError: There is no such package.
        ValueError: The name cannot be a package's.
    """
    prefix = _prefix(package_name)
    if prefix is None:
        return os.path.join(DEFINITIONS_PATH, package_name)
    path = os.path.join(prefix, 'share', package_name)
    if print_warning and not os.path.exists(path):
        print(f'Share directory for {package_name} ({path}) does not exist.', file=sys.stderr)
    return path


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    """As `get_package_share_directory`, as a path object."""
    return Path(get_package_share_directory(package_name, print_warning))


def _prefix(package_name: str) -> str | None:
    """The prefix that has the package; None for an interface package of this distribution."""
    if not _NAME.fullmatch(package_name):
        raise ValueError(f"'{package_name}' is not a valid package name")
    prefixes = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    prefixes.append(sys.prefix)
    for prefix in prefixes:
        if os.path.isfile(os.path.join(prefix, _MARKER_FOLDER, package_name)):
            return prefix
    if package_name in package_names():
        return None
    raise PackageNotFoundError(
        f"package '{package_name}' not found, searching: {[*prefixes, DEFINITIONS_PATH]}"
    )
