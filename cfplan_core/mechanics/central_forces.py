"""The middle of all equilibria: the contact forces that are farthest from losing a contact.

The forces that balance the load, W c = −f with c ≥ 0, make a polytope, which the joints' effort
limits may cut. Its Chebyshev centre is the c with the widest margin r,

    maximise r subject to W c = −f, c_i ≥ r |N_i|, lower_j + r |aᵀN|_j ≤ τ_j ≤ upper_j − r |aᵀN|_j,

where τ = aᵀ c are the joints' torques, a = −J, and the columns of N an orthonormal basis of the
null space of W: a ball of radius r around c, in the forces that balance the load, keeps all
contacts. Where several c have the same margin, the one is taken whose next tightest margin is
widest, and so on: that makes it unique and continuous along a path.

In form closure the polytope has no end, and in force closure it may be long. So no force is to
exceed a cap, which has no margin of its own and gives way to the efforts.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.needed_force import needed_forces

HEADROOM = 1.5
"""The cap on forces is at least this times the needed force, so that there is a margin left."""

_RANK = 1e-8
_FLAT = 1e-12
_ACTIVE = 1e-9


def central_forces(
    wrenches: FloatArray,
    arms: FloatArray,
    load: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    squeeze: float,
) -> FloatArray:
    """Find the middle of the equilibria of each configuration.

    Args:
        wrenches: Shape (s, k, 3), rows are the columns of W; lengths in units of the object's
            size.
        arms: Shape (s, k, n), torque of each joint per contact force, −J.
        load: Shape (3,), f; its length is the unit of force.
        limits: Lower and upper torques, each of shape (s, n), without the links' weight.
        squeeze: Largest contact force wanted, in units of the load; more where `HEADROOM` times
            the needed force is more.

    Returns:
        Shape (s, k), not negative. Where nothing balances the load, the least imbalance.
    """
    samples, count = wrenches.shape[:2]
    forces = np.zeros((samples, count))
    if not count:
        return forces
    cap = force_caps(wrenches, load, squeeze)
    left, values, right = np.linalg.svd(wrenches.transpose(0, 2, 1))
    regular = values > _RANK * values[:, :1]
    inverse = np.divide(1.0, values, where=regular, out=np.zeros_like(values))
    width = values.shape[1]
    base = -np.einsum('swk,sw,sw->sk', right[:, :width], inverse, (load @ left)[:, :width])
    free = count - regular.sum(axis=1)
    lower, upper = limits
    for number in np.unique(free):
        rows = free == number
        rest = right[rows, count - number :]
        if number == 0:
            forces[rows] = base[rows]
        elif number == 1:
            bounds = lower[rows], upper[rows]
            forces[rows] = _on_a_line(base[rows], rest[:, 0], arms[rows], bounds, cap[rows])
        else:
            forces[rows] = [
                _lexicographic(base[k], null, arms[k], (lower[k], upper[k]), float(cap[k]))
                for k, null in zip(np.flatnonzero(rows), rest, strict=True)
            ]
    return np.maximum(forces, 0.0)


def force_caps(wrenches: FloatArray, load: FloatArray, squeeze: float) -> FloatArray:
    """Give the cap on the contact forces of each configuration, as in `central_forces`; (s,)."""
    needed = needed_forces(wrenches, load)
    return np.maximum(squeeze, HEADROOM * np.where(np.isfinite(needed), needed, 0.0))


def _on_a_line(
    base: FloatArray,
    along: FloatArray,
    arms: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    cap: FloatArray,
) -> FloatArray:
    """As `central_forces` where the equilibria are c = base + t·along, t real.

    The centre is the middle of the interval of t, or the end of what the cap leaves that is
    nearest to it.
    """
    low, high = held_interval(base, along, arms, limits)
    crossed = low > high
    both = np.isfinite(low) & np.isfinite(high)
    middle = np.where(both | crossed, 0.5 * (low + high), np.where(np.isinf(low), low, high))
    middle[np.isinf(low) & np.isinf(high)] = 0.0
    low[crossed] = high[crossed] = middle[crossed]
    capped = np.clip(middle, *interval(-along, cap[:, None] - base))
    return np.asarray(base + np.clip(capped, low, high)[:, None] * along)


def held_interval(
    base: FloatArray,
    along: FloatArray,
    arms: FloatArray,
    limits: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Find the t at which no contact pulls and no joint is too weak; forces base + t·along.

    Args:
        base: Shape (s, k).
        along: Shape (s, k).
        arms: Shape (s, k, n), torque of each joint per contact force.
        limits: Lower and upper torques, each of shape (s, n).

    Returns:
        As `interval`.
    """
    torque = np.einsum('sk,skn->sn', base, arms)
    rate = np.einsum('sk,skn->sn', along, arms)
    slopes = np.concatenate([along, rate, -rate], axis=1)
    rooms = np.concatenate([base, torque - limits[0], limits[1] - torque], axis=1)
    return interval(slopes, rooms)


def interval(slopes: FloatArray, rooms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Find the t with slope·t + room ≥ 0 for all m columns.

    Args:
        slopes: Shape (s, m).
        rooms: Shape (s, m).

    Returns:
        Its ends, each of shape (s,); the lower one is above the upper one if there is none.
    """
    zero = -np.divide(rooms, slopes, where=np.abs(slopes) > _FLAT, out=np.zeros_like(rooms))
    low = np.where(slopes > _FLAT, zero, -np.inf).max(axis=1)
    high = np.where(slopes < -_FLAT, zero, np.inf).min(axis=1)
    return low, high


def _lexicographic(
    base: FloatArray,
    null: FloatArray,
    arms: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    cap: float,
) -> FloatArray:
    """As `central_forces` for one configuration, by linear programs in c = base + tᵀ null."""
    from scipy.optimize import linprog  # Costs half a second to import.

    rates = null @ arms
    torque = base @ arms
    slopes = np.concatenate([null, rates, -rates], axis=1).T
    rooms = np.concatenate([base, torque - limits[0], limits[1] - torque])
    lengths = np.linalg.norm(slopes, axis=1)
    useful = (lengths > _ACTIVE) & np.isfinite(rooms)
    slopes, rooms, lengths = slopes[useful], rooms[useful], lengths[useful]
    dimensions, best = len(null), np.zeros(len(null))
    ceiling = (null.T, cap - base)
    fixed = np.zeros(len(slopes), dtype=bool)
    radii = np.zeros(len(slopes))
    cost = np.append(np.zeros(dimensions), -1.0)
    for _ in range(dimensions):
        margins = np.where(fixed, 0.0, lengths)
        matrix = np.concatenate(
            [np.column_stack([-slopes, margins]), np.pad(ceiling[0], ((0, 0), (0, 1)))]
        )
        right = np.concatenate([rooms - radii * lengths, ceiling[1]])
        found: Any = linprog(cost, matrix, right, bounds=(None, None), method='highs')
        if found.status != 0 and len(ceiling[1]):
            ceiling = (np.empty((0, dimensions)), np.empty(0))
            continue
        if found.status != 0:
            break
        best = found.x[:-1]
        active = ~fixed & (found.ineqlin.marginals[: len(slopes)] < -_ACTIVE)
        if not active.any():
            break
        radii[active] = found.x[-1]
        fixed |= active
        if fixed.all():
            break
    return np.asarray(base + best @ null)
