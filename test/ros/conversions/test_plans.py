from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from cfplan_msgs.msg import ManipulationPlan
from cfplan_msgs.srv import PlanManipulation
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rclpy.serialization import deserialize_message, serialize_message
from ros.trajectory_rules import broken_rules

from cfplan_core import (
    InvalidPlanError,
    PlanOptions,
    PlanResult,
    Problem,
    Segment,
    Statistics,
    Status,
    plan,
)
from cfplan_core.trajectory.plan_result import TreeNode
from cfplan_core.trajectory.timing import joint_velocities, rest_frames
from cfplan_ros.conversions.plans import plan_message, plan_result, refusal, response_of
from cfplan_ros.conversions.times import nanoseconds_of

Response = PlanManipulation.Response
STAMP = Time(sec=1_700_000_000, nanosec=123_456_789)
ARRAYS = ('times', 'joints', 'object_poses', 'torque_lower', 'torque_upper', 'torque_nominal')
ROLES = ('position', 'effort')
CONTACTS = ('object.v0|palm.0.e2', 'object.v1|palm.0.e2', 'object.e3|left.link_1.v2')
STABILITIES = ('form_closure', 'force_closure', 'second_order')
COUNTS = st.integers(0, 2**32 - 1)


def assert_same(one: PlanResult, other: PlanResult | None) -> None:
    """Compare what a message holds of a result."""
    assert other is not None
    assert (one.problem, one.status, one.message) == (other.problem, other.status, other.message)
    assert one.joint_names == other.joint_names
    assert one.segments == other.segments
    assert one.trees == other.trees
    kept = replace(one.statistics, failures={}, planning_time=0.0)
    assert kept == replace(other.statistics, planning_time=0.0)
    planning_time = one.statistics.planning_time
    assert other.statistics.planning_time == pytest.approx(planning_time, abs=0.51e-9)
    for part in ARRAYS:
        assert getattr(one, part).tobytes() == getattr(other, part).tobytes(), part
    assert one.margin == other.margin
    assert len(one.alternatives) == len(other.alternatives)
    for first, second in zip(one.alternatives, other.alternatives, strict=True):
        # Of the answer's time there is one.
        statistics = replace(first.statistics, failures={})
        assert_same(first, replace(second, statistics=statistics))


@st.composite
def trees(draw: st.DrawFn) -> tuple[TreeNode, ...]:
    """Any tree, parents before children."""
    return tuple(
        TreeNode(
            parent=draw(st.integers(0, k - 1)) if k else None,
            contacts=tuple(draw(st.permutations(CONTACTS))),
            stability=draw(st.sampled_from(['', *STABILITIES])),
            dimension=draw(st.integers(0, 9)),
            on_path=draw(st.booleans()),
            shared=draw(st.booleans()),
        )
        for k in range(draw(st.integers(0, 4)))
    )


@st.composite
def plans(draw: st.DrawFn) -> PlanResult:
    """Any plan with times in whole nanoseconds."""
    count, width = draw(st.integers(1, 8)), draw(st.integers(1, 3))
    numbers = st.floats(-1e3, 1e3)
    steps = draw(st.lists(st.integers(1, 10**10), min_size=count - 1, max_size=count - 1))
    shape = (count, width)
    unbounded = st.one_of(numbers, st.sampled_from([math.inf, -math.inf]))
    grown = (draw(trees()), draw(trees()))
    ends = sorted({0, count - 1} | draw(st.sets(st.integers(0, count - 1))))
    segments = [
        Segment(
            tuple(draw(st.permutations(CONTACTS)))[: draw(st.integers(1, 3))],
            draw(st.sampled_from(STABILITIES)),
            first,
            last,
            draw(st.none() | st.floats(0.0, 1e6)),
            draw(
                st.none()
                | st.fixed_dictionaries(
                    {f'joint_{k}': st.sampled_from(ROLES) for k in range(width)}
                )
            ),
        )
        for first, last in zip(ends, ends[1:] or ends, strict=False)
    ]
    return PlanResult(
        problem=draw(st.text(st.characters(codec='utf-8'))),
        status=Status.SOLVED,
        joint_names=tuple(f'joint_{k}' for k in range(width)),
        times=np.concatenate([[0], np.cumsum(np.array(steps, dtype=np.int64))]) / 1e9,
        joints=draw(arrays(float, shape, elements=numbers)),
        object_poses=draw(arrays(float, (count, 3), elements=numbers)),
        torque_lower=draw(arrays(float, shape, elements=unbounded)),
        torque_upper=draw(arrays(float, shape, elements=unbounded)),
        torque_nominal=draw(st.just(np.empty((0, 0))) | arrays(float, shape, elements=numbers)),
        segments=tuple(segments),
        statistics=Statistics(
            draw(st.floats(0.0, 1e4)), len(grown[0]), len(grown[1]), draw(COUNTS), draw(COUNTS)
        ),
        trees=grown,
    )


