from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanOptions, PlanResult, Status, load_problem, plan
from cfplan_core.model import Problem
from cfplan_core.planning import expedition
from cfplan_core.verification import verify_plan

# That of 20 joints takes minutes to certify: benchmark/test_many_joints.py does.
PROBLEMS = sorted(
    path
    for path in (Path(__file__).parents[2] / 'config' / 'problems' / 'many_joints').glob('*.yaml')
    if path.stem != 'four_fingers_five_joints'
)
every_problem = pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)


@cache
def planned(path: Path) -> tuple[Problem, PlanResult]:
    problem = load_problem(path)
    return problem, plan(problem)


@every_problem
def test_reorientation_is_solved_and_certified(path: Path) -> None:
    problem, result = planned(path)
    assert result.solved, result.message
    assert verify_plan(problem, result).failures == ()
    assert np.ptp(result.object_poses[:, 2]) > np.radians(60.0)


@every_problem
def test_contacts_are_made_and_broken_on_the_way(path: Path) -> None:
    _, result = planned(path)
    contacts = [set(segment.contacts) for segment in result.segments]
    changes = list(pairwise(contacts))
    assert any(after - before for before, after in changes)
    assert any(before - after for before, after in changes)


def test_plan_is_the_same_on_every_run() -> None:
    path = next(path for path in PROBLEMS if path.stem == 'two_fingers_two_joints')
    problem, result = planned(path)
    again = plan(problem)
    np.testing.assert_array_equal(again.joints, result.joints)
    assert again.segments == result.segments


def test_search_that_began_anew_is_solved_and_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expedition, '_PATIENCE', 0.5)
    path = next(path for path in PROBLEMS if path.stem == 'two_fingers_two_joints')
    problem, first = planned(path)
    result = plan(problem)
    assert result.solved, result.message
    assert not np.array_equal(result.joints, first.joints)
    assert verify_plan(problem, result).failures == ()


def test_time_budget_ends_a_search_long_before_it_is_done() -> None:
    problem = load_problem(PROBLEMS[0])
    result = plan(problem, PlanOptions(time_budget=0.05))
    assert result.status is Status.BUDGET_EXHAUSTED
    assert result.statistics.planning_time < 3.0
