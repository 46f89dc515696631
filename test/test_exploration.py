from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import networkx as nx
import pytest
from planning.scenes import pushed_angles, pushed_block
from random_problems import random_problem

from cfplan_core import CfplanError, InvalidProblemError, explore, load_problem
from cfplan_core.exploration import Exploration
from cfplan_core.model import Goal, Grasp, Hand
from cfplan_core.planner import plan

FOLDER = Path(__file__).parents[1] / 'config' / 'problems'


@cache
def explored(name: str) -> Exploration:
    return explore(load_problem(FOLDER / f'{name}.yaml'))


def test_block_between_two_tips_has_the_formations_of_a_curve_between_limits() -> None:
    found = explore(pushed_block())
    assert nx.is_connected(found.graph)
    assert found.graph.nodes[found.start]['dimension'] == 1
    assert len(found.graph.nodes[found.start]['contacts']) == 4


@pytest.mark.parametrize('seed', [1, 3, 8])
def test_everything_reached_is_connected_with_the_start(seed: int) -> None:
    found = explore(random_problem(seed))
    assert nx.is_connected(found.graph)
    assert [k for k in found.graph if found.graph.nodes[k]['depth'] == 0] == [found.start]


@pytest.mark.parametrize('name', ['existence/barrier_high_enough', 'trinkle_hunter_1991'])
def test_formations_of_a_plan_are_among_those_that_can_be_reached(name: str) -> None:
    found = explored(name)
    known = {
        (tuple(found.graph.nodes[k]['contacts']), found.graph.nodes[k]['stability'])
        for k in found.graph
    }
    result = plan(found.problem)
    assert {(s.contacts, s.stability) for s in result.segments} <= known


def test_goal_grasp_is_on_a_part_that_can_be_reached() -> None:
    found = explored('trinkle_hunter_1991')
    assert found.goal in found.graph
    assert found.others() == []


def test_goal_behind_a_barrier_is_among_the_others() -> None:
    """With the goal for a whole grasp: the mirror image of the start."""
    problem = explored('existence/barrier_too_low').problem
    left, right = problem.start.joints
    joints = {'left_joint': math.pi - right, 'right_joint': math.pi - left}
    found = explore(replace(problem, goal=Goal((0.017, 0.0, 0.0), joints)))
    assert found.goal is None
    others = {piece.index for piece in found.others()}
    assert others
    assert not others & set(found.graph)


def test_hand_of_three_joints_is_refused() -> None:
    problem = pushed_block()
    third = replace(
        problem.hand.fingers[0],
        name='third',
        base=(-0.3, 0.0),
        joints=(replace(problem.hand.joints[0], name='third_joint'),),
    )
    grasp = Grasp((0.0, 0.0, 0.0), (*pushed_angles(0.0), 1.0))
    many = replace(
        problem,
        hand=Hand(problem.hand.palm, (*problem.hand.fingers, third)),
        start=grasp,
        goal=Goal((0.0, 0.0, 0.0)),
    )
    with pytest.raises(CfplanError, match='hand of 3 joints, expected at most 2'):
        explore(many)


def test_start_that_does_not_hold_is_refused() -> None:
    with pytest.raises(InvalidProblemError, match='start'):
        explore(replace(pushed_block(), start=Grasp((0.0, 0.1, 0.0), (1.0, 1.0))))
