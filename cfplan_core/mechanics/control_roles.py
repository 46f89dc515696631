"""Which joints to hold stiffly in position and which to control in torque.

Let the joints E supply given torques and the others, P, be held where they are. Small errors δθ_P
keep all contacts if object and joints of E can follow, Wᵀ q̇ + J_E θ̇_E = −J_P δθ_P, that is if
the columns of J_P lie in the span of those of Wᵀ and J_E. By duality the torques of E then tell
the contact forces: with N a basis of the null space of W, c = c_0 + N s, and τ_E = −J_Eᵀ c tells
as much of s as any torques do. So the least such E has e = rank (NᵀJ) joints: one for each contact
beyond three, unless contacts depend on others whatever the joints do. With fewer, a small error of
P jams the grasp or breaks a contact; with more, joints of E are not kept by anything.

Among the sets E of that size the best is the one whose torques may be off by most: errors of at
most r each change c_i by at most r |row i of N (J_Eᵀ N)⁻¹|₁, so that all contacts are kept while

    r ≤ c_i / |row i of N (J_Eᵀ N)⁻¹|₁.

Trinkle & Hunter (1991), Section 3: "a stiff position control loop closed around one finger and a
torque control loop closed around the other".
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

_RANK = 1e-8
_SINGULAR = 1e-9
# Enough to choose well, few enough to look at all sets.
_MOST_JOINTS = 12
_MOST_SAMPLES = 9


class Roles(NamedTuple):
    """A choice of joints to be controlled in torque; the others are held in position.

    Attributes:
        effort: Their indices, in order.
        margin: By how much each of their torques may be off along the whole stretch before a
            contact is lost, in weights times sizes; infinite if there are none.
    """

    effort: tuple[int, ...]
    margin: float


def control_roles(wrenches: FloatArray, arms: FloatArray, forces: FloatArray) -> tuple[Roles, ...]:
    """Rate the choices of joints for a stretch inside one contact formation.

    Args:
        wrenches: Shape (s, k, 3), rows are the columns of W.
        arms: Shape (s, k, n), torque of each joint per contact force, −J.
        forces: Shape (s, k), c. At the ends of the stretch they do not count, if it has an inside:
            contacts are made and lost there.

    Returns:
        The largest margin first; of equal ones that of the joints with smaller indices.
    """
    inside = slice(1, -1) if len(wrenches) > 2 else slice(None)
    every = max(1, -(-len(wrenches[inside]) // _MOST_SAMPLES))
    w, a, c = (part[inside][::every] for part in (wrenches, arms, forces))
    _, values, right = np.linalg.svd(w.transpose(0, 2, 1))
    rank = int((values > _RANK * values[:, :1]).sum(axis=1).max(initial=0))
    null = right[:, rank:]
    rates = null @ a
    if null.shape[1] > 1:
        # What of the null space the torques tell.
        left, controlled, _ = np.linalg.svd(rates)
        free = int((controlled > _SINGULAR).sum(axis=1).max(initial=0))
        told = left[:, :, :free].transpose(0, 2, 1)
        null, rates = told @ null, told @ rates
    else:
        free = int(np.abs(rates).max(initial=0.0) > _SINGULAR)
    if free == 0:
        return (Roles((), np.inf),)
    strengths = np.linalg.norm(rates, axis=1).max(axis=0)
    order = np.argsort(-strengths, kind='stable')[:_MOST_JOINTS]
    able = sorted(int(joint) for joint in order if strengths[joint] > _SINGULAR)
    choices = [
        Roles(joints, _margin(null, rates[:, :, joints], c)) for joints in combinations(able, free)
    ]
    return tuple(sorted(choices, key=lambda roles: -roles.margin))


def _margin(null: FloatArray, rates: FloatArray, forces: FloatArray) -> float:
    """Least r of a stretch.

    Args:
        null: Shape (s, e, k), rows span the forces that the torques tell.
        rates: Shape (s, e, e), rows are the torques of these.
        forces: Shape (s, k).
    """
    single = rates.shape[1] == 1
    least = np.abs(rates[:, 0]) if single else np.linalg.svd(rates, compute_uv=False)
    if (least[:, -1] <= _SINGULAR).any():
        return 0.0
    change = np.abs(null / rates if single else np.linalg.solve(rates, null)).sum(axis=1)
    ratios = np.divide(forces, change, where=change > _SINGULAR, out=np.full(forces.shape, np.inf))
    return float(ratios.min())
