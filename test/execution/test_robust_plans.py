"""The most robust plan strays little, whatever the friction."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from cfplan_core import PlanOptions, PlanResult, Preference, load_problem, plan, verify_plan
from cfplan_core.execution.execute import ExecutionOptions, execute_plan
from cfplan_core.execution.perturbation import Uncertainty

pytest.importorskip('mujoco')

PROBLEM = load_problem(Path(__file__).parents[2] / 'config' / 'problems' / 'h1181.yaml')


@cache
def robust() -> PlanResult:
    result = plan(PROBLEM, PlanOptions(prefer=Preference.ROBUST))
    assert verify_plan(PROBLEM, result).ok
    return result


@pytest.mark.parametrize('friction', [0.0, 0.05, 0.1])
def test_the_robust_plan_keeps_to_its_way(friction: float) -> None:
    options = ExecutionOptions(Uncertainty(friction=friction))
    outcome = execute_plan(PROBLEM, robust(), options).outcome
    assert outcome.in_goal
    assert outcome.largest_position_deviation <= 0.05 * PROBLEM.object.size
    assert outcome.largest_angle_deviation <= 0.1
