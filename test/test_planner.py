from __future__ import annotations

import json
import math
import re
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    LEFT,
    TIPS,
    masted_block,
    pushed_angles,
    pushed_block,
)
from random_problems import distant_goal, explore, random_problem

from cfplan_core import PlanOptions, PlanResult, Progress, Status, load_problem, plan
from cfplan_core.errors import CfplanError
from cfplan_core.model import Goal, Grasp, Hand, Problem
from cfplan_core.trajectory.plan_file import write_plan
from cfplan_core.verification import verify_plan

STORY = load_problem(
    Path(__file__).parents[1] / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
)
# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
WALL_CONTACT = 'object.e3|palm.1.v2'
# Random problems with curves two transitions and more away from the start, of the first forty.
DISTANT = [1, 3, 5, 6, 8, 10, 13, 15, 16, 17, 18, 19, 20, 24, 26, 29, 31, 32, 33, 34, 35, 36]
DISTANT += [37, 39]


def with_distant_goal(seed: int) -> Problem:
    problem = random_problem(seed)
    far = distant_goal(problem, explore(problem), seed)
    assert far is not None
    return far


@cache
def story() -> PlanResult:
    return plan(STORY)


def document(result: PlanResult, path: Path) -> str:
    """Text of a plan file, but for the time that planning took."""
    write_plan(result, path)
    return re.sub(r'"planning_time": [^,]*,', '', path.read_text(encoding='utf-8'))


def certify(problem: Problem, result: PlanResult) -> None:
    assert result.status is Status.SOLVED, result.message
    report = verify_plan(problem, result)
    assert report.failures == ()


def grasp_goal(problem: Problem, grasp: Grasp) -> Goal:
    return Goal(
        grasp.object_pose,
        dict(zip(problem.hand.joint_names, grasp.joints.tolist(), strict=True)),
    )


def between(problem: Problem, start: Grasp, goal: Grasp) -> Problem:
    """Replace a problem's grasps."""
    return replace(problem, start=start, goal=grasp_goal(problem, goal))


def at(x: float, angles: Sequence[float] | None = None) -> Grasp:
    return Grasp((x, 0.0, 0.0), pushed_angles(x) if angles is None else angles)


@pytest.mark.parametrize('seed', DISTANT)
def test_random_problem_with_a_goal_some_transitions_away_is_solved_and_certified(
    seed: int,
) -> None:
    problem = with_distant_goal(seed)
    certify(problem, plan(problem))


# Outcomes.


def test_start_that_is_the_goal_gives_one_segment() -> None:
    problem = between(pushed_block(), at(0.001), at(0.001))
    result = plan(problem)
    certify(problem, result)
    (segment,) = result.segments
    assert segment.contacts == (*FEET, *TIPS)
    assert np.abs(result.object_poses - (0.001, 0.0, 0.0)).max() < 1e-9


def test_goal_on_the_same_curve_is_reached_straight() -> None:
    problem = between(pushed_block(), at(-0.004), at(0.004))
    result = plan(problem)
    certify(problem, result)
    assert len(result.segments) == 1
    assert (np.diff(result.object_poses[:, 0]) > 0.0).all()


def test_result_names_problem_and_joints() -> None:
    result = plan(between(pushed_block(), at(0.0), at(0.001)))
    assert (result.problem, result.joint_names) == ('pushed', ('left_joint', 'right_joint'))
    assert result.message == ''


@cache
def barred() -> tuple[Problem, PlanResult]:
    """The block's mast cannot pass the barrier."""
    problem = between(masted_block(), at(-0.003), at(0.003))
    return problem, plan(problem)


def test_goal_behind_a_barrier_is_infeasible() -> None:
    _, result = barred()
    assert result.status is Status.INFEASIBLE


def test_goal_behind_a_barrier_is_reached_when_that_is_away() -> None:
    problem = between(masted_block(()), at(-0.003), at(0.003))
    certify(problem, plan(problem))


def test_infeasible_result_says_what_was_explored_and_what_failed_most_often() -> None:
    _, result = barred()
    statistics = result.statistics
    assert f'explored {statistics.formations} contact formations' in result.message
    assert f'by {statistics.transitions} transitions' in result.message
    counts = list(statistics.failures.values())
    assert counts == sorted(counts, reverse=True)
    named = [int(n) for n in re.findall(r'(\d+) × ', result.message)]
    assert named == counts[: len(named)]
    assert len(named) == min(5, len(counts))
    first = next(iter(statistics.failures))
    assert f'most frequent failures: {counts[0]} × {first}' in result.message


def test_result_without_a_plan_has_no_frames() -> None:
    _, result = barred()
    assert len(result.times) == len(result.joints) == len(result.object_poses) == 0
    assert result.segments == ()


def test_plan_file_of_a_result_without_a_plan_is_complete_json(tmp_path: Path) -> None:
    _, result = barred()
    write_plan(result, tmp_path / 'plan.json')
    content = json.loads((tmp_path / 'plan.json').read_text(encoding='utf-8'))
    assert (content['status'], content['frames']) == ('infeasible', [])


