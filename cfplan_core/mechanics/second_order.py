"""Two contacts that hold the object where its energy has a strict minimum on them.

Two contacts leave the object one freedom for fixed joints, along t = w_1 × w_2. They balance the
load f where h = t·f = det[w_1 w_2 f] vanishes: there the energy U, whose slope along t is −h, is
stationary, and the forces of W c = −f press if c > 0. The equilibrium is stable to second order
if U, curved as the two contacts' surfaces are, is least there. As U has the slope −h/|t| along the
unit tangent, its curvature, the Hessian of U − Σ c_i g_i on the null space of Wᵀ, is

    μ = −∇_q h·t / |t|².

Where μ ≠ 0 the gradients of g_1, g_2 and h by the pose are independent: the object's pose is a
function of the joint angles, just as it is with three contacts, and n joints make a manifold of
dimension n.

More than two contacts whose wrenches have rank 2 (normals that meet in a point or are parallel)
are left out: they are so only in passing, or neutral, such as a face that lies on a face. So is
one contact, at most neutral: a vertex slides on its edge.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

_IMBALANCE = 1e-7


def imbalance(
    wrenches: FloatArray, rates: FloatArray, load: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Evaluate h = det[w_1 w_2 f] and its gradient.

    Args:
        wrenches: Shape (s, 2, 3), wrench directions.
        rates: Shape (s, 2, 3, m), their gradients (`wrench_rates`).
        load: Shape (3,), f.

    Returns:
        Shapes (s,) and (s, m).
    """
    first, second = wrenches[:, 0], wrenches[:, 1]
    value = np.cross(first, second) @ load
    gradient = (np.cross(second, load)[:, None] @ rates[:, 0])[:, 0]
    gradient += (np.cross(load, first)[:, None] @ rates[:, 1])[:, 0]
    return np.asarray(value), np.asarray(gradient)


def pair_forces(wrenches: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Find the forces of two contacts that come nearest to balancing a load.

    Args:
        wrenches: Shape (s, 2, 3).
        load: Shape (3,), f.

    Returns:
        Forces c, shape (s, 2), and |W c + f|, shape (s,); infinite where the wrenches are
        parallel.
    """
    first, second = wrenches[:, 0], wrenches[:, 1]
    a, b = (first * first).sum(axis=1), (second * second).sum(axis=1)
    mixed = (first * second).sum(axis=1)
    determinant = a * b - mixed**2
    regular = determinant > 1e-12
    safe = np.where(regular, determinant, 1.0)
    p, q = -first @ load, -second @ load
    forces = np.stack([b * p - mixed * q, a * q - mixed * p], axis=1) / safe[:, None]
    rest = (forces[:, None] @ wrenches)[:, 0] + load
    return forces, np.where(regular, np.linalg.norm(rest, axis=1), np.inf)


def curvature(wrenches: FloatArray, rates: FloatArray, load: FloatArray) -> FloatArray:
    """Evaluate μ, in weights times sizes per rad² (or weights per size); see the module.

    Args:
        wrenches: Shape (s, 2, 3), in equilibrium with the load.
        rates: Shape (s, 2, 3, m), m at least 3.
        load: Shape (3,), f.

    Returns:
        Shape (s,); zero where the wrenches are parallel.
    """
    tangent = np.cross(wrenches[:, 0], wrenches[:, 1])
    slope = imbalance(wrenches, rates, load)[1][:, :3]
    length = (tangent * tangent).sum(axis=1)
    along = -(slope * tangent).sum(axis=1)
    return np.asarray(along / np.where(length > 1e-12, length, np.inf))


def second_order_margin(wrenches: FloatArray, rates: FloatArray, load: FloatArray) -> FloatArray:
    """How far two contacts are from no longer holding the object.

    Args:
        wrenches: Shape (s, 2, 3).
        rates: Shape (s, 2, 3, m), their gradients.
        load: Shape (3,), f, of length one.

    Returns:
        Shape (s,): the smallest of the curvature μ, of the two forces in weights, and of |t|, how
        far the wrenches are from parallel. Positive where the grasp is stable to second order,
        and continuous along the equilibria; −1 off them.
    """
    forces, rest = pair_forces(wrenches, load)
    balanced = rest <= _IMBALANCE * (1.0 + np.abs(forces).max(axis=1))
    margin = unbalanced_margin(wrenches, rates, load)
    return np.where(balanced & load.any(), margin, -1.0)


def unbalanced_margin(wrenches: FloatArray, rates: FloatArray, load: FloatArray) -> FloatArray:
    """As `second_order_margin`, but also where the contacts do not quite balance the load.

    There the forces are those that come nearest to it.
    """
    forces, _ = pair_forces(wrenches, load)
    spread = np.linalg.norm(np.cross(wrenches[:, 0], wrenches[:, 1]), axis=1)
    margin = np.minimum(curvature(wrenches, rates, load), forces.min(axis=1))
    return np.asarray(np.minimum(margin, spread))
