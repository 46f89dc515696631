"""The smallest contact forces that hold the object: the equilibrium whose largest force is least.

For contacts with wrench directions w_i and a load f this is the linear program

    minimise F subject to Σ c_i w_i = −f, 0 ≤ c_i ≤ F.

Its dual asks for the y with Σ max(0, w_i·y) = 1 that makes −f·y largest. Such a y is orthogonal
to two of the w_i, and tells all other forces: F where w_i·y > 0 and zero where w_i·y < 0. So each
choice of two contacts and of a side of their plane leaves three equations for the two forces and
F. Its y is a bound of the dual, so that the first choice whose forces are feasible is the answer.

Where several equilibria have the same F, one with about the least sum of forces is meant: the
program's objective is F plus a vanishing part of that sum, in which no two contacts quite cost
the same. That decides for the contacts with w_i·y = 0, and keeps forces from jumping on a path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem
from cfplan_core.geometry.polygon import FloatArray

_RANK = 1e-8
_COPLANAR = 1e-9
_SINGULAR = 1e-12
_IMBALANCE = 1e-6
_NUMBERS_AT_ONCE = 1 << 20


@dataclass(frozen=True, eq=False)
class Stretch:
    """Configurations of one contact formation.

    Attributes:
        contacts: Names of the elemental contacts that touch in all of them.
        object_poses: Shape (f, 3), poses of the object's frame: m, m, rad.
        joints: Shape (f, n), rad.
    """

    contacts: Sequence[str]
    object_poses: FloatArray
    joints: FloatArray


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Where f configurations of a stretch touch and how hard; the k contacts in its order.

    Attributes:
        points: Shape (f, k, 2), world frame, m.
        normals: Shape (f, k, 2), world frame, unit, from the hand into the object.
        forces: Shape (f, k), N, along the normals; all nan where nothing balances the load.
    """

    points: FloatArray
    normals: FloatArray
    forces: FloatArray


def contact_forces(
    system: ContactSystem, stretches: Sequence[Stretch]
) -> tuple[ContactForces, ...]:
    """Find where contacts are, and the equilibrium whose largest force is least.

    Effort limits of the joints are not regarded.

    Args:
        system: Compiled problem.
        stretches: Of a plan, say; many short ones cost little more than a long one.

    Returns:
        One for each stretch.

    Raises:
        CfplanError: A contact's name is malformed or is of no possible contact.
    """
    points, wrenches = [], []
    for stretch in stretches:
        names = stretch.contacts
        pairs = np.array([system.pair(parse_contact(name)) for name in names], dtype=np.intp)
        placed = system.place(configurations(system, stretch.object_poses, stretch.joints))
        vertices = placed.vertices[:, system.pair_vertex[pairs]] * system.size
        points.append(np.stack([vertices.real, vertices.imag], axis=-1))
        wrenches.append(gap_gradients(system, placed, pairs)[..., :3])
    forces = [np.empty(w.shape[:2]) for w in wrenches]
    for count in {w.shape[1] for w in wrenches}:
        alike = [k for k, w in enumerate(wrenches) if w.shape[1] == count]
        solved = least_forces(np.concatenate([wrenches[k] for k in alike]), system.load)
        ends = np.cumsum([len(wrenches[k]) for k in alike])[:-1]
        for k, part in zip(alike, np.split(solved, ends), strict=True):
            forces[k] = part * system.force_unit
    return tuple(
        ContactForces(p, w[..., :2], c) for p, w, c in zip(points, wrenches, forces, strict=True)
    )


def configurations(
    system: ContactSystem, object_poses: FloatArray, joints: FloatArray
) -> FloatArray:
    """Turn poses of the object's frame (s, 3) and joints (s, n) into z, shape (s, 3 + n)."""
    poses = object_poses
    com = system.problem.object.center_of_mass
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    shift = np.stack([c * com[0] - s * com[1], s * com[0] + c * com[1]], axis=1)
    center = (poses[:, :2] + shift) / system.size
    return np.concatenate([center, poses[:, 2:], joints], axis=1)


