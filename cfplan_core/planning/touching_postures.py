"""Postures of one finger in which it touches the object, which is at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.clearance import Clearance

# Postures that are drawn, and how many links may touch, the last ones.
_DRAWN = 120
_LINKS = 2
# Distance that is kept from everything else and from ends of edges, in object sizes.
_KEPT = 0.004
_INSIDE = 0.02
_ITERATIONS = 8
_LONGEST_STEP = 0.4
_TOUCHING = 1e-10
_SPREAD = 0.5


class Postures(NamedTuple):
    """Postures in which one contact of a finger touches.

    Attributes:
        angles: Shape (c, j), of the finger's joints.
        pairs: Shape (c,).
        gradients: Shape (c, 3 + n), of the gaps of the contacts.
    """

    angles: FloatArray
    pairs: IntArray
    gradients: FloatArray


class TouchingPostures:
    """Draws postures of one finger."""

    def __init__(self, system: ContactSystem, joints: IntArray) -> None:
        """Prepare.

        Args:
            system: Compiled problem.
            joints: Indices of the finger's joints.
        """
        self._system = system
        self._joints = joints
        self._columns = 3 + joints
        moved = np.flatnonzero(system.moves[:, joints].any(axis=1))
        body = system.pair_body[: system.contact_count]
        self._pairs: IntArray = np.flatnonzero(np.isin(body, moved[-_LINKS:]))
        self._clearance = Clearance(system, joints, alone=True)
        self._object = (self._clearance.bodies == 0).any(axis=1)
        self._link = self._clearance.bodies.max(axis=1)

    def draw(
        self, z: FloatArray, around: FloatArray, count: int, rng: np.random.Generator
    ) -> Postures:
        """Draw postures; other fingers are not looked at.

        Args:
            z: Where everything else is, shape (3 + n,).
            around: Postures, shape (a, j), near which half of the others are looked for.
            count: How many at most.
            rng: To draw from.
        """
        system = self._system
        lower, upper = system.lower[self._joints], system.upper[self._joints]
        angles = rng.uniform(lower, upper, (_DRAWN, len(lower)))
        near = np.arange(0, _DRAWN, 2)
        angles[near] = around[rng.integers(len(around), size=len(near))]
        angles[near] += rng.normal(size=(len(near), len(lower))) * _SPREAD
        points = np.tile(z, (_DRAWN, 1))
        points[:, self._columns] = np.clip(angles, lower, upper)
        luck = rng.random((_DRAWN, len(self._pairs)))
        length = system.pair_length[self._pairs]
        gap, offset = gaps(system, system.place(points), self._pairs)
        inside = (offset > _INSIDE) & (offset < length - _INSIDE)
        chosen = np.argmin(np.where(inside, np.abs(gap) + 0.3 * luck, np.inf), axis=1)
        pairs = self._pairs[chosen]
        for _ in range(_ITERATIONS):
            placed = system.place(points)
            gap, rows = self._off(placed, pairs)
            step = rows * (gap / np.maximum((rows**2).sum(axis=1), 1e-3))[:, None]
            largest = np.abs(step).max(axis=1, keepdims=True)
            points[:, self._columns] -= step * np.minimum(
                1.0, _LONGEST_STEP / np.maximum(largest, 1e-12)
            )
        good = self._good(points, chosen, lower, upper)
        points, pairs = points[good][:count], pairs[good][:count]
        gradients = np.empty((len(points), system.dof))
        for k, (point, pair) in enumerate(zip(points, pairs, strict=True)):
            gradients[k] = gap_gradients(system, system.place(point[None]), pair[None])[0, 0]
        return Postures(points[:, self._columns], pairs, gradients)

    def _off(self, placed: Placement, pairs: IntArray) -> tuple[FloatArray, FloatArray]:
        """Gap of one pair in each configuration, shape (s,), and its gradient, (s, j)."""
        system, every = self._system, np.arange(len(pairs))
        vertex, edge = system.pair_vertex[pairs], system.pair_edge[pairs]
        point, normal = placed.vertices[every, vertex], placed.normals[every, edge]
        gap = (normal.conj() * (point - placed.vertices[every, edge])).real
        reach = point[:, None] - placed.axes[:, self._joints]
        moves = system.pair_moves[pairs][:, self._joints]
        return gap, moves * (reach.conj() * normal[:, None]).imag

    def _good(
        self, points: FloatArray, chosen: IntArray, lower: FloatArray, upper: FloatArray
    ) -> IntArray:
        """Which postures touch with the chosen contact and with nothing else."""
        system = self._system
        gap, offset = gaps(system, system.place(points), self._pairs)
        every, length = np.arange(len(points)), system.pair_length[self._pairs]
        angles = points[:, self._columns]
        good = (angles >= lower).all(axis=1) & (angles <= upper).all(axis=1)
        good &= np.abs(gap[every, chosen]) < _TOUCHING
        at = offset[every, chosen]
        good &= (at > _INSIDE) & (at < length[chosen] - _INSIDE)
        touches = (np.abs(gap) < _KEPT) & (offset > -_KEPT) & (offset < length + _KEPT)
        good &= touches.sum(axis=1) == 1
        distances = self._clearance.distances(points)
        body = system.pair_body[self._pairs[chosen]]
        contact = self._object[None] & (self._link[None] == body[:, None])
        good &= (distances > np.where(contact, -1e-9, _KEPT)).all(axis=1)
        return np.asarray(np.flatnonzero(good))
