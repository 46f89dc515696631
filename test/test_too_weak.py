"""Plans of hands whose joints cannot hold everything that the contacts allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanOptions, Preference, Problem, load_problem, plan, planner, verify_plan
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
