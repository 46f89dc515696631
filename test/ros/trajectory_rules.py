"""What `joint_trajectory_controller` asks of a trajectory before it executes it.

The rules are those of its user documentation and of `validate_trajectory_msg` (ros2_controllers
4.x), with the default parameters: no partial goals, no integration of velocities, no velocity
left at the end, a position command interface. Finite numbers, positions inside the joints' limits
and names given once it takes on trust; a hand does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

NANOSECONDS = 1_000_000_000
# Positions as far apart as this, rad, are one: a plan begins where the start's contacts are exact.
SAME = 1e-4
# The controller's own tolerance for the last velocity is single precision's epsilon.
AT_REST = 1.1920929e-07


def broken_rules(
    trajectory: Any,
    joint_names: Sequence[str],
    *,
    state: Sequence[float],
    now: int | None = None,
) -> list[str]:
    """Check a trajectory.

    Args:
        trajectory: ``trajectory_msgs/msg/JointTrajectory``.
        joint_names: Of the controller.
        state: Where its joints are, rad, in that order.
        now: The controller's clock, ns; None leaves out the rule about it.

    Returns:
        A sentence for each rule that is broken.
    """
    rules = (
        *_names(trajectory, joint_names),
        *_sizes(trajectory),
        *_times(trajectory),
        *_stamp(trajectory, now),
    )
    # Values can be told to their joints only where names and sizes are right.
    return list(rules) or list(_values(trajectory, joint_names, state))


def _names(trajectory: Any, joint_names: Sequence[str]) -> Iterator[str]:
    names = list(trajectory.joint_names)
    if not names:
        yield 'joint_names are empty'
    if len(set(names)) != len(names):
        yield f'joint_names {names} have one twice'
    if set(names) != set(joint_names):
        yield f"joint_names {names} are not the controller's, {list(joint_names)}"


def _sizes(trajectory: Any) -> Iterator[str]:
    count = len(trajectory.joint_names)
    if not trajectory.points:
        yield 'points are empty'
    for k, point in enumerate(trajectory.points):
        if len(point.positions) != count:
            yield f'points[{k}] has {len(point.positions)} positions for {count} joints'
        for field in ('velocities', 'accelerations'):
            given = len(getattr(point, field))
            if given not in (0, count):
                yield f'points[{k}] has {given} {field} for {count} joints'
        if len(point.effort):
            yield f'points[{k}] has effort, which a position controller does not take'


def _times(trajectory: Any) -> Iterator[str]:
    times = [_nanoseconds(point.time_from_start) for point in trajectory.points]
    for k, time in enumerate(times):
        if time < 0:
            yield f'points[{k}] is at {time} ns, before the start'
        if k and time <= times[k - 1]:
            yield f'points[{k}] is at {time} ns, not after {times[k - 1]} ns'


def _stamp(trajectory: Any, now: int | None) -> Iterator[str]:
    stamp = _nanoseconds(trajectory.header.stamp)
    if now is None or stamp == 0 or not trajectory.points:
        return
    end = stamp + _nanoseconds(trajectory.points[-1].time_from_start)
    if end < now:
        yield f'header.stamp lets the trajectory end at {end} ns, before now, {now} ns'


def _values(trajectory: Any, joint_names: Sequence[str], state: Sequence[float]) -> Iterator[str]:
    for k, point in enumerate(trajectory.points):
        for field in ('positions', 'velocities', 'accelerations'):
            if not all(math.isfinite(value) for value in getattr(point, field)):
                yield f'points[{k}].{field} are not finite'
    last = trajectory.points[-1]
    if any(abs(value) > AT_REST for value in last.velocities):
        yield f'the last velocities {list(last.velocities)} are not zero'
    first = trajectory.points[0]
    here = dict(zip(joint_names, state, strict=True))
    apart = [
        abs(angle - here[name])
        for name, angle in zip(trajectory.joint_names, first.positions, strict=True)
    ]
    # Nothing is interpolated up to a first point at time zero: it is where the joints are.
    if _nanoseconds(first.time_from_start) == 0 and max(apart) > SAME:
        yield f'the first point is at time 0 and {max(apart):g} rad from where the joints are'


def _nanoseconds(time: Any) -> int:
    return int(time.sec) * NANOSECONDS + int(time.nanosec)
