"""Joint velocities for a plan, and the time that it takes to keep them within their limits.

A controller of joint trajectories joins points by cubics with the positions and velocities given.
A plan's own times only keep its average speed between frames within the limits: a cubic that
starts at rest, or one through a turn, is faster than its average, by half at most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Hand
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_ros.conversions.times import LONGEST, NANOSECONDS

_MARGIN = 1e-6
# Lengthening one step makes its neighbours faster, by less each time.
_ROUNDS = 100


def followable(result: PlanResult, hand: Hand) -> PlanResult:
    """Give a plan the times that a controller can follow within the joints' velocity limits.

    Steps of the plan are lengthened one by one until the cubics through its frames, with the
    slopes of `joint_velocities`, keep to the limits. Times become whole nanoseconds. All else
    stays; a plan that is already so, or that has no frames, is not changed.

    Args:
        result: Any outcome.
        hand: With the same joints as the plan.

    Raises:
        CfplanError: The plan takes longer than a message can say.
    """
    if not result.solved:
        return result
    limits = np.array([joint.velocity_limit for joint in hand.joints])
    steps = np.diff(whole_nanoseconds(result.times))
    for _ in range(_ROUNDS):
        excess = _excess(steps, result.joints, limits)
        if not (excess > 1.0).any():
            break
        steps = _lengthened(steps, np.where(excess > 1.0, excess * (1.0 + _MARGIN), 1.0))
    else:
        steps = _lengthened(steps, np.ceil(excess.max()))
    times = np.concatenate([[0], np.cumsum(steps)]) / NANOSECONDS
    return replace(result, times=times)


def joint_velocities(times: FloatArray, joints: FloatArray) -> FloatArray:
    """Slopes with which cubics through the frames stay between neighbouring frames.

    They are Fritsch and Butland's weighted harmonic means of the neighbouring steps' slopes, zero
    where a joint turns round (PCHIP), and zero at both ends.

    Args:
        times: Shape (f,), s, strictly increasing.
        joints: Shape (f, n), rad.

    Returns:
        Shape (f, n), rad/s.
    """
    slopes = np.zeros(joints.shape)
    if len(times) < 3:
        return slopes
    steps = np.diff(times)[:, None]
    secants = np.diff(joints, axis=0) / steps
    before, after = secants[:-1], secants[1:]
    # Signs, not the product: that of two tiny slopes is zero.
    same = (np.sign(before) == np.sign(after)) & (before != 0.0)
    weight_before, weight_after = steps[:-1] + 2.0 * steps[1:], 2.0 * steps[:-1] + steps[1:]
    inverse = np.divide(weight_before, before, where=same, out=np.ones(before.shape))
    inverse += np.divide(weight_after, after, where=same, out=np.ones(before.shape))
    slopes[1:-1] = np.where(same, (weight_before + weight_after) / inverse, 0.0)
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


def whole_nanoseconds(times: FloatArray) -> NDArray[np.int64]:
    """Round times to nanoseconds that still increase strictly, shape (f,).

    Raises:
        CfplanError: A time is too long for a message.
    """
    if len(times) and not times[-1] <= LONGEST:
        raise CfplanError(f'a plan of {times[-1]:g} s: expected at most {LONGEST} s')
    rounded = np.rint(times * NANOSECONDS).astype(np.int64)
    # The smallest strictly increasing sequence above the rounded one.
    place = np.arange(len(rounded))
    return np.asarray(np.maximum.accumulate(rounded - place) + place)


def _excess(steps: NDArray[np.int64], joints: FloatArray, limits: FloatArray) -> FloatArray:
    """Largest part of a velocity limit that a joint needs on each step, shape (f - 1,)."""
    times = np.concatenate([[0], np.cumsum(steps)]) / NANOSECONDS
    speeds = fastest(times, joints, joint_velocities(times, joints))
    return np.asarray((speeds / limits).max(axis=1, initial=0.0))


def _lengthened(steps: NDArray[np.int64], factors: FloatArray) -> NDArray[np.int64]:
    longer = np.ceil(steps * factors)
    if not longer.sum() <= LONGEST * float(NANOSECONDS):
        raise CfplanError(f'a plan of more than {LONGEST} s, the longest that a message can say')
    return longer.astype(np.int64)
