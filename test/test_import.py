"""What `import cfplan_core` brings in, and that its public names exist."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import cfplan_core

HEAVY = ('rclpy', 'cfplan_ros', 'matplotlib', 'mujoco', 'scipy', 'shapely', 'jsonschema', 'yaml')


def _run(code: str) -> str:
    ran = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    return ran.stdout.strip()


@pytest.mark.parametrize(
    'statement', ['import cfplan_core', 'from cfplan_core import Problem, PlanResult, CfplanError']
)
def test_import_brings_in_nothing_heavy(statement: str) -> None:
    imported = _run(f'import sys; {statement}; print(*sys.modules)').split()
    assert not {name.partition('.')[0] for name in imported} & set(HEAVY)


def test_planner_brings_in_neither_ros_nor_drawing_nor_simulation() -> None:
    imported = _run('import sys; from cfplan_core import plan; print(*sys.modules)').split()
    packages = {name.partition('.')[0] for name in imported}
    assert not packages & {'rclpy', 'cfplan_ros', 'matplotlib', 'mujoco', 'shapely'}


def test_import_takes_at_most_300_ms() -> None:
    timed = (
        'import time; start = time.perf_counter(); import cfplan_core;'
        'print(time.perf_counter() - start)'
    )
    assert min(float(_run(timed)) for _ in range(3)) <= 0.3


@pytest.mark.parametrize('name', cfplan_core.__all__)
def test_public_name_exists(name: str) -> None:
    assert getattr(cfplan_core, name) is not None


def test_type_checkers_see_the_public_names() -> None:
    tree = ast.parse(Path(cfplan_core.__file__).read_text(encoding='utf-8'))
    seen = {
        alias.asname
        for block in tree.body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
    assert seen == set(cfplan_core.__all__) - {'__version__'}


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'plann'"):
        _ = cfplan_core.plann
