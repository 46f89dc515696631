"""The command line as a function, and files for it to read."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import cfplan_core.planner
from cfplan_core import PlanResult, Problem, Status, load_problem, plan, write_plan
from cfplan_core.command_line.application import application

NAME = 'trinkle_hunter_1991'


@pytest.fixture(scope='session')
def problem_file() -> Path:
    return Path(__file__).parents[2] / 'config' / 'problems' / f'{NAME}.yaml'


@pytest.fixture(scope='session')
def cfplan() -> Callable[..., Result]:
    """Run a command in this process."""
    return lambda *arguments: CliRunner().invoke(application, [str(a) for a in arguments])


@pytest.fixture(scope='session')
def start_cfplan() -> Callable[..., subprocess.Popen[str]]:
    """Start a command as a process of its own, after some code if given."""

    def start(*arguments: object, first: str = '', **options: int) -> subprocess.Popen[str]:
        code = f'{first}\nfrom cfplan_core.command_line import main\nmain()'
        command = [sys.executable, '-c', code, *(str(a) for a in arguments)]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options)  # type: ignore[call-overload,no-any-return]

    return start


@pytest.fixture(scope='session')
def solved(problem_file: Path) -> PlanResult:
    return plan(load_problem(problem_file))


@pytest.fixture
def plan_file(solved: PlanResult, tmp_path: Path) -> Path:
    path = tmp_path / 'plan.json'
    write_plan(solved, path)
    return path


@pytest.fixture
def broken_file(problem_file: Path, tmp_path: Path) -> Path:
    """A problem with two mistakes."""
    text = problem_file.read_text(encoding='utf-8')
    text = text.replace('mass: 0.1', 'mass: -0.1')
    path = tmp_path / 'broken.yaml'
    path.write_text(text.replace('base_angle: 0.0', 'base_angle: .nan', 1), encoding='utf-8')
    return path


@pytest.fixture
def replace_planner(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., object]], None]:
    return lambda fake: monkeypatch.setattr(cfplan_core.planner, 'plan', fake)


@pytest.fixture(scope='session')
def ending_with() -> Callable[[Status], Callable[..., PlanResult]]:
    """Make planners that end at once, without a plan."""

    def planner(status: Status) -> Callable[..., PlanResult]:
        def fake(problem: Problem, *_: object, **__: object) -> PlanResult:
            return PlanResult(problem.name, status, problem.hand.joint_names, message='as told')

        return fake

    return planner