def over_the_wire(response: Response) -> Response:
    return deserialize_message(serialize_message(response), PlanManipulation.Response)


@given(plans())
def test_a_plan_survives_an_answer_exactly(result: PlanResult) -> None:
    assert_same(result, plan_result(over_the_wire(response_of(result, 'palm', STAMP))))


@given(plans())
def test_a_trajectory_is_one_that_a_controller_takes(result: PlanResult) -> None:
    message = plan_message(result, 'palm', STAMP)
    rules = broken_rules(
        message.joint_trajectory,
        result.joint_names,
        state=result.joints[0],
        now=nanoseconds_of(STAMP),
    )
    assert rules == []


@given(plans())
def test_trajectory_limits_and_poses_go_together(result: PlanResult) -> None:
    message = plan_message(result, 'palm', STAMP)
    trajectory, limits = message.joint_trajectory, message.torque_limits
    assert trajectory.header.stamp == limits.header.stamp == message.header.stamp == STAMP
    assert list(limits.joint_names) == list(trajectory.joint_names)
    times = [point.time_from_start for point in trajectory.points]
    assert [point.time_from_start for point in limits.points] == times
    assert len(message.object_poses) == len(message.object_angles) == len(times)


@given(plans(), st.sampled_from(['infeasible', 'budget_exhausted', 'invalid']), st.text('abc é'))
def test_an_answer_without_a_plan_has_name_trees_and_counts(
    solved: PlanResult, status: str, message: str
) -> None:
    result = PlanResult(solved.problem, Status(status), (), message, trees=solved.trees)
    result = replace(result, statistics=solved.statistics)
    response = over_the_wire(response_of(result, 'palm', STAMP))
    assert_same(result, plan_result(response))
    assert not response.plan.joint_trajectory.points
    assert response.plan.header.frame_id == 'palm'


def test_an_example_can_be_followed_by_a_controller(
    example: tuple[Path, Problem, PlanResult],
) -> None:
    _, problem, result = example
    response = over_the_wire(response_of(result, 'palm', STAMP, record='run.mcap'))
    assert response.error_code == Response.NONE
    assert response.record == 'run.mcap'
    assert_same(result, plan_result(response))
    trajectory = response.plan.joint_trajectory
    assert broken_rules(trajectory, problem.hand.joint_names, state=problem.start.joints) == []


def test_velocities_are_the_slopes_of_the_plan(story_plan: PlanResult) -> None:
    points = plan_message(story_plan, 'palm', STAMP).joint_trajectory.points
    rests = rest_frames(story_plan.joints, story_plan.segments)
    expected = joint_velocities(story_plan.times, story_plan.joints, rests)
    assert np.array([point.velocities for point in points]).tobytes() == expected.tobytes()
    assert not any(len(point.accelerations) or len(point.effort) for point in points)


def test_times_nearer_than_a_nanosecond_stay_strictly_increasing() -> None:
    joints = np.linspace(0.0, 1.0, 5)[:, None]
    result = PlanResult(
        'any',
        Status.SOLVED,
        ('joint',),
        times=np.array([0.0, 1e-10, 2e-10, 3e-10, 1.0]),
        joints=joints,
        object_poses=np.zeros((5, 3)),
        torque_lower=joints,
        torque_upper=joints,
    )
    points = plan_message(result, 'palm', STAMP).joint_trajectory.points
    times = [nanoseconds_of(point.time_from_start) for point in points]
    assert times == [0, 1, 2, 3, 10**9]


def test_a_cancelled_search_is_canceled(story: Problem) -> None:
    message = 'cancelled; explored 3 contact formations'
    result = PlanResult('any', Status.BUDGET_EXHAUSTED, story.hand.joint_names, message)
    assert response_of(result, 'palm', STAMP).error_code == Response.CANCELED


