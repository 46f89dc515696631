"""What a plan asks of the drives at every step of an execution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.trajectory.timing import joint_velocities, rest_frames


@dataclass(frozen=True, eq=False)
class Reference:
    """A plan at s instants, the last of them after a time of rest at its end.

    Attributes:
        times: Shape (s,), s from the plan's start.
        segments: Shape (s,), index of the plan's segment.
        joints: Shape (s, n), rad, on the cubics through the frames.
        velocities: Shape (s, n), rad/s, their slopes.
        object_poses: Shape (s, 3), of the object's frame: m, m, rad.
        torques: Shape (s, n), N·m, to be fed forward.
        stiff: Shape (s, n), true where a joint is held in position.
    """

    times: FloatArray
    segments: IntArray
    joints: FloatArray
    velocities: FloatArray
    object_poses: FloatArray
    torques: FloatArray
    stiff: BoolArray


def build_reference(
    system: ContactSystem,
    result: PlanResult,
    torques: tuple[FloatArray, ...],
    stiff: BoolArray,
    time_step: float,
    rest: float,
) -> Reference:
    """Sample a plan.

    Args:
        system: Of the plan's problem.
        result: A solved plan.
        torques: For each segment the torques at its frames, shape (f, n), N·m: linear between.
        stiff: Shape (segments, n), true where a joint is held in position.
        time_step: Between instants, s.
        rest: Time after the plan's end, s.
    """
    start, end = result.times[0], result.times[-1]
    count = int(np.ceil((end + rest - start) / time_step)) + 1
    times = start + time_step * np.arange(count)
    clock = np.minimum(times, end)
    ends = result.times[[segment.last_frame for segment in result.segments]]
    segments = np.minimum(np.searchsorted(ends, clock, side='right'), len(ends) - 1)
    rests = rest_frames(result.joints, result.segments)
    joints, velocities = _cubics(result.times, result.joints, rests, clock)
    velocities[times >= end] = 0.0
    poses, _ = _cubics(result.times, result.object_poses, rests, clock)
    fed = np.empty(joints.shape)
    for k, segment in enumerate(result.segments):
        inside = segments == k
        own = result.times[segment.first_frame : segment.last_frame + 1]
        for j in range(joints.shape[1]):
            fed[inside, j] = np.interp(clock[inside], own, torques[k][:, j])
    return Reference(
        times - start, segments, joints, velocities, poses, fed, np.asarray(stiff)[segments]
    )


def _cubics(
    times: FloatArray, values: FloatArray, rests: list[int], at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values and slopes of the cubics that a controller puts through a plan's frames."""
    if len(times) < 2:
        return np.repeat(values, len(at), axis=0), np.zeros((len(at), values.shape[1]))
    cubics = CubicHermiteSpline(times, values, joint_velocities(times, values, rests))
    return cubics(at), cubics(at, 1)
