"""When each frame of a plan is reached, and how fast the joints then are.

A controller joins frames by cubics with the positions and velocities given. A cubic that starts
at rest, or one through a turn, is faster than its average, by half at most; so steps are made as
long as it takes to keep these cubics within the joints' velocity limits.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

NANOSECONDS = 1_000_000_000
"""In a second. Times are whole nanoseconds, as messages and most files count them."""

# Shortest step of a plan, ns.
_SHORTEST = 1000.0
_MARGIN = 1e-6
# Lengthening one step makes its neighbours faster, by less each time.
_ROUNDS = 100


def frame_times(joints: FloatArray, limits: FloatArray) -> FloatArray:
    """Times at which the cubics of `joint_velocities` keep the joints within their limits.

    Args:
        joints: Shape (f, n), rad.
        limits: Shape (n,), rad/s.

    Returns:
        Shape (f,), s, strictly increasing from 0, whole nanoseconds. Each step takes as long as
        its fastest joint needs, and longer only where its cubic would be too fast.
    """
    needed = (np.abs(np.diff(joints, axis=0)) / limits).max(axis=1, initial=0.0)
    steps = np.maximum(_whole(needed * (1.0 + _MARGIN) * NANOSECONDS), _SHORTEST)
    for _ in range(_ROUNDS):
        excess = _excess(steps, joints, limits)
        if not (excess > 1.0).any():
            break
        steps = _whole(steps * np.where(excess > 1.0, excess * (1.0 + _MARGIN), 1.0))
    else:
        steps = _whole(steps * np.ceil(excess.max()))
    return _times(steps)


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


def _times(steps: FloatArray) -> FloatArray:
    return np.concatenate([[0], np.cumsum(steps)]) / NANOSECONDS


def _excess(steps: FloatArray, joints: FloatArray, limits: FloatArray) -> FloatArray:
    """Largest part of a velocity limit that a joint needs on each step, shape (f - 1,)."""
    times = _times(steps)
    speeds = fastest(times, joints, joint_velocities(times, joints))
    return np.asarray((speeds / limits).max(axis=1, initial=0.0))


def _whole(nanoseconds: FloatArray) -> FloatArray:
    return np.asarray(np.ceil(nanoseconds))