def narrowed(problem: Problem, result: PlanResult, joint: int) -> Problem:
    """Cut a plan's way: a joint may go half as far as it does beyond its start and its goal."""
    angles = result.joints[:, joint]
    ends = sorted(angles[[0, -1]].tolist())
    below, above = ends[0] - float(angles.min()), float(angles.max()) - ends[1]
    assert max(below, above) > 0.05
    upper, lower = {'upper': ends[1] + 0.5 * above}, {'lower': ends[0] - 0.5 * below}
    limit = upper if above > below else lower
    fingers = list(problem.hand.fingers)
    fingers[joint] = replace(fingers[joint], joints=(replace(fingers[joint].joints[0], **limit),))
    return replace(problem, hand=Hand(problem.hand.palm, tuple(fingers)))


@pytest.mark.parametrize(
    ('seed', 'joint', 'status'),
    [
        (10, 1, Status.SOLVED),
        (15, 1, Status.SOLVED),
        (57, 0, Status.SOLVED),
        (68, 1, Status.INFEASIBLE),
        (76, 0, Status.SOLVED),
    ],
)
def test_way_that_a_joint_limit_cuts_is_not_taken(seed: int, joint: int, status: Status) -> None:
    """Where a problem has another way, through a region, that is found."""
    problem = with_distant_goal(seed)
    cut = narrowed(problem, plan(problem), joint)
    result = plan(cut)
    assert result.status is status
    if status is Status.SOLVED:
        certify(cut, result)
    else:
        assert result.statistics.failures['a joint reaches its limit'] > 0
        assert 'a joint reaches its limit' in result.message


# Budgets.


def test_tiny_time_budget_is_exhausted() -> None:
    result = plan(STORY, PlanOptions(time_budget=1e-4))
    assert result.status is Status.BUDGET_EXHAUSTED
    assert 'time budget of 0.0001 s' in result.message
    assert 'explored' in result.message


@pytest.mark.parametrize('nodes', [2, 5, 9])
def test_budget_of_nodes_is_exhausted_and_not_exceeded(nodes: int) -> None:
    result = plan(STORY, PlanOptions(max_nodes=nodes))
    assert result.status is Status.BUDGET_EXHAUSTED
    assert f'budget of {nodes} nodes' in result.message
    statistics = result.statistics
    assert statistics.initial_tree_nodes + statistics.goal_tree_nodes == nodes


def test_budgets_that_suffice_do_not_change_the_plan(tmp_path: Path) -> None:
    ample = plan(STORY, PlanOptions(time_budget=1000.0, max_nodes=10**6))
    assert document(ample, tmp_path / 'a') == document(story(), tmp_path / 'b')


@pytest.mark.parametrize(
    'options',
    [{'time_budget': 0.0}, {'time_budget': -1.0}, {'time_budget': math.nan}, {'max_nodes': 0}],
)
def test_budget_that_allows_nothing_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(CfplanError, match=next(iter(options))):
        PlanOptions(**options)


def test_one_name_is_no_sequence_of_held_joints() -> None:
    with pytest.raises(CfplanError, match="held_joints: got 'left_joint', expected a sequence"):
        PlanOptions(held_joints='left_joint')  # type: ignore[arg-type]


def test_search_that_was_cancelled_before_it_began_ends_at_once() -> None:
    cancel = threading.Event()
    cancel.set()
    result = plan(STORY, cancel=cancel)
    assert result.status is Status.BUDGET_EXHAUSTED
    assert 'cancelled' in result.message


def test_search_is_cancelled_from_another_thread_while_it_runs() -> None:
    """The callback lets the other thread begin and waits until it has set the event."""
    cancel, running = threading.Event(), threading.Event()

    def canceller() -> None:
        running.wait(20.0)
        cancel.set()

    def progress(_: Progress) -> None:
        running.set()
        cancel.wait(20.0)

    thread = threading.Thread(target=canceller)
    thread.start()
    result = plan(STORY, progress=progress, cancel=cancel)
    thread.join()
    assert result.status is Status.BUDGET_EXHAUSTED
    assert 'cancelled' in result.message
    assert result.statistics.initial_tree_nodes >= 1


def test_progress_tells_of_growing_trees() -> None:
    told: list[Progress] = []
    result = plan(STORY, progress=told.append)
    sums = [sum(progress.nodes) for progress in told]
    assert sums == sorted(set(sums))
    elapsed = [progress.elapsed for progress in told]
    assert elapsed == sorted(elapsed)
    formations = [progress.formations for progress in told]
    assert formations == sorted(formations)
    statistics = result.statistics
    assert told[-1].nodes == (statistics.initial_tree_nodes, statistics.goal_tree_nodes)


