"""How much friction against the motion contacts bear before one of them lets go.

A contact that slides with the rate s_i along its edge meets a friction of μ c_i against it, so
that it pushes along w_i − μ sgn(s_i) t_i, where t_i is the gradient of its place on the edge by
the object's pose. The contacts hold the object while the load is in the cone of these,

    Σ c_i (w_i − μ sgn(s_i) t_i) = −f,  c ≥ 0.

Where μ is larger friction carries what a contact should: the object lags behind, and that contact
opens. Unlike other measures of a grasp this one depends on the direction of the motion.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.bases import cross, dot, subsets

# Friction is looked at in so many steps, linear between.
_STEPS = 4
_SINGULAR = 1e-12
# A contact that slides by a smaller part of the motion than this hardly meets friction.
_STICKING = 1e-3
_NEGATIVE = 1e-9


def friction_limits(
    gradients: FloatArray, slides: FloatArray, steps: FloatArray, load: FloatArray, most: float
) -> FloatArray:
    """Find the largest coefficient of friction at which the contacts hold the object.

    Args:
        gradients: Shape (s, k, 3 + n), of the gaps; k at least 3.
        slides: Likewise, of the contacts' places on their edges.
        steps: Shape (s, 3 + n), direction of the motion; zero where there is none.
        load: Shape (3,), f.
        most: Larger ones are not looked for.

    Returns:
        Shape (s,), at most `most`; zero where the contacts do not hold the object at all.
    """
    rates = np.einsum('ska,sa->sk', slides, steps)
    speeds = np.linalg.norm(steps, axis=1, keepdims=True)
    against = np.clip(rates / np.maximum(_STICKING * speeds, _SINGULAR), -1.0, 1.0)
    pull = against[..., None] * slides[..., :3]
    coefficients = most / _STEPS * np.arange(_STEPS + 1)
    rooms = np.stack([_room(gradients[..., :3] - mu * pull, load) for mu in coefficients], axis=1)
    lost = rooms < -_NEGATIVE
    after = lost.argmax(axis=1)
    before = np.maximum(after - 1, 0)
    every = np.arange(len(rooms))
    left, missing = np.maximum(rooms[every, before], 0.0), -rooms[every, after]
    shares = left / np.where(missing > 0.0, left + missing, 1.0)
    limits = most / _STEPS * (before + shares)
    return np.where(lost.any(axis=1), np.where(after == 0, 0.0, limits), most)


def _room(wrenches: FloatArray, load: FloatArray) -> FloatArray:
    """How far the load is inside the cone of contacts; negative outside.

    Returns:
        Shape (s,): of the three contacts that hold it best the least share of the forces; at least
        -1.
    """
    triples = subsets(wrenches.shape[1], 3)
    a, b, c = (wrenches[:, triples[:, k]] for k in range(3))
    sides = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=2)
    determinant = dot(a, sides[:, :, 0])
    forces = -(sides @ load) * np.sign(determinant)[..., None]
    total = np.abs(forces).sum(axis=-1)
    regular = np.abs(determinant) > _SINGULAR
    shares = forces.min(axis=-1) / np.where(regular & (total > 0.0), total, 1.0)
    return np.asarray(np.where(regular, shares, -1.0).max(axis=1))
