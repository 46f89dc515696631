"""Checks of the path as a curve in time: limits, steps, speeds, where it starts and ends."""

from __future__ import annotations

import math

import numpy as np

from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification.checks import TOUCH
from cfplan_core.verification.mechanism import Mechanism, Scene
from cfplan_core.verification.report import Recorder
from cfplan_core.verification.structure import Stretch
from cfplan_core.verification.touching import locate, parse_pair, touching_pairs

PROJECTION = 10.0
"""How much farther than the largest gap a start may be moved to close it."""


def check_limits(mechanism: Mechanism, result: PlanResult, record: Recorder) -> None:
    """Check joint limits at every frame and joint speeds between frames."""
    for column, joint in enumerate(mechanism.problem.hand.joints):
        angles = result.joints[:, column]
        for frame, angle in enumerate(angles.tolist()):
            excess = max(joint.lower - angle, angle - joint.upper, 0.0)
            what = f'{joint.name} at {angle:.9g} rad, excess over [{joint.lower}, {joint.upper}]'
            record.measure('joint_limits', excess, frame, what)
        speeds = np.abs(np.diff(angles)) / np.diff(result.times)
        for frame, speed in enumerate(speeds.tolist(), start=1):
            record.measure(
                'joint_velocity',
                speed / joint.velocity_limit,
                frame,
                f'speed of {joint.name} since the frame before, {speed:.6g} rad/s, divided by its '
                'limit,',
            )


def check_steps(
    mechanism: Mechanism, result: PlanResult, scenes: tuple[Scene, ...], record: Recorder
) -> None:
    """Check that joints and object move little from frame to frame.

    The object's motion is that of its centre of mass. Angles are compared as numbers, so a step
    by a whole turn is a jump.
    """
    names = mechanism.problem.hand.joint_names
    joint_steps = np.abs(np.diff(result.joints, axis=0))
    turns = np.abs(np.diff(result.object_poses[:, 2]))
    for frame in range(1, len(scenes)):
        for column, name in enumerate(names):
            step = float(joint_steps[frame - 1, column])
            record.measure('joint_step', step, frame, f'motion of {name} since the frame before')
        moved = abs(scenes[frame].center - scenes[frame - 1].center) / mechanism.size
        what = 'motion of the object since the frame before, divided by its size,'
        record.measure('object_step', moved, frame, what)
        turn = float(turns[frame - 1])
        record.measure('object_turn', turn, frame, 'rotation of the object since the frame before')


def check_start(
    mechanism: Mechanism, result: PlanResult, first: Stretch, record: Recorder
) -> None:
    """Check that the first frame is the problem's start.

    A start with rounded numbers is projected onto its contacts. So it may move by 1e-6 m and ten
    times the largest gap of a contact of the first segment, if that contact touches; angles count
    with the size of the object and the reach of the link.
    """
    problem = mechanism.problem
    start = problem.start
    scene = mechanism.scene(start.object_pose, start.joints)
    gaps = [locate(pair, scene).distance for pair in first.contacts]
    allowed = TOUCH + PROJECTION * max((gap for gap in gaps if gap <= TOUCH), default=0.0)
    shift = result.object_poses[0] - start.object_pose
    record.measure(
        'start',
        math.hypot(*shift[:2]) / allowed,
        0,
        'object position off the start, divided by what rounding allows,',
    )
    record.measure(
        'start',
        abs(float(shift[2])) * mechanism.size / allowed,
        0,
        f'object angle off the start by {shift[2]:.6g} rad, divided by what rounding allows,',
    )
    links = [link for finger in problem.hand.fingers for link in finger.links]
    offsets = result.joints[0] - start.joints
    for name, link, offset in zip(problem.hand.joint_names, links, offsets, strict=True):
        reach = float(np.linalg.norm(link.vertices, axis=1).max())
        record.measure(
            'start',
            abs(float(offset)) * reach / allowed,
            0,
            f'{name} off the start by {offset:.6g} rad, divided by what rounding allows,',
        )


def check_goal(mechanism: Mechanism, result: PlanResult, scene: Scene, record: Recorder) -> None:
    """Check that the last frame is what the goal asks for.

    Angles are compared as numbers: an object a whole turn away from the goal has not reached it.
    """
    goal = mechanism.problem.goal
    last = len(result.times) - 1
    if goal.object_position is not None:
        apart = math.dist(result.object_poses[-1, :2], goal.object_position)
        record.measure(
            'goal_position',
            apart / goal.tolerance.position,
            last,
            f'object position off the goal by {apart:.6g} m, divided by the tolerance,',
        )
    if goal.object_angle is not None:
        turn = float(result.object_poses[-1, 2]) - goal.object_angle
        turns = round(turn / math.tau)
        hint = f' ({turns} whole turns and a rest)' if turns else ''
        record.measure(
            'goal_angle',
            abs(turn) / goal.tolerance.angle,
            last,
            f'object angle off the goal by {turn:.6g} rad{hint}, divided by the tolerance,',
        )
    columns = {name: k for k, name in enumerate(result.joint_names)}
    for name, angle in (goal.joints or {}).items():
        known = f'the goal names joint {name!r}, expected one of {result.joint_names}'
        if not record.require('names', name in columns, last, known):
            continue
        offset = float(result.joints[-1, columns[name]]) - angle
        record.measure(
            'goal_joints',
            abs(offset) / goal.tolerance.joints,
            last,
            f'{name} off the goal by {offset:.6g} rad, divided by the tolerance,',
        )
    for name in goal.contacts or ():
        try:
            pair = parse_pair(name, mechanism)
        except ValueError as error:
            record.require('names', False, last, f'the goal: {error}')
            continue
        distance = locate(pair, scene).distance
        record.measure('goal_contacts', distance, last, f'gap of {name}')
    if goal.exact_contacts:
        others = sorted(set(touching_pairs(mechanism, scene)) - set(goal.contacts or ()))
        record.require(
            'goal_contacts',
            not others,
            last,
            f'{", ".join(others)} at the goal, expected nothing but the contacts that it names',
        )
