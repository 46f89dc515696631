"""The needed force of a grasp: how hard its contacts must press at least to hold the object.

The needed force is the smallest F such that W c = −f has a solution with 0 ≤ c_i ≤ F, in units of
the load. The wrenches that such forces make are F times the zonotope Z = Σ [0, 1] w_i, which
contains 0. So F is the factor by which Z must grow to hold −f, and the facets of Z tell it:

    F = max over y of −f·y / h(y),    h(y) = Σ max(0, w_i·y),

where y runs over both normals of the planes through two of the w_i; Z has no other facets if W has
rank 3. Every y gives a lower bound, so none can make the answer too large. Where h(y) = 0 but
−f·y > 0 nothing balances the load.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import least_forces

# A triple of wrenches with a smaller determinant does not make the rank 3.
_SINGULAR = 1e-6
_EMPTY = 1e-9
_IMBALANCE = 1e-6


def needed_forces(wrenches: FloatArray, load: FloatArray) -> FloatArray:
    """Smallest F with an equilibrium in which no contact force exceeds F.

    Args:
        wrenches: Shape (s, k, 3), rows are the columns of W; lengths in units of the object's
            size.
        load: Shape (3,), f; its length is the unit of force.

    Returns:
        Shape (s,); infinite where nothing balances the load.
    """
    count = wrenches.shape[1]
    if not load.any():
        return np.zeros(len(wrenches))
    if count < 3:
        return _by_forces(wrenches, load)
    first, second = np.triu_indices(count, 1)
    a, b = wrenches[:, first], wrenches[:, second]
    normals = np.empty_like(a)
    normals[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    normals[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    normals[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    heights = normals @ wrenches.transpose(0, 2, 1)
    reach = np.stack([np.maximum(heights, 0.0).sum(axis=2), -np.minimum(heights, 0.0).sum(axis=2)])
    pull = -(normals @ load)
    pull = np.stack([pull, -pull])
    open_sides = reach > _EMPTY
    forces = np.where(open_sides, pull / np.where(open_sides, reach, 1.0), 0.0).max(axis=(0, 2))
    forces[(~open_sides & (pull > _IMBALANCE)).any(axis=(0, 2))] = np.inf
    flat = np.abs(heights).max(axis=(1, 2)) < _SINGULAR
    if flat.any():
        forces[flat] = _by_forces(wrenches[flat], load)
    return np.asarray(forces)


def _by_forces(wrenches: FloatArray, load: FloatArray) -> FloatArray:
    """As `needed_forces`, of any rank."""
    largest = least_forces(wrenches, load).max(axis=1, initial=0.0)
    empty = np.full(len(wrenches), wrenches.shape[1] == 0 and bool(load.any()))
    return np.where(np.isnan(largest) | empty, np.inf, largest)
