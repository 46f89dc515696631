"""Refuse to stand in for ROS 2 where ROS 2 is.

This runs before anything else of the package is imported and needs none of it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping

_COMPILED = '_rclpy_pybind11.'


def find_real_rclpy(
    own: str, search_path: Iterable[str], environment: Mapping[str, str]
) -> str | None:
    """Return where ROS 2's own rclpy is, None where there is none.

    Args:
        own: The folder of this package.
        search_path: The folders that Python imports from.
        environment: The environment; AMENT_PREFIX_PATH lists what was sourced.
    """
    for folder in search_path:
        package = os.path.join(folder or os.curdir, 'rclpy')
        if not os.path.isdir(package) or os.path.realpath(package) == os.path.realpath(own):
            continue
        if any(
            name.startswith(_COMPILED) and name.endswith(('.so', '.pyd'))
            for name in os.listdir(package)
        ):
            return package
    for prefix in environment.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        package = os.path.join(prefix, 'share', 'rclpy')
        if prefix and os.path.isfile(os.path.join(package, 'package.xml')):
            return package
    return None


def refuse_beside_real_rclpy() -> None:
    """Raise ImportError, saying what to do, if ROS 2's own rclpy is there."""
    own = os.path.dirname(os.path.abspath(__file__))
    found = find_real_rclpy(own, sys.path, os.environ)
    if found is not None:
        raise ImportError(
            f"the standalone rclpy in '{own}' does not run beside ROS 2's own in '{found}'. "
            "To use ROS 2's, remove the standalone one (pip uninstall cfplan-standalone) or "
            'take its folder off PYTHONPATH. To use the standalone one, start a shell in which '
            "ROS 2's setup file is not sourced."
        )
