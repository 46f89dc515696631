"""The constraint manifold of a contact formation: tangents and projection onto it.

The manifold is {z : g_i(z) = 0 for all contacts i}. Points on it are found by Newton's method on
the square system made of the gaps and of coordinates T (z − z_0) along a tangent basis T, for many
coordinates at once: the steps along a whole stretch of a curve are solved for in one batch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

# Gradients of gaps have rows of size one: below this a row counts as dependent on others.
RANK_TOLERANCE = 1e-7
# Newton's method squares the error: after a step this small it is below rounding.
CONVERGED = 1e-7
_ITERATIONS = 8
# A step this long has lost the manifold.
_ASTRAY = 10.0
# Gaps below this are closed.
_TOUCHING = 1e-10


class Projected(NamedTuple):
    """Points found on a manifold.

    Attributes:
        points: Shape (s, 3 + n).
        gradients: Shape (s, k, 3 + n), of the gaps of the rows asked for, at the points.
        converged: Shape (s,), false where Newton's method found no point.
    """

    points: FloatArray
    gradients: FloatArray
    converged: BoolArray


def independent_rows(gradients: FloatArray) -> tuple[int, ...]:
    """Choose a largest independent set of rows, earlier rows first.

    Args:
        gradients: Shape (k, m).

    Returns:
        Ascending indices.
    """
    count, width = gradients.shape
    if count <= width and float(np.linalg.svd(gradients, compute_uv=False)[-1]) > 1e-3:
        return tuple(range(count))
    basis: list[FloatArray] = []
    chosen = []
    for index, row in enumerate(gradients):
        rest = row - sum((row @ b) * b for b in basis)
        norm = float(np.linalg.norm(rest))
        if norm > RANK_TOLERANCE:
            # A second pass keeps the basis orthogonal to working precision.
            rest = rest / norm
            rest = rest - sum((rest @ b) * b for b in basis)
            basis.append(rest / np.linalg.norm(rest))
            chosen.append(index)
    return tuple(chosen)


def tangent_basis(gradients: FloatArray) -> FloatArray:
    """Orthonormal basis of the null space of independent rows.

    Args:
        gradients: Shape (k, m), rank k.

    Returns:
        Shape (m - k, m).
    """
    count = len(gradients)
    return np.asarray(np.linalg.svd(gradients)[2][count:])


def project(
    system: ContactSystem,
    rows: IntArray,
    origin: FloatArray,
    basis: FloatArray,
    guesses: FloatArray,
) -> Projected:
    """Move guesses onto the manifold, keeping their coordinates along a tangent basis.

    Args:
        system: Compiled problem.
        rows: Pairs whose gaps vanish, independent, shape (k,).
        origin: Shape (3 + n,), or (s, 3 + n) for an origin of each guess's own.
        basis: Shape (3 + n - k, 3 + n), completes the gradients to full rank; or one of each
            guess's own, shape (s, 3 + n - k, 3 + n).
        guesses: Shape (s, 3 + n).

    Returns:
        The points; those that did not converge are where the iteration stopped.
    """
    points = guesses.copy()
    wanted = (basis @ (guesses - origin)[..., None])[..., 0]
    count, k = len(points), len(rows)
    matrix = np.empty((count, system.dof, system.dof))
    matrix[:, k:] = basis
    residual = np.empty((count, system.dof, 1))
    change = np.full(count, np.inf)
    with np.errstate(over='ignore', invalid='ignore'):
        for _ in range(_ITERATIONS):
            placed = system.place(points)
            gradients = gap_gradients(system, placed, rows)
            matrix[:, :k] = gradients
            residual[:, :k, 0] = gaps(system, placed, rows).gap
            residual[:, k:, 0] = (basis @ (points - origin)[..., None])[..., 0] - wanted
            try:
                step = np.linalg.solve(matrix, residual)[..., 0]
            except np.linalg.LinAlgError:
                break
            change = np.abs(step).max(axis=1)
            points -= step
            largest = float(change.max())
            if largest <= CONVERGED:
                break
            if not largest <= _ASTRAY:
                astray = ~(change <= _ASTRAY)
                points[astray] = np.broadcast_to(origin, points.shape)[astray]
    return Projected(points, gradients, change <= CONVERGED)


@dataclass(frozen=True, eq=False)
class Chart:
    """Coordinates on a formation's manifold around one of its points.

    Attributes:
        system: Compiled problem.
        rows: Independent pairs whose gaps vanish, shape (k,).
        origin: Shape (3 + n,).
        basis: Orthonormal tangents, shape (d, 3 + n).
        held: Rows of the coordinates that do not change, shape (3 + n - k - d, 3 + n).
    """

    system: ContactSystem
    rows: IntArray
    origin: FloatArray
    basis: FloatArray
    held: FloatArray

    def project(self, guesses: FloatArray) -> Projected:
        """Move guesses of shape (s, 3 + n) onto the manifold, keeping their coordinates."""
        complement = np.concatenate([self.basis, self.held])
        return project(self.system, self.rows, self.origin, complement, guesses)

    def between(self, before: FloatArray, after: FloatArray, places: FloatArray) -> FloatArray:
        """Points between two points of the manifold, at fractions of shape (s,)."""
        return self.project(before + places[:, None] * (after - before)).points


def settle(system: ContactSystem, z: FloatArray, pairs: IntArray) -> FloatArray:
    """Move a configuration the least way to where contacts touch exactly.

    Args:
        system: Compiled problem.
        z: Shape (3 + n,), touching up to rounding.
        pairs: Contacts, dependent or not, shape (k,).

    Returns:
        Shape (3 + n,), by Gauss-Newton steps of least norm. Joints that these would take beyond a
        limit stay at it where the contacts allow.
    """
    settled = settle_in(system, z, pairs, np.ones(system.dof, dtype=bool))
    clipped = settled.copy()
    clipped[3:] = np.clip(settled[3:], system.lower, system.upper)
    free = clipped == settled
    if free.all():
        return settled
    held = settle_in(system, clipped, pairs, free)
    off = np.abs(gaps(system, system.place(held[None]), pairs).gap).max()
    return held if off < _TOUCHING else settled


def settle_in(
    system: ContactSystem, z: FloatArray, pairs: IntArray, free: BoolArray
) -> FloatArray:
    """Move a configuration to where contacts touch, in some of its coordinates alone.

    Args:
        system: Compiled problem.
        z: Shape (3 + n,).
        pairs: Contacts, dependent or not, shape (k,).
        free: Shape (3 + n,), true for the coordinates that may change.

    Returns:
        Shape (3 + n,), by Gauss-Newton steps of least norm.
    """
    z = z.copy()
    for _ in range(_ITERATIONS):
        placed = system.place(z[None])
        gradients = gap_gradients(system, placed, pairs)[0][:, free]
        step = np.linalg.lstsq(gradients, gaps(system, placed, pairs).gap[0], rcond=1e-9)[0]
        z[free] -= step
        if np.abs(step).max() < 1e-14:
            break
    return z
