"""Requests as problems, and problems as requests."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cfplan_msgs.msg import Grasp, ObjectDescription
from cfplan_msgs.srv import PlanManipulation
from geometry_msgs.msg import Point, Vector3
from sensor_msgs.msg import JointState

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Goal, Problem
from cfplan_core.model.loading import problem_from_mapping
from cfplan_core.options import TrajectoryOptions
from cfplan_core.planner import PlanOptions
from cfplan_core.planning.grasp_check import check_problem
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_ros.conversions.contacts import formation_message
from cfplan_ros.conversions.hands import hand_digest
from cfplan_ros.conversions.options import (
    constraint_message,
    constraint_values,
    option_findings,
    trajectory_values,
)
from cfplan_ros.conversions.poses import pose_message
from cfplan_ros.conversions.request_fields import InvalidRequestError as InvalidRequestError
from cfplan_ros.conversions.request_fields import as_sent
from cfplan_ros.conversions.request_reading import RequestReader
from cfplan_ros.conversions.setup import Setup as Setup
from cfplan_ros.conversions.times import duration_message, seconds_of


def problem_from_request(
    request: PlanManipulation.Request, setup: Setup
) -> tuple[Problem, PlanOptions]:
    """Make the problem that a request poses.

    An angle given as ``object_angle`` is taken as it is. Without one the start's is in (-π, π]
    and the goal's within half a turn of the start's.

    Args:
        request: As it came.
        setup: What the planner brings.

    Returns:
        The problem, with sound data. Whether its grasps hold the object the planner finds out
        (see `invalid_grasps`). And the limits of the search, see `time_budget`.

    Raises:
        InvalidRequestError: With everything that is wrong, also with the grasps as far as they
            can be judged; for another hand than the planner's only with that.
    """
    reader = RequestReader(request, setup)
    if setup.hand is None:
        raise InvalidRequestError(reader.findings)
    if reader.other_hand:
        # Nothing else can be said of a request that means another hand.
        raise InvalidRequestError(reader.findings[:1])
    reading = problem_from_mapping(reader.mapping)
    found = [finding for finding in reading.findings if not reader.reported(finding.field)]
    findings = [*reader.findings, *option_findings(request.options, setup)]
    findings += [as_sent(finding, reader.origin) for finding in found]
    problem = reading.problem
    if findings:
        known = {finding.field for finding in reading.findings}
        if problem is not None:
            findings += [
                as_sent(finding, reader.origin)
                for finding in check_problem(problem)
                if finding.field not in known and not reader.reported(finding.field)
            ]
        raise InvalidRequestError(findings)
    assert problem is not None
    options = request.options
    return replace(problem, name=request.problem_name), PlanOptions(
        time_budget=time_budget(request, setup)[0],
        max_nodes=options.max_nodes or None,
        trajectory=TrajectoryOptions(**trajectory_values(options)),
        **constraint_values(options, setup),
    )


def problem_mapping(request: PlanManipulation.Request, setup: Setup) -> dict[str, Any]:
    """Return a request as data of the format ``cfplan/problem/1``.

    Args:
        request: One that `problem_from_request` takes; of others unsound parts are left out.
        setup: What the planner brings.

    Returns:
        Plain data. A name that the format does not allow becomes ``unnamed``.
    """
    return RequestReader(request, setup).mapping


def time_budget(request: PlanManipulation.Request, setup: Setup) -> tuple[float | None, bool]:
    """Return the seconds that a request gets, and whether these are fewer than it asks for."""
    wanted = seconds_of(request.options.time_budget) or setup.default_time_budget
    most = setup.maximal_time_budget
    if most is None or (wanted is not None and wanted <= most):
        return wanted, False
    return most, wanted is not None


def invalid_grasps(
    result: PlanResult, problem: Problem, request: PlanManipulation.Request, setup: Setup
) -> InvalidRequestError:
    """Say in the request's words why the planner took its start, goal or options for invalid.

    Args:
        result: With the status invalid.
        problem: Of the request.
        request: As it came.
        setup: What the planner brings.
    """
    origin = RequestReader(request, setup).origin
    findings = result.findings or check_problem(problem)
    return InvalidRequestError(as_sent(finding, origin) for finding in findings)


def request_from_problem(
    problem: Problem,
    options: PlanOptions | None = None,
    *,
    plan_only: bool = False,
    frame_id: str = '',
) -> PlanManipulation.Request:
    """Pose a problem to a planner.

    Args:
        problem: Of which the hand is not sent but named by its digest.
        options: Limits of the search; the planner's own by default.
        plan_only: True if the planner shall not publish the trajectory.
        frame_id: The hand's planar frame; empty for the planner's.

    Raises:
        CfplanError: The problem has friction, for which a request has no field, or the time
            budget is too long for a message.
    """
    if problem.friction != 0.0:
        raise CfplanError(
            f'contact.friction: got {problem.friction:g}, expected 0: a request cannot say it'
        )
    options = options or PlanOptions()
    goal, tolerance = problem.goal, problem.goal.tolerance
    limits = constraint_message(options)
    # Zero would be the planner's own budget.
    budget = 0.0 if options.time_budget is None else max(options.time_budget, 1e-9)
    limits.time_budget = duration_message(budget)
    limits.max_nodes = options.max_nodes or 0
    limits.position_tolerance = float(tolerance.position)
    limits.angle_tolerance = float(tolerance.angle)
    limits.joint_tolerance = float(tolerance.joints)
    limits.plan_only = plan_only
    return PlanManipulation.Request(
        problem_name=problem.name,
        hand_digest=hand_digest(problem.hand),
        start=_grasp(
            dict(zip(problem.hand.joint_names, problem.start.joints.tolist(), strict=True)),
            problem.start.object_pose,
            (),
            frame_id,
        ),
        goal=_goal(goal, frame_id),
        object=[
            ObjectDescription(
                vertices=[_point(vertex) for vertex in problem.object.vertices],
                center_of_mass=[_point(problem.object.center_of_mass)],
                mass=float(problem.object.mass),
            )
        ],
        gravity=[Vector3(x=float(problem.gravity[0]), y=float(problem.gravity[1]), z=0.0)],
        options=limits,
    )


def _grasp(
    joints: dict[str, float],
    object_pose: FloatArray | None,
    contacts: tuple[str, ...],
    frame_id: str,
) -> Grasp:
    return Grasp(
        frame_id=frame_id,
        joints=JointState(name=list(joints), position=[float(a) for a in joints.values()]),
        object_pose=[pose_message(object_pose)] if object_pose is not None else [],
        object_angle=[float(object_pose[2])] if object_pose is not None else [],
        contact_formation=formation_message(contacts),
    )


def _goal(goal: Goal, frame_id: str) -> Grasp:
    message = _grasp(dict(goal.joints or {}), goal.object_pose, goal.contacts or (), frame_id)
    if goal.position is not None:
        message.object_position = [_point(goal.position)]
    if goal.orientation is not None:
        message.object_angle = [float(goal.orientation)]
    message.exact_contacts = goal.exact_contacts
    return message


def _point(point: FloatArray) -> Point:
    return Point(x=float(point[0]), y=float(point[1]), z=0.0)
