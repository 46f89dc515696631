"""Postures of one finger in which it touches the object, which is at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.clearance import Clearance

# Postures that are drawn, and how many links may touch, the last ones.
_DRAWN = 200
_LINKS = 2
# Distance that is kept from everything else and from ends of edges, in object sizes.
_KEPT = 0.004
_INSIDE = 0.02
_ITERATIONS = 14
# The last of them close the gap alone.
_LAST = 5
_DAMPING = 1e-9
# How much, in object sizes, luck counts beside nearness.
_LUCK = 0.3
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
        chosen, place = self._wanted(points, rng)
        pairs = self._pairs[chosen]
        for left in range(_ITERATIONS, 0, -1):
            off, rows = self._off(system.place(points), pairs, place)
            if left <= _LAST:
                # Where along the edge does not matter in the end.
                off[:, 1], rows[:, 1] = 0.0, 0.0
            square = rows @ rows.transpose(0, 2, 1) + _DAMPING * np.eye(2)
            step = (rows.transpose(0, 2, 1) @ np.linalg.solve(square, off[..., None]))[..., 0]
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

    def _wanted(self, points: FloatArray, rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
        """Choose a contact for each posture, and where on its edge, NaN for anywhere.

        One half of the postures is to make a contact that is near, the other half any.
        """
        system, length = self._system, self._system.pair_length[self._pairs]
        gap, offset = gaps(system, system.place(points), self._pairs)
        inside = (offset > _INSIDE) & (offset < length - _INSIDE)
        far = np.abs(gap) + _LUCK * rng.random(gap.shape)
        chosen = np.argmin(np.where(inside, far, np.inf), axis=1)
        place = np.full(len(points), np.nan)
        anywhere = ~inside.any(axis=1)
        anywhere[::4] = anywhere[1::4] = True
        count = int(anywhere.sum())
        chosen[anywhere] = rng.integers(len(self._pairs), size=count)
        place[anywhere] = length[chosen[anywhere]] * rng.uniform(0.05, 0.95, count)
        return chosen, place

    def _off(
        self, placed: Placement, pairs: IntArray, place: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Gap of one pair in each configuration and its distance from a place on the edge.

        Returns:
            Values, shape (s, 2), and their gradients, shape (s, 2, j).
        """
        system, every = self._system, np.arange(len(pairs))
        vertex, edge = system.pair_vertex[pairs], system.pair_edge[pairs]
        point, normal = placed.vertices[every, vertex], placed.normals[every, edge]
        local = normal.conj() * (point - placed.vertices[every, edge])
        reach = point[:, None] - placed.axes[:, self._joints]
        turning = system.pair_moves[pairs][:, self._joints] * reach.conj()
        free = np.isnan(place)
        off = np.stack([local.real, np.where(free, 0.0, local.imag - place)], axis=1)
        across = (turning * normal[:, None]).imag
        along = np.where(free[:, None], 0.0, (turning * 1j * normal[:, None]).imag)
        return off, np.stack([across, along], axis=1)

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
