"""Torques that keep four contacts in spite of errors, and the joints to be given them.

Let joint e supply the torque τ and the others be held in position. Then W c = −f and aₑᵀ c = τ
determine the four contact forces, c = M⁻¹ (−f, τ) with M = (W; aₑᵀ), and to first order errors of
the contacts, of the load and of the torque change them by

    δc = −M⁻¹ (δM c + (δf, −δτ)).

Where δM comes from gaps or held joints that are off, object and joint e follow: by Mᵀ they move so
that all contacts stay closed. If all errors were r times their typical size, contact i would be
kept while c_i ≥ r eᵢ(c), with eᵢ the sum of the changes' magnitudes; friction counts only where it
takes force away, as its direction is known. The tolerance of τ is the largest such r,

    r(τ) = min_i c_i(τ) / eᵢ(τ).

Above zero it is the ratio of a linear and a convex function of τ for each contact: quasiconcave,
with one maximum, which is found by golden section. That torque is neither the middle of its
interval nor as large as possible: where the interval grows without end towards form closure its
far end is the first to be lost by an error. Of the torques that tolerate nearly as much, the one
with the smallest contact forces is taken, as in form closure the maximum is flat.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.disturbance import GEOMETRY, JOINT, MASS, TORQUE, Disturbance
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.central_forces import held_interval, interval

_SINGULAR = 1e-9
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
# To 5e-4 of the interval.
_SECTIONS = 16
# Nearly as tolerant, and how often the way there is halved.
_ENOUGH = 0.95
_HALVINGS = 8


class Tolerance(NamedTuple):
    """The torque of one joint that tolerates nearly the largest errors.

    Attributes:
        forces: Shape (s, 4), contact forces in weights; nan where the joint's torque does not
            tell them, as at a contact on the joint's axis.
        tolerance: Shape (s,), errors that are tolerated, in typical errors; 0 where no torque
            keeps all contacts, or the joint's torque does not tell the forces.
    """

    forces: FloatArray
    tolerance: FloatArray


def most_tolerant(
    gradients: FloatArray,
    disturbance: Disturbance,
    joint: int,
    load: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    cap: FloatArray,
) -> Tolerance:
    """Find the torque of a joint that tolerates nearly the largest errors, most gently.

    Args:
        gradients: Shape (s, 4, 3 + n), of the gaps of four contacts of rank 3.
        disturbance: What errors do to these.
        joint: Which.
        load: Shape (3,), f; its length is the unit of force.
        limits: Lower and upper torques of all joints, each of shape (s, n), without the links'
            weight.
        cap: Shape (s,), largest contact force wanted; gives way to the limits.
    """
    rows = [0, 1, 2, 3 + joint]
    matrix = _columns(gradients, rows)
    regular = np.abs(np.linalg.det(matrix)) > _SINGULAR
    matrix[~regular] = np.eye(4)
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    base, slope = -inverse[:, :, :3] @ load, inverse[:, :, 3]
    # Forces are linear in (1, τ), and so is what each error changes of them.
    lines = np.stack([base, slope], axis=-1)
    constant, growing = _changes(gradients, disturbance, joint, inverse, lines)
    # Not zero where a contact never presses.
    steady = MASS * np.abs(base) + TORQUE * np.abs(slope) + _SINGULAR
    lean = inverse @ (_columns(disturbance.leaning, rows) @ lines)

    def forces(torque: FloatArray) -> FloatArray:
        return np.asarray(base + torque[:, None] * slope)

    def tolerance(torque: FloatArray) -> FloatArray:
        error = np.abs(constant + torque[:, None] * growing).sum(axis=0) + steady
        error += np.maximum(lean[..., 0] + torque[:, None] * lean[..., 1], 0.0)
        return np.asarray((forces(torque) / error).min(axis=1))

    low, high = _bounds(base, slope, -gradients[..., 3:], limits, cap)
    most = _highest(tolerance, low, high)
    enough = _ENOUGH * tolerance(most)
    gentle = _highest(lambda torque: -forces(torque).max(axis=1), low, high)
    for _ in range(_HALVINGS):
        between = 0.5 * (gentle + most)
        tolerates = tolerance(between) >= enough
        most, gentle = np.where(tolerates, between, most), np.where(tolerates, gentle, between)
    found = np.where(regular, tolerance(most).clip(0.0), 0.0)
    return Tolerance(np.where(regular[:, None], forces(most), np.nan), found)


def _columns(gradients: FloatArray, rows: list[int]) -> FloatArray:
    """Turn gradients (wᵀ, jᵀ) of shape (..., k, 3 + n) into columns (w; a), a = −j."""
    columns = gradients[..., rows].swapaxes(-1, -2).copy()
    columns[..., 3:, :] *= -1.0
    return columns


def _changes(
    gradients: FloatArray,
    disturbance: Disturbance,
    joint: int,
    inverse: FloatArray,
    lines: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """What each of u errors changes of the forces lines · (1, τ): of either part, (u, s, 4)."""
    samples, count, dof = gradients.shape
    free = [0, 1, 2, 3 + joint]
    held = [d for d in range(3, dof) if d != 3 + joint]
    sources = np.zeros((samples, 3 * count + len(held), 4, count))
    turned, shifted = (_columns(part, free) for part in (disturbance.turned, disturbance.shifted))
    for k in range(count):
        sources[:, k, :, k] = turned[..., k]
        sources[:, count + k, :, k] = shifted[..., k]
    # With gaps off by g and held joints by t, (w, j_e) · (q, θ_e) = −g − j_p · t.
    follow = inverse.swapaxes(-1, -2) * [[1.0], [1.0], [1.0], [-1.0]]
    motion = np.zeros((samples, count + len(held), dof))
    motion[:, :count, free] = -2.0 * GEOMETRY * follow.swapaxes(-1, -2)
    motion[:, count:, free] = -JOINT * (follow @ gradients[..., held]).swapaxes(-1, -2)
    for number, d in enumerate(held, count):
        motion[:, number, d] = JOINT
    change = np.einsum('skda,sua->sukd', disturbance.hessians, motion)
    sources[:, 2 * count :] = _columns(change, free)
    changes = inverse[:, None] @ (sources @ lines[:, None])
    constant, growing = np.ascontiguousarray(changes.transpose(3, 1, 0, 2))
    return constant, growing


def _bounds(
    base: FloatArray,
    slope: FloatArray,
    arms: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    cap: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Torques at which no contact pulls, no joint is too weak and no force beyond the cap."""
    low, high = held_interval(base, slope, arms, limits)
    crossed = low > high
    low[crossed] = high[crossed] = 0.5 * (low + high)[crossed]
    ends = interval(-slope, cap[:, None] - base)
    return np.clip(ends[0], low, high), np.clip(ends[1], low, high)


def _highest(
    function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Where quasiconcave functions are highest between bounds, each of shape (s,)."""
    low, high = low.copy(), high.copy()
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(_SECTIONS):
        rises = at_left < at_right
        low, high = np.where(rises, left, low), np.where(rises, high, right)
        left, right = (
            np.where(rises, right, high - _GOLDEN * (high - low)),
            np.where(rises, low + _GOLDEN * (high - low), left),
        )
        new = function(np.where(rises, right, left))
        at_left, at_right = np.where(rises, at_right, new), np.where(rises, new, at_left)
    return np.asarray(0.5 * (low + high))
