"""Plans of hands whose joints cannot hold everything that the contacts allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import (
    PlanOptions,
    PlanResult,
    Preference,
    Problem,
    load_problem,
    plan,
    planner,
    verify_plan,
)
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Hand
from cfplan_core.planning.budget import BudgetExhaustedError
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.regions import Regions
from cfplan_core.planning.roadmap import Roadmap

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'


def weakened(problem: Problem, share: float) -> Problem:
    """The problem with joints that hold a share of what its first plan takes."""
    first = plan(problem, PlanOptions(resolution=0.2))
    limits = iter(share * np.abs(first.torque_lower).max(axis=0) + 1e-6)
    fingers = tuple(
        replace(finger, joints=tuple(replace(j, effort_limit=next(limits)) for j in finger.joints))
        for finger in problem.hand.fingers
    )
    return replace(problem, hand=Hand(problem.hand.palm, fingers))


def limited(problem: Problem, limits: dict[str, float]) -> Problem:
    """The problem with other effort limits, N·m, of joints by name."""
    fingers = tuple(
        replace(
            finger,
            joints=tuple(
                replace(joint, effort_limit=limits.get(joint.name, joint.effort_limit))
                for joint in finger.joints
            ),
        )
        for finger in problem.hand.fingers
    )
    return replace(problem, hand=Hand(problem.hand.palm, fingers))


def needed_torques(result: PlanResult) -> FloatArray:
    """Torques, N·m, that each joint needs at least, shape (f, n)."""
    return np.maximum(np.maximum(result.torque_lower, -result.torque_upper), 0.0)


@pytest.mark.parametrize(
    ('name', 'joint', 'limit', 'options'),
    [
        ('trinkle_hunter_1991', 'left_joint', 0.053, PlanOptions(resolution=0.2)),
        (
            'h1181',
            'left_joint',
            0.0028,
            PlanOptions(resolution=0.3, second_order=False, prefer=Preference.ROBUST),
        ),
        ('many_joints/two_fingers_two_joints', 'right_joint_1', 0.6, PlanOptions()),
    ],
)
def test_a_stretch_that_is_too_strong_for_a_joint_is_avoided(
    name: str, joint: str, limit: float, options: PlanOptions
) -> None:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    column = problem.hand.joint_names.index(joint)
    free = plan(problem)
    assert needed_torques(free)[:, column].max() > limit
    weak = limited(problem, {joint: limit})
    result = plan(weak, options)
    assert result.solved, result.message
    assert verify_plan(weak, result).failures == ()
    assert needed_torques(result)[:, column].max() <= limit + 1e-9
    efforts = np.array([j.effort_limit for j in weak.hand.joints]) + 1e-9
    assert (np.abs(result.torque_nominal) <= efforts).all()
    assert (np.abs(result.entry_nominal) <= efforts).all()


def test_the_best_is_sought_also_where_the_first_search_forgot_ways(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = weakened(load_problem(PROBLEMS / 'h013.yaml'), 0.9)
    dropped: list[Regions] = []
    searched: list[Roadmap] = []
    drop: Callable[..., None] = Regions.drop

    def noted(regions: Regions, region: Region, z: FloatArray) -> None:
        dropped.append(regions)
        drop(regions, region, z)

    def built(roadmap: Roadmap, *rest: object) -> None:
        searched.append(roadmap)
        raise BudgetExhaustedError('seen enough')

    monkeypatch.setattr(Regions, 'drop', noted)
    monkeypatch.setattr(planner, 'BestOnMesh', built)
    result = plan(problem, PlanOptions(prefer=Preference.SHORTEST, resolution=0.2))
    assert result.solved
    assert verify_plan(problem, result).ok
    assert dropped
    assert searched
    assert all(roadmap.regions not in dropped for roadmap in searched)
