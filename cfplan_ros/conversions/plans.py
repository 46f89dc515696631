"""Plans and answers as messages, and back."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from builtin_interfaces.msg import Time
from cfplan_msgs.msg import (
    JointTorqueLimits,
    JointTorqueLimitsPoint,
    ManipulationPlan,
    PlanSegment,
)
from cfplan_msgs.srv import PlanManipulation
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from cfplan_core.errors import Finding, InvalidPlanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.plan_result import PlanResult, Segment, Statistics, Status
from cfplan_core.trajectory.segment_ends import segment_ends
from cfplan_core.trajectory.timing import joint_velocities, rest_frames
from cfplan_core.trajectory.torque_profile import EFFORT, POSITION
from cfplan_ros.conversions.contacts import contact_names, formation_message
from cfplan_ros.conversions.poses import pose_message
from cfplan_ros.conversions.stabilities import NAMES, NUMBERS
from cfplan_ros.conversions.times import (
    NANOSECONDS,
    duration_message,
    duration_of,
    nanoseconds_of,
    seconds_of,
    whole_nanoseconds,
)
from cfplan_ros.conversions.trees import tree_message, tree_nodes

_Response = PlanManipulation.Response

_ROLES = {int(PlanSegment.POSITION): POSITION, int(PlanSegment.EFFORT): EFFORT}
_CLASSES = frozenset(NAMES) - {NUMBERS['']}

_STATUSES = {
    int(_Response.NONE): Status.SOLVED,
    int(_Response.INFEASIBLE): Status.INFEASIBLE,
    int(_Response.BUDGET_EXHAUSTED): Status.BUDGET_EXHAUSTED,
    int(_Response.CANCELED): Status.BUDGET_EXHAUSTED,
    **{
        int(code): Status.INVALID
        for code in (
            _Response.HAND_MISMATCH,
            _Response.INVALID_START,
            _Response.INVALID_GOAL,
            _Response.INVALID_OBJECT,
            _Response.INVALID_GRAVITY,
            _Response.INVALID_OPTIONS,
            _Response.INVALID_FRAME,
        )
    },
}
_CODES = {
    Status.SOLVED: int(_Response.NONE),
    Status.INFEASIBLE: int(_Response.INFEASIBLE),
    Status.BUDGET_EXHAUSTED: int(_Response.BUDGET_EXHAUSTED),
}
# The core's message of a search that was cancelled begins so.
_CANCELLED = 'cancelled'


def plan_message(result: PlanResult, frame_id: str, stamp: Time) -> ManipulationPlan:
    """Return a plan as message.

    The first point of the trajectory, at time zero, is the start grasp, where the hand is. Times
    are the plan's to the nanosecond and strictly increasing. Velocities are those of
    `joint_velocities`, for which the planner makes its times.

    Args:
        result: Any outcome; one without a plan has header, name, trees and counts.
        frame_id: Frame of the object's poses.
        stamp: For the header of every part.

    Raises:
        CfplanError: The plan takes longer than a message can say.
    """
    statistics = result.statistics
    message = ManipulationPlan(
        header=Header(stamp=stamp, frame_id=frame_id),
        problem_name=result.problem,
        joint_trajectory=JointTrajectory(header=Header(stamp=stamp)),
        torque_limits=JointTorqueLimits(header=Header(stamp=stamp)),
        margin=array('d', [] if result.margin is None else [result.margin]),
        initial_tree=tree_message(result.trees[0]),
        goal_tree=tree_message(result.trees[1]),
        explored_formations=int(statistics.formations),
        tried_transitions=int(statistics.transitions),
    )
    if not result.solved:
        return message
    count = len(result.times)
    nanoseconds = whole_nanoseconds(result.times)
    rests = rest_frames(result.joints, result.segments)
    velocities = joint_velocities(nanoseconds / NANOSECONDS, result.joints, rests)
    message.joint_trajectory.joint_names = list(result.joint_names)
    message.torque_limits.joint_names = list(result.joint_names)
    message.joint_trajectory.points = [
        JointTrajectoryPoint(
            positions=_doubles(positions),
            velocities=_doubles(speeds),
            time_from_start=duration_of(time),
        )
        for positions, speeds, time in zip(result.joints, velocities, nanoseconds, strict=True)
    ]
    nominals = result.torque_nominal if len(result.torque_nominal) else [np.empty(0)] * count
    message.torque_limits.points = [
        JointTorqueLimitsPoint(
            lower=_doubles(lower),
            upper=_doubles(upper),
            nominal=_doubles(nominal),
            time_from_start=duration_of(time),
        )
        for lower, upper, nominal, time in zip(
            result.torque_lower, result.torque_upper, nominals, nanoseconds, strict=True
        )
    ]
    message.object_poses = [pose_message(pose) for pose in result.object_poses]
    message.object_angles = _doubles(result.object_poses[:, 2])
    message.segments = [
        PlanSegment(
            contact_formation=formation_message(segment.contacts),
            stability=NUMBERS[segment.stability],
            first_point=segment.first_frame,
            last_point=segment.last_frame,
            needed_force=math.nan if segment.needed_force is None else segment.needed_force,
            control=_roles(segment.control, result.joint_names),
            made=formation_message(end.made),
            broken=formation_message(end.broken),
        )
        for segment, end in zip(result.segments, segment_ends(result.segments), strict=True)
    ]
    return message


def response_of(
    result: PlanResult, frame_id: str, stamp: Time, *, record: str = ''
) -> PlanManipulation.Response:
    """Return the answer to a request that was planned.

    Args:
        result: A plan, or why there is none. For one whose status is invalid
            `invalid_grasps` and `refusal` say more in the request's words.
        frame_id: As of `plan_message`.
        stamp: As of `plan_message`.
        record: File name of the recorded run.
    """
    return _Response(
        error_code=_code(result),
        error_msg='' if result.solved else result.message,
        planning_time=duration_message(result.statistics.planning_time),
        plan=plan_message(result, frame_id, stamp),
        alternatives=[plan_message(other, frame_id, stamp) for other in result.alternatives],
        optimality=result.message if result.solved else '',
        record=record,
    )


def refusal(
    code: int, message: str, problem_name: str, frame_id: str, stamp: Time
) -> PlanManipulation.Response:
    """Return the answer to a request that was not planned.

    Args:
        code: Of ``PlanManipulation.Response``.
        message: Why.
        problem_name: As the request gave it.
        frame_id: As of `plan_message`.
        stamp: As of `plan_message`.
    """
    nothing = PlanResult(problem=problem_name, status=Status.INVALID, joint_names=())
    return _Response(
        error_code=code, error_msg=message, plan=plan_message(nothing, frame_id, stamp)
    )


def plan_result(response: PlanManipulation.Response) -> PlanResult | None:
    """Return what a planner answered.

    The reasons of failed transitions are not in an answer, nor, without a plan, the names of the
    joints.

    Args:
        response: As it came.

    Returns:
        The outcome; None if the planner did not plan for a reason that is not in the request: it
        was busy, is not configured, or failed. The response's message says which.

    Raises:
        InvalidPlanError: Parts of the plan do not fit together.
    """
    plan = response.plan
    status = _STATUSES.get(response.error_code)
    if status is None:
        return None
    solved = status is Status.SOLVED
    message = response.optimality if solved else response.error_msg
    result = _outcome(plan, status, message, seconds_of(response.planning_time), 'plan')
    if not solved:
        return result
    others = (
        _outcome(other, status, message, seconds_of(response.planning_time), f'alternatives[{k}]')
        for k, other in enumerate(response.alternatives)
    )
    return replace(result, alternatives=tuple(others))


def _outcome(
    plan: ManipulationPlan, status: Status, message: str, planning_time: float, field: str
) -> PlanResult:
    trees = (
        tree_nodes(plan.initial_tree, f'{field}.initial_tree'),
        tree_nodes(plan.goal_tree, f'{field}.goal_tree'),
    )
    result = PlanResult(
        problem=plan.problem_name,
        status=status,
        joint_names=tuple(plan.joint_trajectory.joint_names),
        message=message,
        statistics=Statistics(
            planning_time=planning_time,
            initial_tree_nodes=len(trees[0]),
            goal_tree_nodes=len(trees[1]),
            formations=int(plan.explored_formations),
            transitions=int(plan.tried_transitions),
        ),
        trees=trees,
        margin=float(plan.margin[0]) if len(plan.margin) else None,
    )
    return _with_frames(result, plan, field) if result.solved else result


def _code(result: PlanResult) -> int:
    if result.status is Status.BUDGET_EXHAUSTED and result.message.startswith(_CANCELLED):
        return int(_Response.CANCELED)
    if result.status is Status.INVALID:
        # Without regard to the file that a finding names first.
        field = result.message.removeprefix('<problem>: ')
        return int(_Response.INVALID_GOAL if field.startswith('goal') else _Response.INVALID_START)
    return _CODES[result.status]


def _with_frames(result: PlanResult, plan: ManipulationPlan, owner: str) -> PlanResult:
    points, limits = plan.joint_trajectory.points, plan.torque_limits.points
    width = len(result.joint_names)
    _refuse_misfits(plan, owner)
    poses = [
        (pose.position.x, pose.position.y, angle)
        for pose, angle in zip(plan.object_poses, plan.object_angles, strict=True)
    ]
    planned = bool(limits) and all(len(point.nominal) for point in limits)
    return replace(
        result,
        times=np.array([nanoseconds_of(p.time_from_start) for p in points]) / NANOSECONDS,
        joints=_rows([p.positions for p in points], width),
        object_poses=_rows(poses, 3),
        torque_lower=_rows([p.lower for p in limits], width),
        torque_upper=_rows([p.upper for p in limits], width),
        torque_nominal=(
            _rows([p.nominal for p in limits], width) if planned else np.empty((0, 0))
        ),
        segments=tuple(
            Segment(
                contacts=contact_names(segment.contact_formation),
                stability=NAMES[segment.stability],
                first_frame=int(segment.first_point),
                last_frame=int(segment.last_point),
                needed_force=(None if math.isnan(segment.needed_force) else segment.needed_force),
                control=_control(segment.control, result.joint_names),
            )
            for segment in plan.segments
        ),
    )


def _refuse_misfits(plan: ManipulationPlan, owner: str) -> None:
    """Refuse a plan whose parts have different lengths, times or joints."""
    trajectory, limits = plan.joint_trajectory, plan.torque_limits
    count, width = len(trajectory.points), len(trajectory.joint_names)
    found = [
        Finding('response', f'{owner}.{field}', f'{got} entries', f'{wanted}, one per {what}')
        for field, got, wanted, what in (
            ('torque_limits.points', len(limits.points), count, 'point of the trajectory'),
            ('object_poses', len(plan.object_poses), count, 'point of the trajectory'),
            ('object_angles', len(plan.object_angles), count, 'point of the trajectory'),
            *(
                (f'{part}.points[{k}].{field}', len(getattr(point, field)), width, 'joint')
                for part, points, fields in (
                    ('joint_trajectory', trajectory.points, ('positions',)),
                    ('torque_limits', limits.points, ('lower', 'upper')),
                )
                for k, point in enumerate(points)
                for field in fields
            ),
        )
        if got != wanted
    ]
    found += [
        Finding(
            'response',
            f'{owner}.segments[{k}]',
            f'stability {segment.stability}, points {segment.first_point} to {segment.last_point}',
            f'a stability of PlanSegment, points 0 to {count - 1}',
        )
        for k, segment in enumerate(plan.segments)
        if segment.stability not in _CLASSES
        or not segment.first_point <= segment.last_point < count
    ]
    for k, point in enumerate(limits.points):
        if len(point.nominal) not in (0, width):
            field = f'plan.torque_limits.points[{k}].nominal'
            got = f'{len(point.nominal)} entries'
            found.append(Finding('response', field, got, f'{width}, one per joint, or none'))
    for k, segment in enumerate(plan.segments):
        roles = list(segment.control)
        if roles and not (len(roles) == width and set(roles) <= _ROLES.keys()):
            wanted = f'{width} of PlanSegment.POSITION and EFFORT, one per joint, or none'
            found.append(Finding('response', f'plan.segments[{k}].control', repr(roles), wanted))
    if list(limits.joint_names) != list(trajectory.joint_names):
        found.append(
            Finding(
                'response',
                f'{owner}.torque_limits.joint_names',
                repr(list(limits.joint_names)),
                f'{list(trajectory.joint_names)!r}, as of the trajectory',
            )
        )
    if found:
        raise InvalidPlanError('\n'.join(str(finding) for finding in found))


def _roles(control: Mapping[str, str] | None, names: Sequence[str]) -> list[int]:
    numbers = {role: number for number, role in _ROLES.items()}
    return [] if control is None else [numbers[control[name]] for name in names]


def _control(roles: Sequence[int], names: Sequence[str]) -> dict[str, str] | None:
    if not roles:
        return None
    return {name: _ROLES[role] for name, role in zip(names, roles, strict=True)}


def _doubles(values: FloatArray) -> array[float]:
    return array('d', values.tolist())


def _rows(rows: list[array[float]] | list[tuple[float, float, float]], width: int) -> FloatArray:
    return np.array([list(row) for row in rows], dtype=np.float64).reshape(len(rows), width)
