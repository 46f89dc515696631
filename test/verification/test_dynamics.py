from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cfplan_core.model import Hand, Problem
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification import verify_plan
from cfplan_core.verification.dynamics import mean_accelerations

Plan = tuple[Problem, PlanResult]


def with_limit(plan: Plan, limit: float) -> Problem:
    problem, _ = plan
    left, right = problem.hand.fingers
    limited = replace(left, joints=(replace(left.joints[0], acceleration_limit=limit),))
    return replace(problem, hand=Hand(problem.hand.palm, (limited, right)))


def with_heavy_link(problem: Problem) -> Problem:
    left, right = problem.hand.fingers
    heavy = replace(left, links=(replace(left.links[0], mass=1e-4),))
    return replace(problem, hand=Hand(problem.hand.palm, (heavy, right)))


def test_mean_acceleration_of_a_steady_one_is_exact() -> None:
    times = np.array([0.0, 0.2, 0.5, 0.6, 1.0])
    places = np.column_stack([1.5 * times**2, -times])
    found = mean_accelerations(times, places)
    np.testing.assert_allclose(found[:-1, 0], 3.0, rtol=1e-12)
    np.testing.assert_allclose(found[1:-1, 1], 0.0, atol=1e-12)


def test_stopping_at_the_end_counts() -> None:
    times = np.array([0.0, 1.0, 1.5])
    found = mean_accelerations(times, np.array([[0.0], [1.0], [1.0 + 0.5 * 4.0 * 0.25]]))
    assert found[-1, 0] == pytest.approx(-4.0)


def test_acceleration_limit_that_is_kept_is_certified(sliding: Plan) -> None:
    assert verify_plan(with_limit(sliding, 20.0), sliding[1]).ok


def test_acceleration_above_its_limit_is_found(sliding: Plan) -> None:
    report = verify_plan(with_limit(sliding, 2.0), sliding[1])
    assert {failure.check for failure in report.failures} == {'joint_acceleration'}
    assert 'left_joint' in report.failures[0].message


def test_motion_in_which_inertia_matters_is_found(sliding: Plan) -> None:
    problem, result = sliding
    hasty = replace(result, times=0.3 * result.times)
    report = verify_plan(problem, hasty)
    assert 'inertia' in {failure.check for failure in report.failures}
    assert report.check('inertia').worst > 1.0


def test_quick_motion_passes_where_inertia_is_allowed_to_matter(sliding: Plan) -> None:
    problem, result = sliding
    hasty = replace(result, times=0.3 * result.times)
    checks = [
        {failure.check for failure in verify_plan(problem, hasty, inertia=share).failures}
        for share in (0.05, 5.0)
    ]
    assert 'inertia' in checks[0]
    assert 'inertia' not in checks[1]


def test_worst_inertial_force_is_that_found_by_hand(sliding: Plan) -> None:
    """In steps of a millimetre or so in a tenth of a second; the box does not turn."""
    problem, result = sliding
    x = result.object_poses[:, 0]
    rates = np.concatenate([[0.0], np.diff(x) / 0.1, [0.0]])
    spans = np.array([0.05, *[0.1] * (len(x) - 2), 0.05])
    expected = np.abs(np.diff(rates) / spans).max() / 9.81 / 0.05
    assert verify_plan(problem, result).check('inertia').worst == pytest.approx(expected)


def test_a_heavy_link_counts(sliding: Plan) -> None:
    problem, result = sliding
    heavy = with_heavy_link(problem)
    checks = [verify_plan(p, result).check('inertia') for p in (problem, heavy)]
    assert checks[1].count > checks[0].count
    assert checks[1].worst > checks[0].worst
