"""Each way to spoil a good plan is caught by the check meant for it."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cfplan_core.verification
from cfplan_core.errors import CfplanError
from cfplan_core.model import Goal, Grasp, Hand, ManipulatedObject, Problem
from cfplan_core.trajectory.plan_result import PlanResult, Segment, Status
from cfplan_core.verification import VerificationReport, verify_plan

Plan = tuple[Problem, PlanResult]


def shifted(result: PlanResult, name: str, index: Any, by: float) -> PlanResult:
    array = getattr(result, name).copy()
    array[index] += by
    return replace(result, **{name: array})


def with_segment(result: PlanResult, index: int, **changes: Any) -> PlanResult:
    segments = list(result.segments)
    segments[index] = replace(segments[index], **changes)
    return replace(result, segments=tuple(segments))


def stopped_after(result: PlanResult, frames: int) -> PlanResult:
    """The beginning of a plan, within its first segment."""
    arrays = ('times', 'joints', 'object_poses', 'torque_lower', 'torque_upper')
    cut = {name: getattr(result, name)[:frames] for name in arrays}
    first = replace(result.segments[0], last_frame=frames - 1)
    return replace(result, segments=(first,), **cut)


def failed(report: VerificationReport) -> set[str]:
    return {failure.check for failure in report.failures}


def frames_failing(report: VerificationReport, check: str) -> set[int | None]:
    return {failure.frame for failure in report.failures if failure.check == check}


def test_plan_with_two_force_closures_is_certified(sliding: Plan) -> None:
    assert verify_plan(*sliding).failures == ()


def test_grasp_in_form_closure_is_certified(squeezed: Plan) -> None:
    assert verify_plan(*squeezed).failures == ()


def test_grasp_stable_to_second_order_is_certified(seated: Plan) -> None:
    assert verify_plan(*seated).failures == ()


def test_plan_of_one_frame_is_certified(squeezed: Plan) -> None:
    problem, result = squeezed
    assert verify_plan(problem, stopped_after(result, 1)).failures == ()


def test_every_check_is_applied_to_a_plan_with_a_full_goal(sliding: Plan) -> None:
    problem, result = with_nominal(sliding)
    left, right = problem.hand.fingers
    limited = replace(left, joints=(replace(left.joints[0], acceleration_limit=20.0),))
    problem = replace(problem, hand=Hand(problem.hand.palm, (limited, right)))
    assert [check.name for check in verify_plan(problem, result).checks if check.count == 0] == []


def test_object_lifted_by_10_micrometres_loses_its_contacts(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'object_poses', (5, 1), 1e-5))
    assert frames_failing(report, 'contact_gap') == {5}


def test_object_lowered_by_10_micrometres_penetrates(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'object_poses', (5, 1), -1e-5))
    assert frames_failing(report, 'penetration') == {5}


def test_object_lowered_by_a_tenth_of_a_micrometre_is_rounding(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'object_poses', (5, 1), -1e-7))
    assert failed(report) <= {'torque_limits'}


def test_depth_of_penetration_is_reported_in_metres(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'object_poses', (5, 1), -1e-5))
    assert report.check('penetration').worst == pytest.approx(1e-5, rel=1e-3)
    assert report.check('penetration').worst_frame == 5


def test_turned_object_loses_a_contact(sliding: Plan) -> None:
    problem, result = sliding
    assert 'contact_gap' in failed(
        verify_plan(problem, shifted(result, 'object_poses', (5, 2), 1e-4))
    )


def test_contact_that_is_not_named_is_found(sliding: Plan) -> None:
    problem, result = sliding
    kept = tuple(name for name in result.segments[1].contacts if name != 'object.e3|palm.1.v1')
    report = verify_plan(problem, with_segment(result, 1, contacts=kept))
    assert frames_failing(report, 'unnamed_contact') == {9, 10, 11}


def test_contact_that_is_not_named_is_found_without_frames_inside(squeezed: Plan) -> None:
    problem, result = squeezed
    short = stopped_after(result, 2)
    kept = short.segments[0].contacts[:-1]
    report = verify_plan(problem, with_segment(short, 0, contacts=kept))
    assert 'unnamed_contact' in failed(report)


def test_contact_that_is_not_named_is_found_in_a_plan_of_one_frame(squeezed: Plan) -> None:
    problem, result = squeezed
    short = stopped_after(result, 1)
    kept = short.segments[0].contacts[:-1]
    report = verify_plan(problem, with_segment(short, 0, contacts=kept))
    assert 'unnamed_contact' in failed(report)


def test_contact_made_at_the_end_of_a_segment_need_not_be_named_before(sliding: Plan) -> None:
    problem, result = sliding
    # 5e-7 m before the wall, the wall touches within tolerance but is not yet in contact.
    result = shifted(result, 'object_poses', (7, 0), -0.0005 + 5e-7)
    for column, (base, length, face) in enumerate([(-0.06, 0.05, -0.02), (0.041, 0.029, 0.02)]):
        tip = result.object_poses[7, 0] + face - base
        result.joints[7, column] = math.acos(tip / length)
    assert frames_failing(verify_plan(problem, result), 'unnamed_contact') == set()


def test_named_contact_that_does_not_touch_is_found(sliding: Plan) -> None:
    problem, result = sliding
    names = (*result.segments[0].contacts, 'object.e3|palm.1.v1')
    report = verify_plan(problem, with_segment(result, 0, contacts=names))
    assert frames_failing(report, 'contact_gap') == set(range(8))


@pytest.mark.parametrize(
    'name',
    [
        'object.v0|table.e2',
        'object.v4|palm.0.e2',
        'object.v0|palm.0.e4',
        'object.v0|palm.0.v2',
        'palm.0.e2|object.v0',
        'object.v1|palm.0.e2',
    ],
)
def test_misnamed_or_repeated_contact_is_refused(sliding: Plan, name: str) -> None:
    problem, result = sliding
    names = (name, *result.segments[0].contacts[1:])
    report = verify_plan(problem, with_segment(result, 0, contacts=names))
    assert failed(report) == {'names'}
    assert name in report.failures[0].message


def test_contact_from_the_wrong_side_is_found(squeezed: Plan) -> None:
    problem, result = squeezed
    # Turned by half a turn the table has its edge 2 where it was, and lies above it.
    above = replace(problem, hand=Hand((-problem.hand.palm[0],), problem.hand.fingers))
    assert {'contact_side', 'penetration'} <= failed(verify_plan(above, result))


def test_other_problem_is_not_solved_by_the_plan(sliding: Plan) -> None:
    problem, result = sliding
    assert failed(verify_plan(problem, replace(result, problem='other'))) == {'names'}


def test_joint_names_in_another_order_are_refused(sliding: Plan) -> None:
    problem, result = sliding
    renamed = replace(result, joint_names=('right_joint', 'left_joint'))
    assert failed(verify_plan(problem, renamed)) == {'names'}


@pytest.mark.parametrize(
    ('array', 'index'),
    [
        ('times', 3),
        ('joints', (3, 1)),
        ('object_poses', (3, 2)),
        ('torque_lower', (3, 0)),
        ('torque_upper', (3, 0)),
    ],
)
def test_not_a_number_is_refused(sliding: Plan, array: str, index: Any) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, array, index, math.nan))
    assert failed(report) == {'arrays'}
    assert frames_failing(report, 'arrays') == {3}


def test_wrong_infinity_is_no_torque_limit(sliding: Plan) -> None:
    problem, result = sliding
    assert failed(verify_plan(problem, shifted(result, 'torque_lower', (3, 0), math.inf))) == {
        'arrays'
    }


def test_missing_row_is_refused(sliding: Plan) -> None:
    problem, result = sliding
    short = replace(result, torque_upper=result.torque_upper[:-1])
    assert failed(verify_plan(problem, short)) == {'arrays'}


def test_plan_that_is_not_solved_is_not_certified(sliding: Plan) -> None:
    problem, _ = sliding
    unsolved = PlanResult('sliding', Status.INFEASIBLE, problem.hand.joint_names)
    assert failed(verify_plan(problem, unsolved)) == {'solved'}


@pytest.mark.parametrize('advance', [0.0, 0.1])
def test_time_that_does_not_increase_is_found(sliding: Plan, advance: float) -> None:
    problem, result = sliding
    times = result.times.copy()
    times[6] = times[5] - advance
    report = verify_plan(problem, replace(result, times=times))
    assert frames_failing(report, 'time') == {6}


@pytest.mark.parametrize(
    ('index', 'changes'),
    [
        (0, {'first_frame': 1}),
        (0, {'last_frame': 7}),
        (1, {'first_frame': 9}),
        (1, {'last_frame': 11}),
        (1, {'last_frame': 13}),
        (1, {'last_frame': 8}),
    ],
)
def test_segments_that_leave_frames_out_are_refused(
    sliding: Plan, index: int, changes: dict[str, int]
) -> None:
    problem, result = sliding
    assert failed(verify_plan(problem, with_segment(result, index, **changes))) == {'segments'}


def test_joint_beyond_its_limit_is_found(sliding: Plan) -> None:
    problem, result = sliding
    left, right = problem.hand.fingers
    top = float(result.joints[10, 0]) + 1e-6
    narrow = replace(left, joints=(replace(left.joints[0], upper=top),))
    limited = replace(problem, hand=Hand(problem.hand.palm, (narrow, right)))
    assert frames_failing(verify_plan(limited, result), 'joint_limits') == {11, 12}


def test_joint_faster_than_its_limit_is_found(sliding: Plan) -> None:
    problem, result = sliding
    hurried = shifted(result, 'times', slice(10, None), -0.09)
    report = verify_plan(problem, hurried)
    assert failed(report) == {'joint_velocity'}
    assert frames_failing(report, 'joint_velocity') == {10}
    assert report.check('joint_velocity').worst == pytest.approx(0.04 / 0.01)


def test_jump_of_a_joint_is_found(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'joints', (slice(10, None), 0), 0.02))
    assert frames_failing(report, 'joint_step') == {10}


def test_jump_of_the_object_is_found(sliding: Plan) -> None:
    problem, result = sliding
    keep = [0, 6, 7, 8, 9, 10, 11, 12]
    arrays = ('joints', 'object_poses', 'torque_lower', 'torque_upper')
    jumped = replace(
        result,
        times=np.arange(8.0),
        segments=(
            replace(result.segments[0], last_frame=3),
            replace(result.segments[1], first_frame=3, last_frame=7),
        ),
        **{name: getattr(result, name)[keep] for name in arrays},
    )
    report = verify_plan(problem, jumped)
    assert failed(report) == {'joint_step', 'object_step'}
    assert report.check('object_step').worst == pytest.approx(0.003 / math.hypot(0.04, 0.04))


def test_whole_turn_of_the_object_is_a_jump_and_not_the_goal(sliding: Plan) -> None:
    problem, result = sliding
    turned = shifted(result, 'object_poses', (slice(10, None), 2), math.tau)
    report = verify_plan(problem, turned)
    assert {'object_turn', 'goal_angle'} <= failed(report)
    assert '1 whole turns' in next(f.message for f in report.failures if f.check == 'goal_angle')


def test_whole_turn_of_a_joint_is_a_jump_and_not_the_goal(sliding: Plan) -> None:
    problem, result = sliding
    turned = shifted(result, 'joints', (slice(10, None), 0), -math.tau)
    assert {'joint_step', 'goal_joints', 'joint_limits'} <= failed(verify_plan(problem, turned))


@pytest.mark.parametrize(('column', 'offset'), [(0, 3e-6), (1, -3e-6), (2, 1e-4)])
def test_plan_that_begins_elsewhere_is_found(sliding: Plan, column: int, offset: float) -> None:
    problem, result = sliding
    pose = problem.start.object_pose.copy()
    pose[column] += offset
    moved = replace(problem, start=Grasp(pose, problem.start.joints))
    report = verify_plan(moved, result)
    assert failed(report) == {'start'}
    assert frames_failing(report, 'start') == {0}


def test_start_with_other_joint_angles_is_found(sliding: Plan) -> None:
    problem, result = sliding
    angles = problem.start.joints + np.array([0.0, 1e-3])
    moved = replace(problem, start=Grasp(problem.start.object_pose, angles))
    assert failed(verify_plan(moved, result)) == {'start'}


def test_start_rounded_to_its_contacts_may_be_projected(sliding: Plan) -> None:
    problem, result = sliding
    angles = problem.start.joints + np.array([0.0, 2e-5])
    rounded = replace(problem, start=Grasp(problem.start.object_pose, angles))
    assert verify_plan(rounded, result).ok


@pytest.mark.parametrize(
    ('column', 'offset', 'check'),
    [(0, 2e-4, 'goal_position'), (1, -2e-4, 'goal_position'), (2, 2e-3, 'goal_angle')],
)
def test_goal_pose_that_is_missed_is_found(
    sliding: Plan, column: int, offset: float, check: str
) -> None:
    problem, result = sliding
    pose = result.object_poses[-1].copy()
    pose[column] += offset
    report = verify_plan(replace(problem, goal=Goal(pose)), result)
    assert failed(report) == {check}
    assert frames_failing(report, check) == {12}


def test_goal_joint_that_is_missed_is_found(sliding: Plan) -> None:
    problem, result = sliding
    goal = Goal(joints={'left_joint': float(result.joints[-1, 0]) + 0.002})
    assert failed(verify_plan(replace(problem, goal=goal), result)) == {'goal_joints'}


@pytest.mark.parametrize(
    ('part', 'check'), [('position', 'goal_position'), ('orientation', 'goal_angle')]
)
def test_part_of_a_goal_pose_that_is_missed_is_found(sliding: Plan, part: str, check: str) -> None:
    problem, result = sliding
    pose = result.object_poses[-1]
    goals = [
        Goal(position=(pose[0] + off, pose[1]))
        if part == 'position'
        else Goal(orientation=float(pose[2]) + 10.0 * off)
        for off in (0.9e-4, 1.1e-4)
    ]
    near, far = (verify_plan(replace(problem, goal=goal), result) for goal in goals)
    assert failed(near) == set()
    assert failed(far) == {check}


def test_contact_that_an_exact_goal_does_not_name_is_found(sliding: Plan) -> None:
    problem, result = sliding
    names = result.segments[-1].contacts
    for contacts, expected in ((names, set()), (names[1:], {'goal_contacts'})):
        goal = Goal(contacts=contacts, exact_contacts=True)
        report = verify_plan(replace(problem, goal=goal), result)
        assert failed(report) == expected
    assert names[0] in report.failures[0].message


def test_goal_contact_that_does_not_touch_is_found(sliding: Plan) -> None:
    problem, result = sliding
    goal = Goal(contacts=('object.e3|left.link.v1', 'object.e1|right.link.v1'))
    report = verify_plan(replace(problem, goal=goal), result)
    assert failed(report) == {'goal_contacts'}
    assert 'left.link.v1' in report.failures[0].message


@pytest.mark.parametrize('frame', [0, 4, 8, 10, 12])
def test_wrong_torque_limit_is_found(sliding: Plan, frame: int) -> None:
    problem, result = sliding
    report = verify_plan(problem, shifted(result, 'torque_upper', (frame, 1), 1e-5))
    at_end = frame in (0, 8, 12)
    assert failed(report) == {'torque_limits_at_ends' if at_end else 'torque_limits'}
    assert {failure.frame for failure in report.failures} == {frame}


@pytest.mark.parametrize('source', [7, 9])
def test_shared_frame_may_carry_the_torque_limits_of_either_segment(
    sliding: Plan, source: int
) -> None:
    problem, result = sliding
    force = 0.1 * 9.81 * 0.02
    a, b = 0.05 * np.sin(result.joints[8, 0]), 0.029 * np.sin(result.joints[8, 1])
    lower, upper = result.torque_lower.copy(), result.torque_upper.copy()
    if source == 7:
        lower[8], upper[8] = (-force / (a - b) * a, 0.0), (0.0, force / (a - b) * b)
    else:
        lower[8], upper[8] = 0.0, (0.0, force / (b - 0.01) * b)
    carried = replace(result, torque_lower=lower, torque_upper=upper)
    assert verify_plan(problem, carried).ok


def test_shared_frame_may_not_mix_the_torque_limits_of_its_segments(sliding: Plan) -> None:
    problem, result = sliding
    upper = result.torque_upper.copy()
    upper[8, 1] = upper[9, 1]
    report = verify_plan(problem, replace(result, torque_upper=upper))
    assert failed(report) == {'torque_limits_at_ends'}


def controlled(plan: Plan, left: str, right: str) -> Plan:
    """The same roles in all segments."""
    problem, result = plan
    control = {'left_joint': left, 'right_joint': right}
    segments = tuple(replace(segment, control=control) for segment in result.segments)
    return problem, replace(result, segments=segments)


def with_nominal(plan: Plan) -> Plan:
    """The sliding box with the middles of its limits; where two segments meet, of the earlier."""
    problem, result = controlled(plan, 'position', 'effort')
    nominal = 0.5 * (result.torque_lower + result.torque_upper)
    return problem, replace(result, torque_nominal=nominal)


def test_one_finger_held_and_one_in_torque_control_is_certified(sliding: Plan) -> None:
    assert verify_plan(*controlled(sliding, 'position', 'effort')).failures == ()


@pytest.mark.parametrize(
    ('left', 'right', 'message'),
    [
        ('position', 'position', 'the grasp jams; 1 more in effort control expected'),
        ('effort', 'effort', '2 joints are in effort control, expected 1'),
    ],
)
def test_control_that_does_not_keep_the_contacts_is_found(
    sliding: Plan, left: str, right: str, message: str
) -> None:
    report = verify_plan(*controlled(sliding, left, right))
    assert failed(report) == {'control'}
    assert any(message in failure.message for failure in report.failures)


def test_left_finger_that_lifts_off_cannot_be_in_torque_control(sliding: Plan) -> None:
    problem, result = controlled(sliding, 'effort', 'position')
    report = verify_plan(problem, result)
    assert failed(report) == {'control'}
    assert frames_failing(report, 'control') == {9}


def test_control_of_an_unknown_joint_is_found(sliding: Plan) -> None:
    problem, result = sliding
    spoiled = with_segment(result, 0, control={'left_joint': 'effort', 'thumb': 'position'})
    assert failed(verify_plan(problem, spoiled)) == {'control'}


def test_nominal_torques_in_the_middle_are_certified(sliding: Plan) -> None:
    assert verify_plan(*with_nominal(sliding)).failures == ()


def test_nominal_torques_between_two_segments_are_certified(sliding: Plan) -> None:
    problem, result = with_nominal(sliding)
    # At the event any mixture of both segments' forces is an equilibrium of all contacts.
    entry = 0.5 * (result.torque_lower[9] + result.torque_upper[9])
    nominal = result.torque_nominal.copy()
    upper, lower = result.torque_upper[8], result.torque_lower[8]
    nominal[8] = 0.9 * nominal[8] + 0.1 * entry
    assert ((lower <= nominal[8]) & (nominal[8] <= upper)).all()
    assert verify_plan(problem, replace(result, torque_nominal=nominal)).ok


def test_nominal_torque_outside_its_limits_is_found(sliding: Plan) -> None:
    problem, result = with_nominal(sliding)
    nominal = result.torque_nominal.copy()
    nominal[10, 1] = 1.01 * result.torque_upper[10, 1]
    report = verify_plan(problem, replace(result, torque_nominal=nominal))
    assert failed(report) == {'nominal_limits', 'nominal_balance'}
    assert {failure.frame for failure in report.failures} == {10}


def test_nominal_torques_that_do_not_balance_together_are_found(sliding: Plan) -> None:
    problem, result = with_nominal(sliding)
    report = verify_plan(problem, shifted(result, 'torque_nominal', (4, 1), -1e-4))
    assert failed(report) == {'nominal_balance'}


def test_nominal_torque_beyond_the_effort_limit_is_found(sliding: Plan) -> None:
    problem, result = with_nominal(sliding)
    left, right = problem.hand.fingers
    limit = 0.9 * float(np.abs(result.torque_nominal[:, 1]).max())
    weak = replace(right, joints=(replace(right.joints[0], effort_limit=limit),))
    report = verify_plan(replace(problem, hand=Hand(problem.hand.palm, (left, weak))), result)
    assert failed(report) == {'nominal_effort'}


def test_nominal_torques_must_fit_the_frames(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, replace(result, torque_nominal=np.zeros((3, 2))))
    assert failed(report) == {'arrays'}


def test_bound_on_an_unbounded_torque_is_found(squeezed: Plan) -> None:
    problem, result = squeezed
    upper = result.torque_upper.copy()
    upper[:, 1] = 100.0
    report = verify_plan(problem, replace(result, torque_upper=upper))
    assert failed(report) == {'torque_limits', 'torque_limits_at_ends'}


def test_unbounded_claim_for_a_bounded_torque_is_found(sliding: Plan) -> None:
    problem, result = sliding
    upper = result.torque_upper.copy()
    upper[4, 1] = math.inf
    report = verify_plan(problem, replace(result, torque_upper=upper))
    assert failed(report) == {'torque_limits'}


def test_weight_of_a_link_belongs_to_its_torque_limits(seated: Plan) -> None:
    problem, result = seated
    without = replace(
        result,
        torque_lower=np.zeros_like(result.torque_lower),
        torque_upper=np.zeros_like(result.torque_upper),
    )
    assert failed(verify_plan(problem, without)) == {'torque_limits', 'torque_limits_at_ends'}


def test_actuator_that_cannot_carry_its_link_is_found(seated: Plan) -> None:
    problem, result = seated
    (finger,) = problem.hand.fingers
    torque = float(result.torque_lower[0, 0])
    weak = replace(finger, joints=(replace(finger.joints[0], effort_limit=0.99 * torque),))
    report = verify_plan(replace(problem, hand=Hand(problem.hand.palm, (weak,))), result)
    assert failed(report) == {'effort'}
    assert report.check('effort').worst == pytest.approx(1.0 / 0.99)


@pytest.mark.parametrize('claim', ['form_closure', 'second_order'])
def test_other_class_than_force_closure_is_found(sliding: Plan, claim: str) -> None:
    problem, result = sliding
    report = verify_plan(problem, with_segment(result, 0, stability=claim))
    assert frames_failing(report, 'stability_class') >= set(range(1, 8))


@pytest.mark.parametrize('claim', ['force_closure', 'second_order'])
def test_other_class_than_form_closure_is_found(squeezed: Plan, claim: str) -> None:
    problem, result = squeezed
    assert failed(verify_plan(problem, with_segment(result, 0, stability=claim))) == {
        'stability_class'
    }


@pytest.mark.parametrize('claim', ['force_closure', 'form_closure'])
def test_other_class_than_second_order_is_found(seated: Plan, claim: str) -> None:
    problem, result = seated
    report = verify_plan(problem, with_segment(result, 0, stability=claim))
    assert {'rank'} <= failed(report)


def test_unknown_class_is_refused(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(problem, with_segment(result, 0, stability='stable'))
    assert failed(report) == {'stability_class'}


def test_form_closure_needs_no_weight(squeezed: Plan) -> None:
    problem, result = squeezed
    assert verify_plan(replace(problem, gravity=np.zeros(2)), result).ok


def test_force_closure_is_lost_without_weight(sliding: Plan) -> None:
    problem, result = sliding
    report = verify_plan(replace(problem, gravity=np.zeros(2)), result)
    assert 'stability' in failed(report)


def test_object_at_rest_on_the_palm_alone_is_unstable(squeezed: Plan) -> None:
    problem, result = squeezed
    away = np.tile([math.pi / 2 + 0.5, math.pi / 2 - 0.5], (3, 1))
    lying = replace(
        result,
        joints=away,
        torque_lower=np.zeros((3, 2)),
        torque_upper=np.zeros((3, 2)),
        segments=(Segment(result.segments[0].contacts[:2], 'force_closure', 0, 2),),
    )
    start = Grasp(problem.start.object_pose, away[0])
    report = verify_plan(replace(problem, start=start, goal=Goal(start.object_pose)), lying)
    assert failed(report) == {'rank'}


def test_object_at_rest_on_the_palm_alone_is_unstable_to_second_order(squeezed: Plan) -> None:
    problem, result = squeezed
    away = np.tile([math.pi / 2 + 0.5, math.pi / 2 - 0.5], (3, 1))
    lying = replace(
        result,
        joints=away,
        torque_lower=np.zeros((3, 2)),
        torque_upper=np.zeros((3, 2)),
        segments=(Segment(result.segments[0].contacts[:2], 'second_order', 0, 2),),
    )
    start = Grasp(problem.start.object_pose, away[0])
    report = verify_plan(replace(problem, start=start, goal=Goal(start.object_pose)), lying)
    assert failed(report) == {'stability'}


def test_object_that_tips_off_its_supports_is_unstable(sliding: Plan) -> None:
    problem, result = sliding
    thing = problem.object
    heavy = ManipulatedObject(thing.vertices, thing.mass, (0.0201, 0.0))
    report = verify_plan(replace(problem, object=heavy), stopped_after(result, 8))
    assert {'stability', 'stability_at_ends'} <= failed(report)


def test_seat_that_is_too_narrow_is_unstable(make_seat: Callable[[float], Plan]) -> None:
    report = verify_plan(*make_seat(0.008))
    assert failed(report) == {'stability'}


def test_seat_has_the_curvature_of_its_closed_form(make_seat: Callable[[float], Plan]) -> None:
    size, width = 0.04, 0.016
    worst = verify_plan(*make_seat(width)).check('stability').worst
    turning = (width - 0.02) / size
    assert worst == pytest.approx((2 * width - 0.02) / size / (1 + turning**2), rel=1e-5)


def test_links_of_different_fingers_may_not_overlap(sliding: Plan) -> None:
    problem, result = sliding
    left, right = problem.hand.fingers
    # A bow from the left finger's base over the box to the right finger, in the world.
    bow = [
        (-0.058, 0.05),
        (0.03, 0.05),
        (0.03, 0.003),
        (0.07, 0.003),
        (0.07, 0.07),
        (-0.07, 0.07),
        (-0.07, 0.0),
    ]
    turn = np.exp(-1j * problem.start.joints[0])
    points = [(complex(x, y) - complex(*left.base)) * turn for x, y in bow]
    link = left.links[0]
    outline = [*link.vertices.tolist(), *[(p.real, p.imag) for p in points]]
    bowed = replace(left, links=(replace(link, vertices=np.array(outline)),))
    report = verify_plan(replace(problem, hand=Hand(problem.hand.palm, (bowed, right))), result)
    assert failed(report) == {'link_overlap'}


def test_friction_is_refused(sliding: Plan) -> None:
    problem, result = sliding
    with pytest.raises(CfplanError, match=r'contact\.friction is 0\.2'):
        verify_plan(replace(problem, friction=0.2), result)


def test_failures_come_in_the_order_of_frames(sliding: Plan) -> None:
    problem, result = sliding
    spoilt = shifted(result, 'object_poses', (9, 1), 1e-5)
    spoilt = shifted(spoilt, 'torque_upper', (3, 1), 1e-3)
    report = verify_plan(problem, spoilt)
    frames = [failure.frame for failure in report.failures]
    assert frames == sorted(frames, key=lambda frame: -1 if frame is None else frame)
    assert report.first_failure is not None
    assert report.first_failure.frame == 3


def test_verification_shares_no_code_with_the_planner() -> None:
    allowed = ('errors', 'model', 'trajectory.plan_result', 'verification')
    for path in Path(cfplan_core.verification.__file__).parent.glob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or '']
            for name in names:
                if name.startswith('cfplan_core.'):
                    assert name.removeprefix('cfplan_core.').startswith(allowed), (path, name)
