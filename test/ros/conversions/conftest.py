from __future__ import annotations

from pathlib import Path

import pytest
from ros.conversions.example_files import PROBLEM_FILES, STORY_FILE

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_ros.conversions.hands import load_hand
from cfplan_ros.conversions.requests import Setup


@pytest.fixture(scope='session')
def story() -> Problem:
    """The problem of 1991."""
    return load_problem(STORY_FILE)


@pytest.fixture(scope='session')
def setup() -> Setup:
    """A planner with the hand of 1991 and nothing else."""
    return Setup(load_hand(STORY_FILE))


@pytest.fixture(scope='session')
def story_plan(story: Problem) -> PlanResult:
    """The plan of 1991."""
    return plan(story)


@pytest.fixture(scope='session', params=PROBLEM_FILES, ids=lambda file: file.stem)
def example(request: pytest.FixtureRequest) -> tuple[Path, Problem, PlanResult]:
    """An example problem and its plan as the planner gives it."""
    problem = load_problem(request.param)
    return request.param, problem, plan(problem)
