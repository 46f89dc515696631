"""Degenerate variants of the 1991 problem: the same reorientation must still be found."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan, verify_plan

PROBLEM = load_problem(
    Path(__file__).parents[2] / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
)


def certified(problem: Problem) -> PlanResult:
    result = plan(problem)
    assert result.solved, result.message
    report = verify_plan(problem, result)
    assert report.ok, report.failures[0]
    return result


def with_limits(joint_name: str, lower: float) -> Problem:
    fingers = tuple(
        replace(
            finger,
            joints=tuple(
                replace(joint, lower=lower) if joint.name == joint_name else joint
                for joint in finger.joints
            ),
        )
        for finger in PROBLEM.hand.fingers
    )
    return replace(PROBLEM, hand=replace(PROBLEM.hand, fingers=fingers))


@pytest.mark.parametrize('tiles', [2, 8])
def test_palm_of_flush_tiles_is_like_one_palm(tiles: int) -> None:
    bounds = [-0.45, *np.linspace(-0.0613, 0.0487, tiles - 1), 0.45]
    palm = tuple(
        np.array([[a, -0.05], [b, -0.05], [b, 0.0], [a, 0.0]])
        for a, b in itertools.pairwise(bounds)
    )
    result = certified(replace(PROBLEM, hand=replace(PROBLEM.hand, palm=palm)))
    assert max(len(segment.contacts) for segment in result.segments) > 4


def test_start_at_a_joint_limit_can_be_left() -> None:
    """The right joint only opens: its start angle may be its lower limit, rounded as it is."""
    start = float(PROBLEM.start.joints[1])
    result = certified(with_limits('right_joint', start))
    assert result.joints[:, 1].min() >= start - 1e-9