def test_a_search_out_of_nodes_has_exhausted_its_budget(story: Problem) -> None:
    result = plan(story, PlanOptions(max_nodes=2))
    response = response_of(result, 'palm', STAMP)
    assert response.error_code == Response.BUDGET_EXHAUSTED
    assert response.error_msg == result.message
    assert response.plan.explored_formations == result.statistics.formations > 0


@pytest.mark.parametrize(
    ('message', 'code'),
    [
        ('<problem>: goal.joints: got x, expected y', Response.INVALID_GOAL),
        ('goal: nothing', Response.INVALID_GOAL),
        ('<problem>: start: got x, expected y', Response.INVALID_START),
    ],
)
def test_an_invalid_grasp_has_its_code(message: str, code: int) -> None:
    result = PlanResult('any', Status.INVALID, (), message)
    assert response_of(result, 'palm', STAMP).error_code == code


def test_a_refusal_says_why_and_of_what() -> None:
    response = refusal(Response.BUSY, 'one is being planned', 'mine', 'palm', STAMP)
    assert (response.error_code, response.error_msg) == (Response.BUSY, 'one is being planned')
    assert response.plan == ManipulationPlan(
        header=response.plan.header,
        problem_name='mine',
        joint_trajectory=response.plan.joint_trajectory,
        torque_limits=response.plan.torque_limits,
    )
    assert response.plan.header.stamp == STAMP


@pytest.mark.parametrize('code', [Response.UNKNOWN, Response.BUSY, Response.NOT_CONFIGURED, 65535])
def test_what_is_not_about_the_request_is_no_result(code: int) -> None:
    assert plan_result(Response(error_code=code)) is None


@pytest.mark.parametrize('code', range(Response.HAND_MISMATCH, Response.INVALID_FRAME + 1))
def test_a_wrong_request_is_an_invalid_problem(code: int) -> None:
    result = plan_result(Response(error_code=code, error_msg='why'))
    assert result is not None
    assert (result.status, result.message) == (Status.INVALID, 'why')


@pytest.mark.parametrize(
    ('edit', 'said'),
    [
        (lambda plan: plan.torque_limits.points.pop(), 'torque_limits.points: got'),
        (lambda plan: plan.object_poses.pop(), 'object_poses: got'),
        (lambda plan: plan.object_angles.pop(), 'object_angles: got'),
        (
            lambda plan: plan.joint_trajectory.points[3].positions.pop(),
            r'joint_trajectory.points\[3\].positions: got 1 entries, expected 2, one per joint',
        ),
        (lambda plan: plan.torque_limits.points[0].upper.pop(), r'points\[0\].upper: got 1'),
        (lambda plan: plan.torque_limits.joint_names.pop(), 'torque_limits.joint_names: got'),
        (
            lambda plan: setattr(plan.segments[0], 'stability', 9),
            r'segments\[0\]: got stability 9',
        ),
        (
            lambda plan: setattr(plan.initial_tree[1], 'parent', 1),
            r'initial_tree\[1\]: got parent 1',
        ),
        (lambda plan: setattr(plan.goal_tree[0], 'stability', 4), 'stability 4'),
        (
            lambda plan: setattr(plan.segments[0], 'stability', 0),
            r'segments\[0\]: got stability 0',
        ),
        (lambda plan: setattr(plan.segments[-1], 'last_point', 9999), 'to 9999'),
        (lambda plan: setattr(plan.segments[0], 'control', [1]), r'control: got \[1\], expected'),
        (lambda plan: setattr(plan.segments[0], 'control', [1, 7]), r'control: got \[1, 7\]'),
        (
            lambda plan: setattr(plan.torque_limits.points[3], 'nominal', [0.1]),
            r'points\[3\].nominal: got 1 entries, expected 2',
        ),
    ],
)
def test_an_answer_that_does_not_fit_together_is_refused(
    story_plan: PlanResult, edit: Callable[[Any], object], said: str
) -> None:
    response = response_of(story_plan, 'palm', STAMP)
    edit(response.plan)
    with pytest.raises(InvalidPlanError, match=said):
        plan_result(response)


def test_alternatives_their_margins_and_why_there_are_no_better_ones_are_answered(
    story: Problem,
) -> None:
    options = PlanOptions(prefer='fewest-segments', alternatives=2, time_budget=100.0)
    result = plan(story, options)
    assert len(result.alternatives) == 1
    assert result.margin is not None
    response = response_of(result, 'palm', STAMP)
    assert response.error_msg == ''
    assert response.optimality == result.message
    assert_same(result, plan_result(response))
