"""How far friction shifts an object that is held by drives of finite stiffness.

Drives that are fed the torques of an equilibrium and pull back with a stiffness κ leave hand and
object free to move along the motions B that keep the contacts, J θ̇ + Wᵀ q̇ = 0, against

    K = κ B_θᵀ B_θ − Bᵀ (Σ c_i ∇²g_i) B,

where the second part is how contact forces turn with the motion. Friction at contact i does the
work of a force of at most μ c_i along the gradient o_i of the contact's place on its edge. To
first order in μ it shifts the object by at most

    μ Σ c_i |B_q K⁻¹ Bᵀ o_i|.

Where K is not positive definite the object is not stable although it is for rigid joints: it falls
into another equilibrium, with the joints pushed aside, also without friction. The links' weight is
left out of K.

The object moves far where the joints move little if the wrenches of three contacts nearly depend
on each other: B_q is large beside B_θ. Two contacts leave a motion to the object for fixed joints;
there the curvature of the energy alone resists.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

DRIVE_STIFFNESS = 330.0
"""Of drives that execute plans, in weights times sizes of the object per radian: for 0.1 kg and
6 cm about 20 N·m/rad."""

_RANK = 1e-9


def friction_shifts(
    gradients: FloatArray,
    slides: FloatArray,
    hessians: FloatArray,
    forces: FloatArray,
    stiffness: float,
) -> FloatArray:
    """Bound the shift of the object's pose by friction, to first order.

    Args:
        gradients: Shape (s, k, 3 + n), of the gaps.
        slides: Likewise, of the contacts' places on their edges.
        hessians: Shape (s, k, 3 + n, 3 + n), of the gaps.
        forces: Shape (s, k), in weights.
        stiffness: Of all joints, in weights times sizes per radian.

    Returns:
        Shape (s,): length of the shift in sizes and radians, for a coefficient of friction of one;
        infinite where the object is not stable.
    """
    bending = np.einsum('sk,skab->sab', forces, hessians)
    _, values, right = np.linalg.svd(gradients)
    ranks = (values > _RANK * values[:, :1]).sum(axis=1)
    shifts = np.zeros(len(gradients))
    for rank in np.unique(ranks):
        some = np.flatnonzero(ranks == rank)
        free = right[some, rank:]
        if not free.shape[1]:
            continue
        turns = free[:, :, 3:]
        kept = free.transpose(0, 2, 1)
        firmness = stiffness * turns @ turns.transpose(0, 2, 1) - free @ bending[some] @ kept
        stable = np.linalg.eigvalsh(firmness)[:, 0] > 0.0
        shifts[some[~stable]] = np.inf
        some, free, kept = some[stable], free[stable], kept[stable]
        pushed = free @ slides[some].transpose(0, 2, 1)
        moved = kept[:, :3] @ np.linalg.solve(firmness[stable], pushed)
        shifts[some] = (forces[some] * np.linalg.norm(moved, axis=1)).sum(axis=1)
    return shifts
