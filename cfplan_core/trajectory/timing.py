"""When each frame of a plan is reached, and how fast the joints then are.

A controller joins frames by cubics with the positions and velocities given. Times are such that
these cubics keep limits of velocity and acceleration. A true corner of the path can only be
passed at rest, so a plan is a sequence of smooth stretches, each from rest to rest, which
`cfplan_core.trajectory.parameterization` times.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.parameterization import fastest_steps
from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.trajectory.segment_ends import contact_events

NANOSECONDS = 1_000_000_000
"""In a second. Times are whole nanoseconds, as messages and most files count them."""

CORNER = 0.25
"""Angle in rad between two steps of the joints above which the frame between is a corner."""

# Shortest step of a plan, ns.
_SHORTEST = 1000.0
_MARGIN = 1e-6
# Cubics through the frames with slopes up to this many times the flatter neighbour's are monotone.
_MONOTONE = 3.0
_ROUNDS = 5


def frame_times(
    path: FloatArray,
    joints: int,
    velocity: FloatArray,
    acceleration: FloatArray,
    rests: Sequence[int] = (),
    pace: FloatArray | None = None,
) -> FloatArray:
    """Times at which the cubics through the frames keep limits, soon but not exactly the soonest.

    Args:
        path: Shape (f, m): joint angles, then other coordinates whose acceleration is limited.
        joints: How many columns are joints, whose cubics are those of `joint_velocities`.
        velocity: Shape (m,): limits, inf for none.
        acceleration: Shape (m,): limits, inf for none.
        rests: Frames, in order, at which everything is at rest, besides both ends.
        pace: Shape (f - 1,): share of the velocity limits that each step should use at most; all
            of it if not given. It may be a little more next to a faster step.

    Returns:
        Shape (f,), s, strictly increasing from 0, whole nanoseconds.
    """
    cuts = [0, *rests, len(path) - 1]
    pace = np.ones(len(path) - 1) if pace is None else pace
    steps = [
        _stretch_steps(path[a : b + 1], joints, velocity, acceleration, pace[a:b])
        for a, b in pairwise(cuts)
        if b > a
    ]
    return _times(np.concatenate([np.empty(0), *steps]))


def rest_frames(joints: FloatArray, segments: Sequence[Segment]) -> list[int]:
    """Frames at which a plan is at rest, besides its ends: contact events and corners.

    Args:
        joints: Shape (f, n), rad.
        segments: Of the plan.
    """
    rests = set(contact_events(segments))
    steps = np.diff(joints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if len(steps) > 1:
        along = (steps[:-1] * steps[1:]).sum(axis=1)
        straight = along > np.cos(CORNER) * lengths[:-1] * lengths[1:]
        rests |= {int(k) + 1 for k in np.flatnonzero(~straight)}
    return sorted(rests - {0, len(joints) - 1})


def joint_velocities(
    times: FloatArray, joints: FloatArray, rests: Sequence[int] = ()
) -> FloatArray:
    """Slopes with which cubics through the frames stay between neighbouring frames.

    Those of the parabola through a frame and its neighbours, with which a steady acceleration is
    met exactly; but zero where a joint turns round, at most thrice the flatter neighbouring slope
    (Fritsch & Carlson, 1980), and zero at both ends and where the plan rests.

    Args:
        times: Shape (f,), s, strictly increasing.
        joints: Shape (f, n), rad.
        rests: Frames at which the joints rest.

    Returns:
        Shape (f, n), rad/s.
    """
    slopes = np.zeros(joints.shape)
    if len(times) < 3:
        return slopes
    steps = np.diff(times)[:, None]
    secants = np.diff(joints, axis=0) / steps
    before, after = secants[:-1], secants[1:]
    flatter = np.minimum(np.abs(before), np.abs(after))
    inner = np.clip(_parabolas(steps, secants), -_MONOTONE * flatter, _MONOTONE * flatter)
    slopes[1:-1] = np.where(np.sign(before) == np.sign(after), inner, 0.0)
    slopes[list(rests)] = 0.0
    return slopes


def fastest(times: FloatArray, joints: FloatArray, velocities: FloatArray) -> FloatArray:
    """Largest speed of each joint on each step's cubic, shape (f - 1, n), rad/s.

    Args:
        times: Shape (f,), s.
        joints: Shape (f, n), rad.
        velocities: Shape (f, n), rad/s.
    """
    secants = np.diff(joints, axis=0) / np.diff(times)[:, None]
    first, last = velocities[:-1], velocities[1:]
    # On s in [0, 1] the velocity is a s² + b s + first.
    a = 3.0 * (first + last) - 6.0 * secants
    b = 6.0 * secants - 4.0 * first - 2.0 * last
    inside = np.divide(-b, 2.0 * a, where=a != 0.0, out=np.zeros(a.shape))
    inside = np.clip(inside, 0.0, 1.0)
    extreme = np.abs((a * inside + b) * inside + first)
    return np.asarray(np.maximum(extreme, np.maximum(np.abs(first), np.abs(last))))


def strongest(times: FloatArray, joints: FloatArray, velocities: FloatArray) -> FloatArray:
    """Largest acceleration of each joint on each step's cubic, shape (f - 1, n), rad/s².

    Args:
        times: Shape (f,), s.
        joints: Shape (f, n), rad.
        velocities: Shape (f, n), rad/s.
    """
    steps = np.diff(times)[:, None]
    secants = np.diff(joints, axis=0) / steps
    first, last = velocities[:-1], velocities[1:]
    # The acceleration of a cubic is linear in time.
    start = (6.0 * secants - 4.0 * first - 2.0 * last) / steps
    end = (4.0 * last + 2.0 * first - 6.0 * secants) / steps
    return np.asarray(np.maximum(np.abs(start), np.abs(end)))


def _parabolas(steps: FloatArray, secants: FloatArray) -> FloatArray:
    """Slopes of the parabolas through three successive points each."""
    return np.asarray(
        (steps[1:] * secants[:-1] + steps[:-1] * secants[1:]) / (steps[1:] + steps[:-1])
    )


def _stretch_steps(
    path: FloatArray,
    joints: int,
    velocity: FloatArray,
    acceleration: FloatArray,
    pace: FloatArray,
) -> FloatArray:
    """Steps in ns of a smooth stretch, as `frame_times`."""
    seconds = fastest_steps(path, velocity * pace[:, None], acceleration)
    steps = np.maximum(_whole(seconds * NANOSECONDS), _SHORTEST)
    for _ in range(_ROUNDS):
        excess = _excess(_times(steps), path, joints, velocity, acceleration)
        if excess <= 1.0:
            break
        steps = _whole(steps * excess * (1.0 + _MARGIN))
    return steps


def _excess(
    times: FloatArray,
    path: FloatArray,
    joints: int,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> float:
    """How many times more time a stretch from rest to rest needs to keep its limits."""
    slopes = joint_velocities(times, path)
    if len(times) > 2:
        # Only the joints' cubics are executed: no other coordinate has to stay between frames.
        steps = np.diff(times)[:, None]
        secants = np.diff(path[:, joints:], axis=0) / steps
        slopes[1:-1, joints:] = _parabolas(steps, secants)
    speeds = fastest(times, path, slopes) / velocity
    strengths = strongest(times, path, slopes) / acceleration
    return float(max(speeds.max(initial=0.0), np.sqrt(strengths.max(initial=0.0))))


def _times(steps: FloatArray) -> FloatArray:
    return np.concatenate([[0], np.cumsum(steps)]) / NANOSECONDS


def _whole(nanoseconds: FloatArray) -> FloatArray:
    return np.asarray(np.ceil(nanoseconds))