def test_progress_that_raises_stops_the_search_with_its_error() -> None:
    def progress(_: Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plan(STORY, progress=progress)


def test_statistics_give_the_time_that_planning_took() -> None:
    before = time.perf_counter()
    result = plan(STORY)
    assert 0.0 < result.statistics.planning_time <= time.perf_counter() - before


def test_trees_of_the_result_are_those_of_the_statistics() -> None:
    result = story()
    statistics = result.statistics
    assert [len(tree) for tree in result.trees] == [
        statistics.initial_tree_nodes,
        statistics.goal_tree_nodes,
    ]
    for tree in result.trees:
        assert tree[0].parent is None
        assert all(node.parent < k for k, node in enumerate(tree) if node.parent is not None)
    assert any(node.on_path and node.shared for node in result.trees[0])


def test_segments_of_the_plan_are_on_the_path_through_the_trees() -> None:
    result = story()
    on_path = {node.contacts for tree in result.trees for node in tree if node.on_path}
    assert {segment.contacts for segment in result.segments} <= on_path


# Invalid input.


def turned(problem: Problem, joint: int, by: float) -> Problem:
    joints = problem.start.joints.copy()
    joints[joint] += by
    return replace(problem, start=Grasp(problem.start.object_pose, joints))


SOUND = between(pushed_block(), at(0.0), at(0.001))


@pytest.mark.parametrize(
    ('problem', 'expected'),
    [
        (replace(SOUND, friction=0.3), 'contact.friction: got 0.3'),
        (replace(SOUND, start=Grasp((0.0, -0.001, 0.0), at(0.0).joints)), 'deep in palm.0'),
        (replace(SOUND, start=Grasp((0.0, 0.1, 0.0), at(0.0).joints)), 'no contact'),
        (between(pushed_block(limits=(0.7, 3.0)), at(0.0), at(-0.002)), 'start.joints.left_joint'),
        (turned(SOUND, 0, 0.2), 'start: got an unstable grasp'),
        (turned(SOUND, 0, -0.2), 'deep in left.link'),
        (between(SOUND, at(0.0), Grasp((0.0, -0.001, 0.0), at(0.0).joints)), 'goal.object_pose'),
        (
            replace(SOUND, goal=replace(SOUND.goal, contacts=('object.v2|palm.0.e2',))),
            'object.v2|palm.0.e2, which does not touch in the goal grasp',
        ),
        (
            replace(SOUND, goal=Goal(contacts=('object.v9|palm.0.e2',))),
            'object.v9|palm.0.e2',
        ),
    ],
)
def test_invalid_problem_is_answered_with_what_is_wrong(problem: Problem, expected: str) -> None:
    result = plan(problem)
    assert result.status is Status.INVALID
    assert expected in result.message


def test_all_that_is_wrong_is_in_the_message() -> None:
    bad = Grasp((0.0, -0.001, 0.0), at(0.0).joints)
    result = plan(replace(between(SOUND, bad, bad), friction=0.1))
    lines = result.message.splitlines()
    fields = [line.split(': ')[1] for line in lines]
    assert fields == ['contact.friction', 'start.object_pose', 'goal.object_pose']


def test_vertex_on_a_vertex_is_no_start() -> None:
    """The left tip at the block's upper corner."""
    x = math.sqrt(LEFT**2 - 0.035**2) - BASE + HALF
    result = plan(between(pushed_block(height=0.035), at(x), at(0.0)))
    assert result.status is Status.INVALID
    assert 'a vertex on a vertex' in result.message


# Goals in part.


WALLED = pushed_block(palms=[WALL])


@pytest.mark.parametrize(
    'goal',
    [
        Goal(contacts=(WALL_CONTACT,)),
        Goal(contacts=(WALL_CONTACT, TIPS[1], *FEET)),
        Goal(object_pose=(-0.0025, 0.0, 0.0)),
        Goal(joints={'left_joint': 0.5}),
        Goal(joints={'left_joint': 1.2}),
        Goal(contacts=(WALL_CONTACT,), joints={'left_joint': 1.2}),
        Goal(object_pose=(-0.003, 0.0, 0.0), contacts=(WALL_CONTACT,)),
        Goal(object_pose=(-0.003, 0.0, 0.0), joints={'left_joint': 1.1}),
    ],
    ids=[
        'contact',
        'contacts',
        'pose',
        'joint on the curve',
        'joint beyond the curve',
        'contact and joint',
        'pose and contact',
        'pose and joint',
    ],
)
def test_goal_in_part_is_reached(goal: Goal) -> None:
    problem = replace(WALLED, start=at(0.0), goal=goal)
    certify(problem, plan(problem))


def test_start_that_fulfils_a_goal_in_part_is_the_whole_plan() -> None:
    problem = replace(pushed_block(), goal=Goal(contacts=('object.v0|palm.0.e2',)))
    result = plan(problem)
    certify(problem, result)
    assert not np.ptp(result.joints, axis=0).any()


def test_goal_in_part_that_nothing_fulfils_is_infeasible() -> None:
    """The left finger cannot touch the block's lower side, which is on the palm."""
    goal = Goal(contacts=('object.e0|left.link.v1',))
    result = plan(replace(masted_block(), goal=goal))
    assert result.status is Status.INFEASIBLE
