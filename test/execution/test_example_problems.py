"""The plans of the example problems run in MuJoCo."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_core.execution.execute import ExecutionOptions, execute_plan
from cfplan_core.execution.outcome import Outcome
from cfplan_core.execution.perturbation import Uncertainty

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
NAMES = [
    *('h013', 'h020', 'h045', 'h1004', 'h1181', 'h120', 'h122', 'h205', 'h447'),
    'trinkle_hunter_1991',
]
# Friction holds its object in another pose that the joints allow nearly as well.
JAMS = ('h013', 0.1)


@cache
def _planned(name: str) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    return problem, plan(problem)


def _outcome(name: str, friction: float) -> Outcome:
    options = ExecutionOptions(Uncertainty(friction=friction))
    return execute_plan(*_planned(name), options).outcome


@pytest.mark.parametrize('name', NAMES)
def test_object_ends_in_the_goal_without_friction(name: str) -> None:
    outcome = _outcome(name, 0.0)
    assert outcome.final_position_error <= 1e-3
    assert outcome.final_angle_error <= 0.02
    size = _planned(name)[0].object.size
    assert outcome.largest_position_deviation <= 0.05 * size
    assert outcome.largest_angle_deviation <= 0.1
    assert outcome.lost == ()


@pytest.mark.parametrize(
    ('name', 'friction'),
    [(name, mu) for name in NAMES for mu in (0.05, 0.1) if (name, mu) != JAMS],
)
def test_object_ends_in_the_goal_with_friction_that_was_not_planned(
    name: str, friction: float
) -> None:
    outcome = _outcome(name, friction)
    assert outcome.final_position_error <= 2e-3
    assert outcome.final_angle_error <= 0.05
    assert outcome.largest_position_deviation <= 0.05 * _planned(name)[0].object.size
    assert outcome.largest_angle_deviation <= 0.1


def test_tips_of_thin_links_are_where_they_are_planned() -> None:
    """A finger whose tip is 3.5 degrees sharp holds a square against one ledge and another."""
    outcome = _outcome('second_order/square_between_ledges', 0.0)
    assert outcome.lost == ()
    assert outcome.in_goal


def test_jam_is_named_by_the_contact_that_was_lost() -> None:
    outcome = _outcome(*JAMS)
    assert not outcome.in_goal
    assert outcome.lost[0].contact == 'object.v3|left.link_1.e0'
