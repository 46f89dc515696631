"""That the checker of trajectories rejects a trajectory for each rule that it breaks."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any

import pytest
from builtin_interfaces.msg import Duration, Time
from ros.trajectory_rules import broken_rules
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NAMES = ['left_joint', 'right_joint']
STATE = [0.1, 0.2]
NOW = 1_000 * 10**9


def sound() -> JointTrajectory:
    points = [
        JointTrajectoryPoint(
            positions=[0.1 + 0.1 * k, 0.2],
            velocities=[0.05 * (k == 1), 0.0],
            time_from_start=Duration(sec=k),
        )
        for k in range(3)
    ]
    return JointTrajectory(header=Header(stamp=Time(sec=999)), joint_names=NAMES, points=points)


def broken(trajectory: JointTrajectory) -> list[str]:
    return broken_rules(trajectory, NAMES, state=STATE, now=NOW)


def test_a_sound_trajectory_breaks_no_rule() -> None:
    assert broken(sound()) == []


def test_joints_may_be_in_any_order() -> None:
    trajectory = sound()
    trajectory.joint_names = NAMES[::-1]
    for point in trajectory.points:
        point.positions = point.positions[::-1]
        point.velocities = point.velocities[::-1]
    assert broken(trajectory) == []


def test_a_first_point_later_than_now_may_be_elsewhere() -> None:
    trajectory = sound()
    trajectory.points[0].time_from_start.nanosec = 1
    trajectory.points[0].positions = array('d', [0.5, 0.5])
    assert broken(trajectory) == []


def test_a_zero_stamp_starts_now() -> None:
    trajectory = sound()
    trajectory.header.stamp = Time()
    assert broken(trajectory) == []


def at(field: str, value: object, point: int = 0) -> Callable[[Any], None]:
    def edit(trajectory: Any) -> None:
        setattr(trajectory.points[point], field, value)

    return edit


@pytest.mark.parametrize(
    ('edit', 'rule'),
    [
        (lambda t: setattr(t, 'joint_names', []), 'joint_names are empty'),
        (lambda t: setattr(t, 'joint_names', ['left_joint', 'thumb']), "the controller's"),
        (lambda t: setattr(t, 'joint_names', ['left_joint']), "the controller's"),
        (lambda t: setattr(t, 'joint_names', ['left_joint', 'left_joint']), 'one twice'),
        (lambda t: setattr(t, 'points', []), 'points are empty'),
        (at('positions', [0.1]), '1 positions for 2 joints'),
        (at('positions', []), '0 positions for 2 joints'),
        (at('velocities', [0.1]), '1 velocities for 2 joints'),
        (at('accelerations', [0.1, 0.1, 0.1]), '3 accelerations for 2 joints'),
        (at('effort', [0.1, 0.1]), 'has effort'),
        (at('time_from_start', Duration(sec=1), 2), 'not after'),
        (at('time_from_start', Duration(sec=0), 2), 'not after'),
        (at('time_from_start', Duration(sec=-1, nanosec=0)), 'before the start'),
        (lambda t: setattr(t.header, 'stamp', Time(sec=997)), 'before now'),
        (at('positions', [math.nan, 0.2], 1), 'not finite'),
        (at('velocities', [0.0, math.inf], 1), 'not finite'),
        (at('accelerations', [0.0, math.nan], 1), 'not finite'),
        (at('velocities', [0.0, 1e-6], 2), 'last velocities'),
        (at('positions', [0.1, 0.2002]), 'from where the joints are'),
    ],
)
def test_a_broken_trajectory_is_rejected_for_its_rule(
    edit: Callable[[Any], None], rule: str
) -> None:
    trajectory = sound()
    edit(trajectory)
    rules = broken(trajectory)
    assert any(rule in sentence for sentence in rules)
