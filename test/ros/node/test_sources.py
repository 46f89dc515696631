"""The node does not know on which rclpy it runs."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import cfplan_ros

PACKAGE = Path(cfplan_ros.__file__).parent
FILES = sorted(PACKAGE.rglob('*.py'))
# What ROS 2 offers and package.xml names, what both of it and pip have, and this project's own.
ROS = {
    'ament_index_python',
    'builtin_interfaces',
    'cfplan_msgs',
    'diagnostic_msgs',
    'geometry_msgs',
    'rcl_interfaces',
    'rclpy',
    'sensor_msgs',
    'std_msgs',
    'std_srvs',
    'tf2_msgs',
    'trajectory_msgs',
    'visualization_msgs',
}
OTHERS = {
    'cfplan_core',
    'cfplan_ros',
    'click',
    'mcap',
    'numpy',
    'rich',
    'shapely',
    'yaml',
    'zstandard',
}


@pytest.mark.parametrize('word', ['standalone', 'cyclonedds', 'ddspy'])
def test_source_does_not_speak_of_the_runtime(word: str) -> None:
    assert [file.name for file in FILES if word in file.read_text(encoding='utf-8').lower()] == []


def test_node_imports_only_what_ros_and_the_package_offer() -> None:
    import sys

    allowed = ROS | OTHERS | set(sys.stdlib_module_names)
    found = {name for file in FILES for name in imported(file)}
    assert found <= allowed, found - allowed


def test_every_message_package_is_a_dependency() -> None:
    described = (PACKAGE.parent / 'package.xml').read_text(encoding='utf-8')
    used = {name for file in FILES for name in imported(file)} & ROS
    missing = {name for name in used if f'<exec_depend>{name}</exec_depend>' not in described}
    assert missing == set()


def imported(file: Path) -> set[str]:
    """Top-level names of the modules that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.partition('.')[0])
    return names
