from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_core.execution.execute import Execution, ExecutionOptions, execute_plan

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'


@pytest.fixture(scope='session')
def problem() -> Problem:
    return load_problem(PROBLEMS / 'trinkle_hunter_1991.yaml')


@pytest.fixture(scope='session')
def planned(problem: Problem) -> PlanResult:
    return plan(problem)


@pytest.fixture(scope='session')
def execution(problem: Problem, planned: PlanResult) -> Execution:
    """The plan executed in the world that it was planned for."""
    return execute_plan(problem, planned)


@pytest.fixture(scope='session')
def execute(problem: Problem, planned: PlanResult) -> Callable[..., Execution]:
    return lambda **options: execute_plan(problem, planned, ExecutionOptions(**options))