def least_forces(wrenches: FloatArray, load: FloatArray) -> FloatArray:
    """Solve W c = −f, c ≥ 0 for the c whose largest entry is least.

    Args:
        wrenches: Shape (s, k, 3), rows are the columns of W; lengths in units of the object's
            size.
        load: Shape (3,), f.

    Returns:
        Shape (s, k); nan where no c balances the load to a millionth of the largest force.
    """
    count = wrenches.shape[1]
    if not count:
        return np.zeros(wrenches.shape[:2])
    rows = max(1, _NUMBERS_AT_ONCE // (2 * (count + 3) ** 3))
    return np.concatenate(
        [np.empty((0, count))]
        + [_least(wrenches[k : k + rows], load) for k in range(0, len(wrenches), rows)]
    )


def _least(wrenches: FloatArray, load: FloatArray) -> FloatArray:
    """As `least_forces`, all configurations at once."""
    samples, count = wrenches.shape[:2]
    spanning = np.concatenate([wrenches, _missing_directions(wrenches)], axis=1)
    first, second = np.triu_indices(count + 3, 1)
    a, b = spanning[:, first], spanning[:, second]
    full = _carries_all(spanning, a, b, count)
    # Three equations: c_a a + c_b b + F Σ_full w = −f.
    common = np.einsum('sptk,ski->spti', full, wrenches)
    a, b = a[:, :, None], b[:, :, None]
    across_b, across_a = np.cross(b, common), np.cross(common, a)
    normal = np.cross(a, b)
    determinant = (common * normal).sum(axis=-1)
    regular = np.abs(determinant) > _SINGULAR
    scale = -1.0 / np.where(regular, determinant, 1.0)
    force_a, force_b = (across_b @ load) * scale, (across_a @ load) * scale
    largest = (normal @ load) * scale
    forces = full * largest[..., None]
    forces = np.concatenate([forces, np.zeros((*forces.shape[:-1], 3))], axis=-1)
    pair = np.arange(len(first))
    forces[:, pair, :, first] = force_a.transpose(1, 0, 2)
    forces[:, pair, :, second] = force_b.transpose(1, 0, 2)

    real, missing = forces[..., :count], forces[..., count:]
    excess = np.maximum(-real.min(axis=-1), real.max(axis=-1) - largest)
    excess = np.maximum(excess, np.abs(missing).max(axis=-1))
    excess = np.where(regular, excess / (1.0 + np.abs(forces).max(axis=-1)), np.inf)
    excess = excess.reshape(samples, -1)
    every, chosen = np.arange(samples), excess.argmin(axis=1)
    best = np.maximum(real.reshape(samples, -1, count)[every, chosen], 0.0)
    best[excess[every, chosen] > _IMBALANCE] = np.nan
    return np.asarray(best)


def _missing_directions(wrenches: FloatArray) -> FloatArray:
    """Orthonormal directions, shape (s, 3, 3), in which no contact pushes; zero rows fill up."""
    directions, values, _ = np.linalg.svd(wrenches.transpose(0, 2, 1))
    missing = np.ones((len(wrenches), 3), dtype=bool)
    missing[:, : values.shape[1]] = values <= _RANK * values[:, :1]
    return np.asarray(directions.transpose(0, 2, 1) * missing[..., None])


def _carries_all(spanning: FloatArray, a: FloatArray, b: FloatArray, count: int) -> BoolArray:
    """Tell which contacts carry the largest force, for each pair and each side of its plane.

    Args:
        spanning: Shape (s, k + 3, 3), wrenches and missing directions.
        a: Shape (s, p, 3), first vectors of the pairs.
        b: Shape (s, p, 3), second vectors.
        count: k.

    Returns:
        Shape (s, p, 2, k).
    """
    wrenches = spanning[:, :count].transpose(0, 2, 1)
    normal = np.cross(a, b)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    height = (normal / np.maximum(length, _SINGULAR)) @ wrenches
    # The price of a force in the plane, w = α a + β b, against that of forces along a and b.
    prices = np.append(_preference(count), np.zeros(3))
    first, second = np.triu_indices(count + 3, 1)
    reciprocal = (
        prices[first, None] * np.cross(b, normal) + prices[second, None] * np.cross(normal, a)
    ) / np.maximum(length, _SINGULAR) ** 2
    gain = reciprocal @ wrenches - prices[:count]
    own = np.arange(count) == first[:, None]
    own |= np.arange(count) == second[:, None]
    level = (np.abs(height) <= _COPLANAR) & (gain > 0.0)
    sides = np.stack([(height > _COPLANAR) | level, (height < -_COPLANAR) | level], axis=2)
    return np.asarray(sides & ~own[:, None])


def _preference(count: int) -> FloatArray:
    """Prices of the contacts' forces: all but equal, so that no two choices cost the same."""
    return np.asarray(1.0 + 0.01 * (0.6180339887498949 * np.arange(1, count + 1) % 1.0))
